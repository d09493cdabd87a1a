# make run, make bench: each makes .venv first, once, from requirements.lock (what railsim runs with).
# make all-formats adds requirements-dev.lock: readers of MDF, TDMS and HDF5, clusters, tools and tests; make test calls it.
# make docs adds requirements-docs.lock and writes results/site; make gallery draws the pictures that its gallery shows.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.complete
ALL := .venv/.complete-all
DOCS := .venv/.complete-docs
TUTORIALS := $(filter-out index,$(basename $(notdir $(wildcard docs/tutorials/*.md))))
PIP := $(BIN)/python -m pip --disable-pip-version-check

.PHONY: run all-formats test types kernels tests bench docs gallery system-check clean
.DELETE_ON_ERROR:

run: $(STAMP)
	$(BIN)/railsim run default --out results/default

all-formats: $(ALL)

test: $(ALL)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports
	$(MAKE) --no-print-directory -j 2 types tests

# Types take one core for a minute and a half: beside the tests.
types: $(ALL)
	$(BIN)/pyright

# Two workers that begin together would each compile what nearly all tests need: once, beside the types.
kernels: $(ALL)
	@$(BIN)/railsim run default --engine compiled --set duration=5 --out results/.kernels > /dev/null
	@rm -rf results/.kernels

# The workers are the parallelism: linear algebra in threads of its own would only wait for the others. A file is done by
# one worker; the files that take longest come first (tests/conftest.py), so that neither worker is left with one.
tests: kernels
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder

bench: $(STAMP)
	$(BIN)/railsim bench

# Every tutorial runs from top to bottom, once until its page changes; links and anchors are checked.
docs: $(DOCS) $(TUTORIALS:%=results/tutorials/%.md)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

results/tutorials/%.md: docs/tutorials/%.md | $(DOCS)
	$(BIN)/python docs/site/tutorials.py $*

gallery: $(STAMP)
	$(BIN)/railsim figure all --fast --out results/gallery

# Says what the system lacks (Python 3.11, libGL.so.1, libX11.so.6) before anything is made.
system-check:
	@command -v $(PYTHON) >/dev/null || { echo "railsim: $(PYTHON) is not installed: install python3.11 and python3.11-venv (Debian package names)" >&2; exit 2; }
	@$(PYTHON) -I railsim/system_check.py

$(STAMP): requirements.lock pyproject.toml | system-check
	@echo "Making .venv from requirements.lock (once, about a minute) ..."
	@rm -rf .venv
	$(PYTHON) -m venv .venv
	$(PIP) install --quiet --require-hashes --only-binary :all: -r requirements.lock
	$(PIP) install --quiet --no-deps --no-build-isolation -e .
	@touch $@

$(ALL): requirements-dev.lock $(STAMP)
	@echo "Adding requirements-dev.lock to .venv (once, about a minute) ..."
	$(PIP) install --quiet --require-hashes --only-binary :all: -r requirements.lock -r requirements-dev.lock
	@touch $@

$(DOCS): requirements-docs.lock $(ALL)
	@echo "Adding requirements-docs.lock to .venv (once, about half a minute) ..."
	$(PIP) install --quiet --require-hashes --only-binary :all: -r requirements.lock -r requirements-dev.lock -r requirements-docs.lock
	@touch $@

clean:
	rm -rf .venv results build dist *.egg-info .pytest_cache .ruff_cache .import_linter_cache .hypothesis
