# Two commands are enough: `make demo` and `make test`. Both do all the set-up.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
# An interpreter by another name is fine as long as it is recent enough.
ifeq ($(shell command -v $(PYTHON) 2>/dev/null),)
PYTHON := python3
endif

.PHONY: demo test check lint compatibility dist dist-test docs bench mutants kernels lock clean help

help:  ## List the commands
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 15

$(VENV)/installer: bootstrap.lock
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "asperity needs Python 3.11 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r bootstrap.lock
	touch $@

$(VENV)/runtime: requirements.lock pyproject.toml | $(VENV)/installer
	$(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python --require-hashes -r requirements.lock
	$(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python --no-deps --no-build-isolation --editable .
	$(BIN)/python -m compileall -q src/asperity
	touch $@

$(VENV)/development: requirements-dev.lock | $(VENV)/runtime
	$(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python --require-hashes -r requirements-dev.lock
	touch $@

demo: $(VENV)/runtime  ## Set up, compare the laws on a bundled surface, write report.html
	$(BIN)/asperity compare examples/demo.toml --html report.html --force

test: $(VENV)/development  ## Set up and run the whole test suite
	$(BIN)/python -m pytest -n auto

check: lint docs  ## Lint, types, import layers, generated files fresh, documentation
	$(BIN)/python -m pytest -n 0 -q tests/docs/test_docs.py -k built_pages

lint: $(VENV)/development  ## Lint, types, import layers, generated files fresh
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m asperity.derive.generate --check

docs: $(VENV)/development  ## Build the documentation into docs/_build/html
	$(BIN)/sphinx-build -W --keep-going -j auto -b html docs docs/_build/html

compatibility: $(VENV)/installer  ## Tests with the lowest and the newest versions, on each Python
	bash .ci/compatibility

dist: $(VENV)/runtime  ## Build the wheel, with machine code, and the source distribution into dist/
	@git diff --quiet HEAD 2>/dev/null || echo "note: not a commit: uncommitted changes are packed, too"
	bash .ci/dist

dist-test: $(VENV)/development  ## Install the wheel on Python 3.11 to 3.14 without a compiler, run it
	ASPERITY_DIST_TEST=yes $(BIN)/python -m pytest -n 0 tests/test_distribution.py

bench: $(VENV)/development  ## Speed and memory, as ratios against C and peers
	$(BIN)/python -m bench

$(VENV)/mutants/ready: mutants.lock | $(VENV)/installer
	$(PYTHON) -m venv $(VENV)/mutants
	$(BIN)/uv pip install --quiet --python $(VENV)/mutants/bin/python --require-hashes -r mutants.lock
	touch $@

MUTANTS := --count 10
mutants: $(VENV)/mutants/ready $(VENV)/development  ## Do the tests notice when the code is wrong? Takes hours
	$(VENV)/mutants/bin/python bench/stress/mutants.py --python $(abspath $(BIN))/python $(MUTANTS)

kernels: $(VENV)/runtime  ## Derive the shipped laws again
	$(BIN)/python -m asperity.derive.generate

lock: $(VENV)/installer  ## Resolve the dependencies anew
	$(BIN)/uv export --quiet --format requirements.txt --no-annotate --no-header --no-emit-project --only-group installer -o bootstrap.lock
	$(BIN)/uv export --quiet --format requirements.txt --no-annotate --no-header --no-emit-project --only-group mutants -o mutants.lock
	$(BIN)/uv export --quiet --format requirements.txt --no-annotate --no-header --no-emit-project --no-default-groups --group build -o requirements.lock
	$(BIN)/uv export --quiet --format requirements.txt --no-annotate --no-header --no-emit-project --no-default-groups --group build --group dev --group docs --extra cluster --extra formats --extra meshes --extra studies -o requirements-dev.lock

clean:  ## Remove the virtual environment and what the tools left
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis report.html docs/_build docs/_generated docs/gallery
