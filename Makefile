# Each target sets up its own environment in .venv and then runs.
#   make help    this list
#   make paper   the paper's two experiments -> folder paper/
#   make test    all tests
#   make quick   the tests that are not slow, in less than a minute
#   make coverage  all tests, with the coverage of the three packages
#   make lint    formatting, style, types, import contracts
#   make core    the tests that are not slow, with only the required dependencies
#   make lowest  the tests close to a dependency, with the lowest versions that pyproject.toml allows
#   make bench   speed and error compared with C, numba, SciPy, CVODE and PathSim
#   make regressions  speed compared with an older commit, in interleaved rounds; OLD=main
#   make soak    stress tests: fuzzing, kills, a million transitions, 2,000 runs checked against a
#                reference, 500 systems in all engines, verdicts about 400, 1,000 pairs; SOAK_MINUTES=10 for each
#                fuzzer
#   make foreign the widget, driven in JupyterLab and marimo by their own user interfaces, in Chromium,
#                whole runs of friction in other simulators, the exports in the tools they are for, and
#                the tests marked matrix: further sizes, themes and charts
#   make gallery the pictures in docs/images, shown in docs/gallery.md, and the pages in docs/zoo
#   make docs    the documentation -> folder site/, which can be opened from disk
#   make wheel   a wheel -> folder dist/, installed and tested outside the checkout
#   make clean   removes what the other targets created
PYTHON ?= python3
LOWEST_PYTHON ?= python3.11
VENV ?= .venv
RUN := $(VENV)/bin
SOAK_MINUTES ?= 10
OLD ?= main
PIP := $(RUN)/python -m pip --disable-pip-version-check --quiet
# Byte code is kept: tests start hundreds of processes.
unexport PYTHONDONTWRITEBYTECODE
comma := ,
# uv installs in a fraction of pip's time; where it cannot (an index of one's own, say), pip does.
define install
$(1)/bin/python -m pip --disable-pip-version-check --quiet install uv
$(1)/bin/uv pip install --quiet --compile-bytecode --python $(1)/bin/python -e "$(2)" || \
	$(1)/bin/python -m pip --disable-pip-version-check --quiet install -e "$(2)"
endef

.PHONY: help paper test quick coverage lint core lowest bench regressions soak foreign gallery docs wheel clean
.DEFAULT_GOAL := test

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "gms-fsm needs Python 3.11 or later, this is " + sys.version.split()[0] + "; set PYTHON=python3.12, for example")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/all.stamp: pyproject.toml | $(VENV)/bin/python
	$(call install,$(VENV),.[all])
	@touch $@

$(VENV)/dev.stamp: pyproject.toml | $(VENV)/bin/python
	$(call install,$(VENV),.[dev])
	@touch $@ $(VENV)/all.stamp $(VENV)/docs.stamp

$(VENV)/docs.stamp: pyproject.toml | $(VENV)/bin/python
	$(call install,$(VENV),.[docs])
	@touch $@ $(VENV)/all.stamp

$(VENV)/bench.stamp: pyproject.toml | $(VENV)/bin/python
	$(call install,$(VENV),.[dev$(comma)bench])
	@touch $@ $(VENV)/dev.stamp

$(VENV)/foreign.stamp: pyproject.toml | $(VENV)/bin/python
	$(call install,$(VENV),.[dev$(comma)foreign])
	@touch $@ $(VENV)/dev.stamp

help:
	@sed -n '/^[^#]/q; s/^# \{0,1\}//p' Makefile

.venv-core/stamp: pyproject.toml
	$(PYTHON) -m venv .venv-core
	$(call install,.venv-core,.[test])
	@touch $@

# The lowest versions have wheels only for the lowest Python; uv selects them.
.venv-lowest/stamp: pyproject.toml
	@command -v $(LOWEST_PYTHON) >/dev/null || { echo "make lowest needs Python 3.11; set LOWEST_PYTHON"; exit 1; }
	$(LOWEST_PYTHON) -m venv --clear .venv-lowest
	.venv-lowest/bin/python -m pip --disable-pip-version-check --quiet install uv
	.venv-lowest/bin/uv pip install --quiet --python .venv-lowest/bin/python --resolution lowest-direct -e ".[all,cluster,test]"
	@touch $@

paper: $(VENV)/all.stamp
	$(RUN)/gms-fsm paper -o paper

test: $(VENV)/dev.stamp
	$(RUN)/python -m pytest -n auto

quick: $(VENV)/dev.stamp
	$(RUN)/python -m pytest -n auto -m "not slow and not matrix"

coverage: $(VENV)/dev.stamp
	$(RUN)/python -m pytest -n auto --cov --cov-report=term

