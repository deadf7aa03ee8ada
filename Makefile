# Two commands: `make report` does the main job, `make test` passes the tests. Both set up .venv first, once.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
export ROM_CACHE ?= $(CURDIR)/.cache

.PHONY: report report-quick test test-all lint clean

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[networks,dev]"
	touch $@

report: $(STAMP)
	$(BIN)/rom report --output reports

report-quick: $(STAMP)
	$(BIN)/rom report --output reports/quick --quick

test: $(STAMP)
	$(BIN)/python -m pytest

test-all: $(STAMP)
	$(BIN)/python -m pytest -m ""

lint: $(STAMP)
	$(BIN)/ruff check rom experiments tests
	$(BIN)/mypy

clean:
	rm -rf .cache build *.egg-info
