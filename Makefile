# hoz-dist: every target works from a fresh clone; the first one that needs packages installs them into .venv.
# Needs Python 3.11 (PyBullet has no wheels for newer ones). Another place for it: make PYTHON=/path/to/python3.11 ...

PYTHON ?= $(firstword $(shell for p in python3.11 python3 python; do \
	command -v $$p >/dev/null && $$p -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' && command -v $$p; done))
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

DEMO ?= train --run runs/demo --minutes 10

.DEFAULT_GOAL := help
.PHONY: help demo test test-long check format install install-dev clean

help:  ## Say what the targets do.
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 14

demo: install  ## Train on all four scenes, evaluate, draw pictures; about 12 minutes.
	$(BIN)/hoz-dist $(DEMO)

test: install-dev  ## Run all tests but the long ones.
	$(BIN)/python -m pytest

test-long: install-dev  ## Run the tests that take minutes.
	$(BIN)/python -m pytest -m long --timeout 1800

check: install-dev  ## Check style, types and the direction of imports.
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

format: install-dev  ## Format the code and mend what can be mended by itself.
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

install: $(VENV)/.installed  ## Make .venv with hoz-dist in it.

install-dev: $(VENV)/.installed-dev  ## Make .venv with hoz-dist and the development tools in it.

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "No Python 3.11 found: install it (PyBullet has no wheels for newer ones), \
	or say where it is: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

# torch goes first and pinned: see constraints.txt.
$(VENV)/.installed: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) torch
	$(PIP) --editable .
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(PIP) --editable ".[dev]"
	@touch $@

clean:  ## Remove .venv, caches and build results; runs/ stays.
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -not -path './$(VENV)/*' -type d -prune -exec rm -rf {} +
