# Targets are the interface: each does its own set-up in .venv and then runs.
#   make help    this list
#   make paper   the paper's two experiments -> folder paper/
#   make test    all tests
#   make coverage  all tests, and what of the three packages they run
#   make lint    formatting, style, types, import contracts
#   make core    the tests with only the required dependencies
#   make bench   speed and error against C, SciPy, CVODE and PathSim
#   make soak    hard use: fuzzing, kills, a million transitions, 2,000 runs judged by a reference;
#                SOAK_MINUTES=10 for each fuzzer
#   make gallery the pictures kept under docs/, shown in docs/gallery.md
#   make docs    the documentation -> folder site/, to be opened from disk
PYTHON ?= python3
VENV ?= .venv
RUN := $(VENV)/bin
SOAK_MINUTES ?= 10
PIP := $(RUN)/python -m pip --disable-pip-version-check --quiet

.PHONY: help paper test coverage lint core bench soak gallery docs clean
.DEFAULT_GOAL := test

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "gms-fsm needs Python 3.11 or later, this is " + sys.version.split()[0] + "; set PYTHON=python3.12, say")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/all.stamp: pyproject.toml | $(VENV)/bin/python
	$(PIP) install -e ".[all]"
	@touch $@

$(VENV)/dev.stamp: pyproject.toml | $(VENV)/bin/python
	$(PIP) install -e ".[dev]"
	@touch $@ $(VENV)/all.stamp $(VENV)/docs.stamp

$(VENV)/docs.stamp: pyproject.toml | $(VENV)/bin/python
	$(PIP) install -e ".[docs]"
	@touch $@ $(VENV)/all.stamp

$(VENV)/bench.stamp: pyproject.toml | $(VENV)/bin/python
	$(PIP) install -e ".[dev,bench]"
	@touch $@ $(VENV)/dev.stamp

help:
	@sed -n 's/^# \{0,1\}//p' Makefile

.venv-core/stamp: pyproject.toml
	$(PYTHON) -m venv .venv-core
	.venv-core/bin/python -m pip --disable-pip-version-check --quiet install -e . pytest pytest-xdist hypothesis
	@touch $@

paper: $(VENV)/all.stamp
	$(RUN)/gms-fsm paper -o paper

test: $(VENV)/dev.stamp
	$(RUN)/python -m pytest -n auto

coverage: $(VENV)/dev.stamp
	$(RUN)/python -m pytest -n auto --cov --cov-report=term

lint: $(VENV)/dev.stamp
	$(RUN)/ruff format --check .
	$(RUN)/ruff check .
	$(RUN)/mypy
	$(RUN)/lint-imports

core: .venv-core/stamp
	.venv-core/bin/python -m pytest -n auto tests gms_fsm integrators

bench: $(VENV)/bench.stamp
	$(RUN)/python benchmarks/compare.py
	$(RUN)/python benchmarks/live_frames.py
	$(RUN)/python benchmarks/overview_figure.py
	$(RUN)/python benchmarks/monitors.py

soak: $(VENV)/dev.stamp
	$(RUN)/python -m tests.soak --minutes $(SOAK_MINUTES)

gallery: $(VENV)/all.stamp
	$(RUN)/python docs/make_pictures.py

docs: $(VENV)/docs.stamp
	$(RUN)/sphinx-build --quiet --fail-on-warning --keep-going -d .docs-cache/doctrees docs site

clean:
	rm -rf $(VENV) .venv-core .docs-cache paper site build *.egg-info
