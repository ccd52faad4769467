# The one environment for everything: made from constraints.txt, made again when that changes.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed
PYHARM := .venv/pyharm/.installed
# Tests run side by side in processes; threads inside each would only fight over the cores.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1

.PHONY: run test test-full bench lint check install clean
.DEFAULT_GOAL := run

run: check
	$(BIN)/fretscale run cases/dovetail.yaml --out out/dovetail --force

test: check lint
	$(ONE_THREAD) $(BIN)/python -m pytest -q -n 2

test-full: check lint
	$(ONE_THREAD) $(BIN)/python -m pytest -q -n 2 -m "slow or not slow"

bench: check
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e '.[test,bench]'
	-$(MAKE) $(PYHARM)
	$(ONE_THREAD) $(BIN)/python -m pytest -q -s tests/benchmarks/test_tamaas.py
	$(ONE_THREAD) $(BIN)/python -m pytest -q -s -m "slow or not slow" tests/benchmarks \
	    --ignore tests/benchmarks/test_tamaas.py

# A peer that is measured beside ours. It brings a hundred packages: an environment of its own.
$(PYHARM):
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip install -q --disable-pip-version-check -c constraints.txt \
	    pyharm-os==1.2.2
	@touch $@

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

# Ends in one line naming the Debian packages to install when a system library is missing.
check: install
	@$(BIN)/python -m workflow.shell.system_check

install: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo 'fretscale: needs Python 3.11 or newer; choose one with: make PYTHON=python3.12'; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	    { echo 'fretscale: needs the venv module; install with: apt-get install python3-venv'; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e '.[test]'
	@touch $(STAMP)

clean:
	rm -rf .venv out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache \
	    .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
