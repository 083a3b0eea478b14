# `make` lists the targets. Everything needs python3 (3.11 or newer), venv and make, and nothing else.
PYTHON ?= python3
BIN    := .venv/bin
DEMO   := demo
OTHER_PYTHONS = $(shell $(BIN)/python -c 'import sys; print(*(f"3.{k}" for k in range(11, 15) if k != sys.version_info[1]))')

# keep bytecode whatever the environment says: the tests start hundreds of processes, which would compile it again
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help setup demo test pages quick explore fuzz mutants lint all-pythons wheel peers classroom site bench clean

help:  ## list the targets
	@awk -F':.*## ' '/^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: .venv/ready  ## make the environment in .venv

.venv/ready: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "levilab needs Python 3.11 or newer, this is " + sys.version.split()[0] + ": make PYTHON=python3.12 …")'
	@echo 'making an environment in .venv (2.1 GB, with the tools of the tests) and installing into it: one to four minutes'
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	@touch $@

demo: setup  ## the main job on the virtual bench: acquire, analyze, report (into demo/, which is emptied first)
	@rm -rf $(DEMO)
	$(BIN)/levilab acquire spin --mock --out $(DEMO)
	$(BIN)/levilab analyze spindown $(DEMO)
	$(BIN)/levilab report $(DEMO) --output $(DEMO)/report.html
	@echo 'open $(DEMO)/report.html in a browser'

# mypy works beside the tests: alone it would leave a core idle
test: setup  ## style, types, imports, and all tests but those of pages; ALL=1: these, too
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache
	@$(BIN)/mypy & types=$$!; $(BIN)/python -m pytest $(if $(ALL),,-m 'not pages') && tests=0 || tests=$$?; wait $$types && exit $$tests

pages: setup  ## the tests in a browser, and all commands of README and docs/ one after another
	$(BIN)/python -m pytest -m pages

quick: setup  ## within a minute: style and types, and the tests that are not slow
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy & types=$$!; $(BIN)/python -m pytest -m 'not slow and not pages' && tests=0 || tests=$$?; wait $$types && exit $$tests

explore: setup  ## simulated laboratories for SECONDS (600), and the property tests with new random examples
	$(BIN)/levilab fuzz --seed $(or $(SEED),$(shell date +%s)) --seconds $(or $(SECONDS),600)
	HYPOTHESIS_PROFILE=explore $(BIN)/python -m pytest tests/levilab/formats tests/analysis tests/instruments

fuzz: setup  ## what a fuzzer guided by coverage finds, SECONDS for each target (60); see docs/fuzzing.md
	$(BIN)/nox --session fuzz -- --seconds $(or $(SECONDS),60)

mutants: setup  ## which mistakes in the code the tests would miss, an hour or more the first time; see docs/mutants.md
	$(BIN)/python benchmarks/mutants

lint: setup  ## style, types, import rules, and the number of lines
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	@$(BIN)/python tests/support/size.py

all-pythons: setup  ## the tests, but slow ones that are the same on every Python, against the wheel, on each other Python here (3.11 on)
	@# pyenv shows only the versions that PYENV_VERSION names
	@if command -v pyenv >/dev/null; then \
	  PYENV_VERSION="$$(pyenv version-name):$$(pyenv versions --bare | tr '\n' ':')"; export PYENV_VERSION; fi; \
	$(BIN)/nox --session tests --pythons $(OTHER_PYTHONS)

wheel: setup  ## build the wheel into dist/ and try it in a clean environment, beside a decoy
	$(BIN)/nox --session wheel

peers: setup  ## other people's drivers, in an environment of their own, on the virtual bench
	$(BIN)/nox --session peers

classroom: setup  ## what a teacher hands out for Windows, in dist/classroom: wheel and script, see docs/class.md
	rm -rf dist/classroom
	$(BIN)/python -m pip wheel --disable-pip-version-check --no-deps --wheel-dir dist/classroom .
	cp constraints.txt docs/install-levilab.cmd dist/classroom

site: setup  ## the pages as a site in build/site, in an environment of its own; a warning or a dead link is an error
	$(BIN)/nox --session site
	$(BIN)/python -m pytest -q tests/docs/test_search.py tests/docs/test_reference.py
	@echo "The pages are made: open build/site/index.html in a browser."

bench: setup  ## speed, as ratios within one run (a few minutes); the kept results are in docs/speed.md
	$(BIN)/python benchmarks/spindown.py
	$(BIN)/python benchmarks/startup.py
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[dev,peers]"
	$(BIN)/levilab benchmark simulator
	$(BIN)/python benchmarks/simulator_as_called.py
	$(BIN)/levilab benchmark estimators
	$(BIN)/python benchmarks/wire.py

clean:  ## remove what can be made again
	rm -rf .venv build dist $(DEMO) .nox .pytest_cache .mypy_cache .ruff_cache .hypothesis
