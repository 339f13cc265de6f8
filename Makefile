# `make demo` and `make test` need nothing but Python 3.11 or newer.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
WORKERS ?= auto

.PHONY: demo test test-slow lint docs clean

demo: $(INSTALLED)
	$(BIN)/pathspace run configs/cornell.yaml --out runs/cornell --resume

test: lint
	$(BIN)/pytest -n $(WORKERS) -m "not slow"

test-slow: $(INSTALLED)
	$(BIN)/pytest -n $(WORKERS)

lint: $(INSTALLED)
	$(BIN)/ruff check
	$(BIN)/mypy

docs: $(INSTALLED)
	$(BIN)/python -m pipeline.job_docs > docs/jobs.md

clean:
	rm -rf runs build dist

$(INSTALLED): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[test]"
	touch $@
