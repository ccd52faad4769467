# One environment: `make run` installs what running needs, `make test` adds what testing needs.
# Both are brought up to date when pyproject.toml or constraints.txt changes.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt
INSTALLED := .venv/.installed
TESTABLE := .venv/.testable
DOCUMENTABLE := .venv/.documentable
SYSTEM_CHECK := workflow/shell/system_check.py
PYHARM := .venv/pyharm/.installed
# Tests run side by side in processes; threads inside each would only fight over the cores. What is
# compiled of them is kept for the other process, those that they start, and the next time.
TESTING := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE=

.PHONY: run test test-slow test-full bench lint docs docs-gallery docs-figures install clean
.DEFAULT_GOAL := run

run: $(INSTALLED)
	@echo 'fretscale: the case takes one to two minutes on two cores, 110 MB in out/dovetail.'
	$(BIN)/fretscale run cases/dovetail.yaml --out out/dovetail --force

test: $(TESTABLE)
	@echo 'fretscale: style, types and layers, then the tests: about 5 minutes on two cores.'
	@$(MAKE) --no-print-directory lint
	$(TESTING) $(BIN)/python -m pytest -q -n 2 --dist worksteal

test-full: test test-slow

test-slow: $(TESTABLE)
	@echo 'fretscale: the tests of more than a few seconds: about 20 minutes on two cores.'
	$(TESTING) $(BIN)/python -m pytest -q -n 2 --dist worksteal -m slow

lint: $(TESTABLE)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

# Tutorials are run, and every warning is an error; what has been run is kept while it is the same.
docs: $(DOCUMENTABLE)
	@echo 'fretscale: the pages, with the runs of their tutorials: 2 minutes on two cores.'
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 \
	    $(BIN)/sphinx-build -q -W --keep-going -n -j 2 -b html docs docs/_build/html
	@echo 'fretscale: open docs/_build/html/index.html'

# Takes finished runs of out/gallery, and computes what is not there.
docs-gallery: $(DOCUMENTABLE)
	@echo 'fretscale: all shipped cases, then their pictures: about 20 minutes of one core.'
	PATH=$(CURDIR)/$(BIN):$$PATH $(BIN)/python docs/draw_gallery.py out/gallery

docs-figures: $(DOCUMENTABLE)
	@echo 'fretscale: the runs and charts that the pages show: about an hour and a half of one core.'
	PATH=$(CURDIR)/$(BIN):$$PATH $(BIN)/python docs/draw_figures.py out/figures
	PATH=$(CURDIR)/$(BIN):$$PATH $(BIN)/python docs/validate.py out/validation
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python docs/method_charts.py
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 $(BIN)/python docs/limit_figures.py
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 $(BIN)/python docs/cost_charts.py

bench: $(TESTABLE)
	$(PIP) -e '.[test,bench]'
	-$(MAKE) $(PYHARM)
	$(TESTING) $(BIN)/python -m pytest -q -s tests/benchmarks/test_tamaas.py
	$(TESTING) $(BIN)/python -m pytest -q -s -m "slow or not slow" tests/benchmarks \
	    --ignore tests/benchmarks/test_tamaas.py

install: $(INSTALLED)

# What the system lacks is found, and installed or named, before anything is downloaded.
$(INSTALLED): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo 'fretscale: needs Python 3.11 or newer; choose one with: make PYTHON=python3.12'; exit 1; }
	@$(PYTHON) -I $(SYSTEM_CHECK)
	@echo 'fretscale: installing in .venv: 680 MB to download, 2.3 GB on disk, 2 to 4 minutes.'
	$(PYTHON) -m venv .venv
	$(PIP) -e .
	@$(BIN)/python -I $(SYSTEM_CHECK) --imports
	@touch $@

$(TESTABLE): $(INSTALLED)
	@echo 'fretscale: installing what tests add: 55 MB to download, 250 MB on disk, a minute.'
	$(PIP) -e '.[test]'
	@touch $@

$(DOCUMENTABLE): $(INSTALLED)
	@echo 'fretscale: installing what the pages need: 35 MB to download, 150 MB on disk, a minute.'
	$(PIP) -e '.[docs]'
	@touch $@

# A peer that is measured beside ours. It brings a hundred packages, some of them older than ours:
# an environment of its own.
$(PYHARM):
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip install -q --disable-pip-version-check pyharm-os==1.2.2
	@touch $@

clean:
	rm -rf .venv out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache \
	    .hypothesis docs/_build docs/reference/cases docs/reference/libraries \
	    docs/reference/messages \
	    docs/gallery/index.md
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
