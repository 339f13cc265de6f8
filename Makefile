# `make demo` and `make test` need nothing but Python 3.11 or newer.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
WORKERS ?= auto

# Programs that tests start would compile every module of the project again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test test-quick test-slow lint docs clean

demo: $(INSTALLED)
	$(BIN)/pathspace run configs/cornell.yaml --out runs/cornell --resume

# Side by side: mypy is one process, and pytest ends with one worker.
test: $(INSTALLED)
	$(MAKE) --keep-going --jobs 2 lint test-quick

test-quick: $(INSTALLED)
	$(BIN)/pytest -n $(WORKERS) -m "not slow"

test-slow: $(INSTALLED)
	PATHSPACE_ALL_EXAMPLES=1 $(BIN)/pytest -n $(WORKERS)

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
