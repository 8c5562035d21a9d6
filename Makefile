# Targets are the interface: each does its own set-up in .venv and then runs.
#   make paper   the paper's two experiments -> folder paper/
#   make test    all tests
#   make lint    formatting, style, types, import contracts
#   make core    the tests with only the required dependencies
#   make bench   speed against hand-written SciPy
#   make gallery the pictures kept under docs/, shown in docs/gallery.md
PYTHON ?= python3
VENV ?= .venv
RUN := $(VENV)/bin
PIP := $(RUN)/python -m pip --disable-pip-version-check --quiet

.PHONY: paper test lint core bench gallery clean
.DEFAULT_GOAL := test

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "gms-fsm needs Python 3.11 or later, this is " + sys.version.split()[0] + "; set PYTHON=python3.12, say")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/all.stamp: pyproject.toml | $(VENV)/bin/python
	$(PIP) install -e ".[all]"
	@touch $@

$(VENV)/dev.stamp: pyproject.toml | $(VENV)/bin/python
	$(PIP) install -e ".[dev]"
	@touch $@ $(VENV)/all.stamp

.venv-core/stamp: pyproject.toml
	$(PYTHON) -m venv .venv-core
	.venv-core/bin/python -m pip --disable-pip-version-check --quiet install -e . pytest pytest-xdist hypothesis
	@touch $@

paper: $(VENV)/all.stamp
	$(RUN)/gms-fsm paper -o paper

test: $(VENV)/dev.stamp
	$(RUN)/python -m pytest -n auto

lint: $(VENV)/dev.stamp
	$(RUN)/ruff format --check .
	$(RUN)/ruff check .
	$(RUN)/mypy
	$(RUN)/lint-imports

core: .venv-core/stamp
	.venv-core/bin/python -m pytest -n auto tests gms_fsm integrators

bench: $(VENV)/dev.stamp
	$(RUN)/python benchmarks/pulled_mass.py
	$(RUN)/python benchmarks/live_frames.py
	$(RUN)/python benchmarks/overview_figure.py

gallery: $(VENV)/all.stamp
	$(RUN)/python docs/make_pictures.py

clean:
	rm -rf $(VENV) .venv-core paper build *.egg-info
