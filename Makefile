# Everything is set up in .venv; nothing else is assumed than Python >= 3.11, make and git.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test test-slow check format lock bench clean

demo: $(VENV)/.installed
	$(BIN)/mission fly examples/search.toml --speed 10 --out runs/demo-$$(date +%Y%m%d-%H%M%S)

# As `mission` does: products of matrices that share the cores with other workers take a hundred times as long in threads.
test test-slow: export OPENBLAS_NUM_THREADS = 1

test: check
	$(BIN)/python -m pytest -n auto --dist loadfile -m "not slow and not sitl"

test-slow: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m "slow"

check: $(VENV)/.installed-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright
	$(BIN)/pyright --project pyright-names.json
	$(BIN)/lint-imports

format: $(VENV)/.installed-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# Names and versions only, so that the file holds on every registry and platform.
lock: $(VENV)/.installed-dev
	$(BIN)/pip freeze --exclude-editable --exclude ergonaut | grep -v '@' | sort -f > requirements.lock

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed, this is " + sys.version.split()[0] if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml requirements.lock
	@echo "Installing what the planner needs into $(VENV): a minute or so, in silence."
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock --editable .
	touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	@echo "Installing what the checks and tests need, too: half a minute."
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock --group dev
	touch $@

clean:
	rm -rf $(VENV) .pytest_cache .ruff_cache build dist
