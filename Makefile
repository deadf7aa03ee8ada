# Two commands: `make report` does the main job, `make test` passes the tests. Both set up .venv first, once.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
export ROM_CACHE ?= $(CURDIR)/.cache

EXPERIMENTS := $(filter-out experiments/script.py experiments/fuzz_files.py experiments/solve_choice.py experiments/interactive_page.py %_figures.py,$(wildcard experiments/*.py))

.PHONY: report report-quick serve experiments experiments-quick test fuzz test-browser measure-page lint clean

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[networks,dev]"
	touch $@

report: $(STAMP)
	$(BIN)/rom report --output reports

report-quick: $(STAMP)
	$(BIN)/rom report --output reports/quick --quick

serve: $(STAMP)
	$(BIN)/rom serve

experiments: $(STAMP)
	set -e; for script in $(EXPERIMENTS); do echo "== $$script"; $(BIN)/python $$script; done

experiments-quick: $(STAMP)
	set -e; for script in $(EXPERIMENTS); do echo "== $$script"; $(BIN)/python $$script --quick; done

test: $(STAMP)
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses logical --maxprocesses 4 --dist loadfile

test-browser: $(STAMP)
	tests/browser/install_chromium.sh
	$(BIN)/python -m pytest tests/browser

fuzz: $(STAMP)
	$(BIN)/python experiments/fuzz_files.py

measure-page: $(STAMP)
	tests/browser/install_chromium.sh
	$(BIN)/python experiments/interactive_page.py

lint: $(STAMP)
	$(BIN)/ruff check rom experiments tests
	$(BIN)/mypy

clean:
	rm -rf .cache build *.egg-info