lint: $(VENV)/dev.stamp
	$(RUN)/ruff format --check .
	$(RUN)/ruff check .
	$(RUN)/mypy
	$(RUN)/lint-imports

core: .venv-core/stamp
	.venv-core/bin/python -m pytest -n auto -m "not slow and not matrix" tests gms_fsm integrators

# transitions; typer and pydantic; llvmlite; scipy; pandas, pyarrow, xarray, distributed; z3; the drawing libraries
LOWEST_TESTS := callbacks_* command_line* overrides_* scenarios_run machine_code_* compiled_* engines_agree scipy_* \
    trace_files_* sweep_* check_command full_screen_* prove_* rendering_* statechart* block_diagram_* panels_* figures_* \
    films_can_* replay_stores_* lessons_taught

lowest: .venv-lowest/stamp
	.venv-lowest/bin/uv pip freeze --python .venv-lowest/bin/python
	.venv-lowest/bin/python -m pytest -n auto $(foreach name,$(LOWEST_TESTS),$(wildcard tests/*/test_$(name).py)) gms_fsm integrators plots

bench: $(VENV)/bench.stamp
	$(RUN)/python benchmarks/compare.py
	$(RUN)/python benchmarks/live_frames.py
	$(RUN)/python benchmarks/overview_figure.py
	$(RUN)/python benchmarks/monitors.py

# asv installs both commits in .asv; it exits with 1 if something has become slower by a tenth.
regressions: $(VENV)/bench.stamp
	cd benchmarks && $(abspath $(RUN))/asv machine --yes
	cd benchmarks && $(abspath $(RUN))/asv continuous --interleave-rounds --factor 1.1 $(OLD) HEAD

soak: $(VENV)/dev.stamp
	$(RUN)/python -m tests.soak --minutes $(SOAK_MINUTES)

# The programs that run the exports, with their packages where these have other names; without one of
# them its checks are skipped, and it is named.
FOREIGN_PROGRAMS := gcc g++ clang octave-cli:octave node:nodejs npm plantuml pdftotext:poppler-utils \
    pdflatex:texlive-latex-recommended,texlive-pictures chromium git autoconf automake flex bison

# One check after the other: each writes its rows of tests/foreign/exports.json at the end. Packages
# are installed one by one: one that cannot be does not keep out the others.
foreign: $(VENV)/foreign.stamp
	@for each in $(FOREIGN_PROGRAMS); do command -v $${each%%:*} >/dev/null || missing="$$missing $$each"; done; \
	if [ -n "$$missing" ] && command -v apt-get >/dev/null && [ "$$(id -u)" = 0 ]; then \
	    apt-get update -qq; \
	    for each in $$missing; do \
	        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $$(echo $${each##*:} | tr , ' ') >/dev/null; \
	    done; \
	fi; \
	for each in $$missing; do \
	    command -v $${each%%:*} >/dev/null || echo "make foreign: $${each%%:*} is not installed; what needs it is not run"; \
	done
	$(RUN)/python -m pytest tests/foreign/check_*.py
	$(RUN)/python docs/make_exports.py
	$(RUN)/python -m tests.foreign
	$(RUN)/python -m pytest -n auto -m matrix tests

gallery: $(VENV)/dev.stamp
	$(RUN)/python docs/make_pictures.py
	$(RUN)/python docs/make_screens.py
	$(RUN)/python docs/make_zoo.py
	$(RUN)/python docs/make_phenomena.py
	$(RUN)/python docs/make_coverage.py

docs: $(VENV)/docs.stamp
	$(RUN)/sphinx-build --quiet --fail-on-warning --keep-going -d .docs-cache/doctrees docs site

# setuptools would add leftovers of an earlier build in build/ to the wheel.
wheel: | $(VENV)/bin/python
	rm -rf build dist
	$(PIP) wheel --no-deps --wheel-dir dist .
	@set -ex; unset PYTHONPATH; wheel=$$(ls "$(CURDIR)"/dist/*.whl); away=$$(mktemp -d); \
	trap 'rm -rf "$$away"' EXIT; $(PYTHON) -m venv "$$away/venv"; cd "$$away"; \
	venv/bin/python -m pip --disable-pip-version-check --quiet install "$$wheel[plots,replay]"; \
	venv/bin/gms-fsm --help; \
	venv/bin/gms-fsm paper -o paper; \
	venv/bin/gms-fsm replay paper/traces/fig4_chart.npz -o page.html

clean:
	rm -rf $(VENV) .venv-core .venv-lowest .asv .docs-cache paper site build dist *.egg-info
