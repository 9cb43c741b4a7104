# Every target sets up what it needs from nothing, in .venv. PYTHON chooses the interpreter: make test PYTHON=python3.13
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# As many as processors, unless JOBS says another number: make test JOBS=2
JOBS ?= $(or $(shell nproc 2>/dev/null),$(shell getconf _NPROCESSORS_ONLN 2>/dev/null),2)
# Each worker begins with its own part of the tests, so that what tests of a file share is made once.
PYTEST := $(BIN)/python -m pytest -q -n $(JOBS) --dist worksteal
# What `make check ROOM=runtime/live` looks at; without ROOM it looks at everything.
ROOMS := $(BIN)/python -m tools.rooms
FILES = $(if $(ROOM),$$($(ROOMS) $(ROOM)),.)
TESTS = $(if $(ROOM),$$($(ROOMS) --tests $(ROOM)))
N ?= 200
SOAK ?= 100

# Tests start Python hundreds of times, so the package is compiled before; the tests themselves are when they are read.
COMPILE := $(BIN)/python -m compileall -q llfsm_verify tests benchmarks tools
test test-slow check soak: export PYTHONDONTWRITEBYTECODE :=

.PHONY: verify test test-slow check soak oracles mutants bench bench-executor bench-running docs clean
.DELETE_ON_ERROR:

verify: $(VENV)/.verify ## Check the traffic lights
	$(BIN)/llfsm-verify models/traffic_lights/arrangement.yaml properties/traffic_lights.ltl

test: $(VENV)/.test ## The tests, but for the long ones: ten minutes at most, on two cores
	$(COMPILE)
	$(PYTEST) -m "not long"

test-slow: $(VENV)/.test ## The rest: random tests at length, and what takes long
	$(COMPILE)
	$(PYTEST) -m long

check: $(VENV)/.check ## Format, lint, types, layers and the fast tests; ROOM=runtime/live: the files and tests of a room
	@$(if $(ROOM),$(ROOMS) $(ROOM) >/dev/null)
	$(BIN)/ruff format --check $(FILES)
	$(BIN)/ruff check $(FILES)
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(COMPILE)
	LLFSM_QUICK=1 $(PYTEST) -m "not slow and not long" $(TESTS)

soak: $(VENV)/.test ## Random checks at length, on fresh examples: hours; SOAK=1 is a hundredth, SEED chooses them
	$(COMPILE)
	LLFSM_FRESH=1 $(PYTEST) --timeout=0 -o faulthandler_timeout=0
	$(BIN)/python -m tests.verification.agreeing $(shell expr 10 '*' $(SOAK)) $(or $(SEED),1)
	$(BIN)/python -m tests.kripke.threads $(shell expr 5 '*' $(SOAK)) $(or $(SEED),1)
	$(BIN)/python -m tests.oracle.judging $(shell expr 10 '*' $(SOAK)) $(or $(SEED),1)
	$(BIN)/python -m tests.extensions.checkers.compare $(SOAK) $(or $(SEED),1)
	$(BIN)/python -m tests.fuzzing $(shell expr 100 '*' $(SOAK)) $(or $(SEED),1)

oracles: $(VENV)/.test ## Install or build what tests compare us with, and say what is missing; GROUP=core|targets|robots|view|knowledge
	$(BIN)/python -m tools.oracles $(if $(GROUP),--group $(GROUP))

mutants: $(VENV)/.test ## How many of N mutants of the source the tests kill; SEED chooses them
	$(BIN)/python -m tests.mutation --number $(N) --jobs $(JOBS) $(if $(SEED),--seed $(SEED))

bench: $(VENV)/.verify ## Two tables: llfsm-verify beside SPIN, NuSMV (where installed) and plain Python; WRITE=docs/benchmarks.md
	$(BIN)/python -m benchmarks.table $(if $(WRITE),--write $(WRITE))
	$(BIN)/python -m benchmarks.practice $(if $(WRITE),--write $(WRITE))

bench-executor: $(VENV)/.verify ## Speed of the executor, of its compiler, and of images in C beside it
	$(BIN)/python benchmarks/pingpong.py
	$(BIN)/python benchmarks/compiling.py
	$(BIN)/python -m benchmarks.images

bench-running: $(VENV)/.verify ## Runs and whiteboards beside ROS 1 (where installed), queues, raw memory; WRITE=benchmarks/running.md
	$(BIN)/python -m benchmarks.running $(if $(WRITE),--write $(WRITE))

docs: $(VENV)/.docs ## The pages of docs/ as a site in build/site, with the reference of `import llfsm_verify`
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

clean:
	rm -rf $(VENV) build dist *.egg-info

# A stamp a set of packages; each is renewed when pyproject.toml changes.
$(VENV)/.verify: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/.test: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable '.[draw,test]'
	@touch $@

$(VENV)/.check: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable '.[draw,test,check]'
	@touch $@

$(VENV)/.docs: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	@touch $@

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "make: llfsm-verify needs Python 3.11 or newer, and '$(PYTHON)' is not one; choose another with make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "make: '$(PYTHON)' has no venv module; install it (on Debian and Ubuntu: apt install python3-venv)" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
