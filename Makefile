# Commands for users and developers. Each goal installs what it needs.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
# With the optional packages, for their tests.
FULL   := $(VENV)/.ready-full
DOCS   := $(VENV)/.ready-docs
SITE   := out/site
# Quiet twice: show errors, but no warnings, for example about missing folders of the package index.
# `compileall` uses all cores, pip one.
$(READY): EXTRAS = dev
$(FULL): EXTRAS = dev,dask,docs
$(DOCS): EXTRAS = dev,docs
define install
@PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --quiet \
  --disable-pip-version-check --no-compile --editable '.[$(EXTRAS)]'
@$(BIN)/python -m compileall -qq -j 0 -x '/tests/' $(VENV)/lib
endef
# Tests start hundreds of processes: keep compiled bytecode for them, even if the environment forbids it.
test test-full test-weekly test-newest: export PYTHONDONTWRITEBYTECODE =
# One process per core. Tests of a file run in one process, which compiles and loads shared code once.
# Files run in the order of the folders, so that files with few long tests do not come last.
PARALLEL = -n auto --dist loadfile --no-loadscope-reorder

.PHONY: setup demo test test-full test-weekly test-newest lint check seal bench docs clean

setup: $(READY)

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "trackmark needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1)." \
	         "Name another: make $(MAKECMDGOALS) PYTHON=python3.12" >&2; exit 2; }
	@echo "Setting up $(VENV) with the packages of constraints.txt: a minute or two, once."
	@$(PYTHON) -m venv $(VENV)
	$(install)
	@find bench datasets trackers -name '*.nb[ci]' -delete  # kernels compiled for older packages
	@touch $@

$(FULL): $(READY)
	$(install)
	@touch $@

$(DOCS): $(READY)
	$(install)
	@touch $@

demo: $(READY)
	@$(BIN)/trackmark demo

test: $(READY)
	$(BIN)/python -m pytest $(PARALLEL)

test-full: $(FULL)
	@command -v chromium chromium-browser google-chrome >/dev/null || \
	  echo "NO BROWSER: tests that drive pages are skipped. Install Debian's chromium." >&2
	$(BIN)/python -m pytest $(PARALLEL) -m "not weekly"

test-weekly: $(FULL)
	$(BIN)/python -m pytest $(PARALLEL) -m weekly

# The everyday tests, or TESTS="tests/datasets ...", with the newest packages instead of those of
# constraints.txt. The newest packages can need a newer Python: NEWEST_PYTHON selects another.
NEWEST := .venv-newest
NEWEST_PYTHON ?= $(shell for python in python3.13 python3.12; do \
  $$python -c '' 2>/dev/null && echo $$python && exit; done; echo $(PYTHON))

test-newest:
	@echo "Setting up $(NEWEST) anew with the newest packages for $$($(NEWEST_PYTHON) --version)."
	@$(NEWEST_PYTHON) -m venv --clear $(NEWEST)
	@env -u PIP_CONSTRAINT $(NEWEST)/bin/python -m pip install --quiet --quiet \
	  --disable-pip-version-check --editable '.[dev]'
	@$(NEWEST)/bin/python -m pip freeze --exclude-editable --disable-pip-version-check | \
	  diff constraints.txt - | grep '^>' || echo "No package is newer than in constraints.txt."
	$(NEWEST)/bin/python -m pytest $(PARALLEL) $(TESTS)

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Check whether our trackers score as in tests/baseline.toml, on one of its sequences.
check: $(READY)
	@$(BIN)/trackmark check tests/baseline.toml --repetitions 6 --sequences 'plain/*' --results-root "$$(mktemp -d)"

# Compare the output of changed scenes and trackers with the stored digests. NEW=name accepts a change.
seal: $(READY)
	$(BIN)/python -m tools.golden_check $(addprefix --new ,$(NEW))

bench: $(READY)
	$(BIN)/python -m pytest tests/speed --benchmark-enable \
	  --benchmark-timer=time.thread_time --benchmark-sort=name

# The documentation site. Not --quiet: strict mode counts only warnings that are logged.
docs: $(DOCS)
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --site-dir $(SITE)
	@echo "Open $(SITE)/index.html."

clean:
	rm -rf $(VENV) $(NEWEST) .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache
