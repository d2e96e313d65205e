# make help lists the targets. The first one used sets up .venv; later ones find it there.

PYTHON ?= python3
BIN    := .venv/bin
STAMP  := .venv/.stamp

# make validate QUICK=1 ARGS="--only hits"; ARGS=--defects and ARGS=--write-baseline likewise
QUICK  ?=
ARGS   ?=
# make conformance TRIMESH=/path/to/a/checkout; its tests need some packages more, such as shapely
TRIMESH ?=

# Languages that this project does without: everything here is Python.
FOREIGN := c cc cpp cxx c++ cu h hh hpp hxx pyx pxd pxi rs

.DEFAULT_GOAL := help
.PHONY: help validate test test-slow machines lint bench conformance docs clean

help:
	@echo "make validate   prove hits and pictures against the references; writes reports/index.html"
	@echo "                QUICK=1 for the short run, ARGS='--only hits' for a part"
	@echo "make test       run the tests that a change needs; ARGS=tests/trace for some"
	@echo "make test-slow  run the others: cache, cluster, documents, packages, and the viewer's page in a browser"
	@echo "make machines   run the tests on a busy, a small, a large and a foreign machine, half an hour"
	@echo "make lint       check style, types, import order and the absence of other languages"
	@echo "make bench      measure speed beside other systems; writes reports/benchmark.html"
	@echo "                QUICK=1 for the short run, ARGS='--mesh FILE', '--huge' or '--avx2' for more"
	@echo "make conformance TRIMESH=DIR   run trimesh's own tests, from a checkout of its repository, with the drop-in"
	@echo "make docs       build the site, gallery included, and check its links; writes build/site/index.html"
	@echo "make clean      remove everything that make made, .venv included"

validate: $(STAMP)
	$(BIN)/python -m validation $(if $(filter-out 0,$(QUICK)),--quick) $(ARGS)

PYTEST := $(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist worksteal
# Rooms of tests that take as long as all the others, and that few changes touch.
SLOW   := tests/cache tests/cluster tests/documents tests/packaging tests/page

test: $(STAMP)
	$(PYTEST) $(SLOW:%=--ignore=%) $(ARGS)

test-slow: $(STAMP)
	$(PYTEST) $(SLOW) $(ARGS)

machines: $(STAMP)
	$(BIN)/python tests/machines.py $(ARGS)

bench: $(STAMP)
	$(BIN)/python -m validation.benchmark $(if $(filter-out 0,$(QUICK)),--quick) $(ARGS)

conformance: $(STAMP)
	$(BIN)/python -m validation.conformance "$(TRIMESH)"

# A warning is an error. Sources are read from here, so that pages outside docs/ and links to them are the site's too.
docs: $(STAMP)
	rm -rf build/site
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --fresh-env --conf-dir docs --doctree-dir build/doctrees . build/site
	$(BIN)/python docs/links.py build/site

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	@foreign=$$(find . \( -path ./.venv -o -path ./.git \) -prune -o -type f \( -false $(FOREIGN:%=-o -name '*.%') \) -print); \
	if [ -n "$$foreign" ]; then echo "lint: only Python here, but found:" $$foreign >&2; exit 1; fi

clean:
	rm -rf .venv build dist docs/examples sg_execution_times.rst *.egg-info .pytest_cache .hypothesis .mypy_cache .ruff_cache .import_linter_cache
	find renderer validation tests scenes -name __pycache__ -prune -exec rm -rf {} +
	find reports -mindepth 1 -maxdepth 1 ! -name README.md ! -name baseline.json -exec rm -rf {} +

$(STAMP): pyproject.toml requirements.lock
	@command -v $(PYTHON) >/dev/null || { echo "make: $(PYTHON) not found; install Python 3.11 or newer, or set PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	|| { echo "make: Python 3.11 or newer is needed, but $(PYTHON) is $$($(PYTHON) -V 2>&1); set PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null \
	|| { echo "make: $(PYTHON) has no venv module; on Debian and Ubuntu: apt-get install python3-venv" >&2; exit 1; }
	@echo "make: installing what requirements.lock lists into .venv (1.4 GB; a few minutes the first time)"
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@
