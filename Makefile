# make run, make test, make bench: each makes .venv first, once, from requirements.lock.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.complete
PIP := $(BIN)/python -m pip --disable-pip-version-check

.PHONY: run test types kernels tests bench system-check clean
.DELETE_ON_ERROR:

run: $(STAMP)
	$(BIN)/railsim run default --out results/default

test: $(STAMP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports
	$(MAKE) --no-print-directory -j 2 types tests

# Types take one core for a minute and a half: beside the tests.
types: $(STAMP)
	$(BIN)/pyright

# Two workers that begin together would each compile what nearly all tests need: once, beside the types.
kernels: $(STAMP)
	@$(BIN)/railsim run default --engine compiled --set duration=5 --out results/.kernels > /dev/null
	@rm -rf results/.kernels

# The workers are the parallelism: linear algebra in threads of its own would only wait for the others.
tests: kernels
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist loadfile

bench: $(STAMP)
	$(BIN)/railsim bench

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

clean:
	rm -rf .venv results build dist *.egg-info .pytest_cache .ruff_cache .import_linter_cache .hypothesis
