# The two commands: `make demo` (plan, rehearse, report) and `make test` (lint, types, contracts, tests).
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: demo test lint bench chaos screenshots clean

demo: $(VENV)/.runtime
	$(BIN)/ergoflie dry-run missions/imec_four_drones.yaml -o out/demo

test: lint
	$(BIN)/python -m pytest -q -n auto --dist worksteal

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.dev
	$(BIN)/python -m tests.benchmarks --seeds 5

chaos: $(VENV)/.dev
	$(BIN)/python -m tests.benchmarks.chaos

screenshots: $(VENV)/.dev
	$(BIN)/ergoflie plan missions/imec_four_drones.yaml -o out/screenshots.plan.mcap
	$(BIN)/python -m tests.screenshots out/screenshots.plan.mcap -o docs

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "ergoflie needs Python 3.11 or newer; got $$($(PYTHON) --version). Try: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.runtime: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q -e .
	@touch $@

$(VENV)/.dev: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q -e '.[dev]'
	@touch $@ $(VENV)/.runtime

clean:
	rm -rf $(VENV) out build dist *.egg-info
