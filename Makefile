# `make demo` and `make test` install what they need into .venv the first time.

PYTHON ?= python3
ROS := kilted
VENV := .venv$(filter-out -kilted,-$(ROS))
ROS_CONSTRAINTS := constraints-$(ROS).txt
$(if $(wildcard $(ROS_CONSTRAINTS)),,$(error ROS=$(ROS): give kilted or jazzy))
BIN := $(VENV)/bin
FROM_DISTRIBUTION := $(VENV)/browser.stamp $(VENV)/cyclonedds.stamp
FOR_TESTS := $(VENV)/dev.stamp $(VENV)/action.stamp $(FROM_DISTRIBUTION)

# Keep a sourced ROS 2 and other active environments out: Python and the loader would find their
# packages and libraries first. _ROS_WHEELS_BOOTSTRAP_COMPLETE of another environment would keep
# the ROS wheels in .venv from setting their own library path.
unexport LD_LIBRARY_PATH PYTHONHOME PYTHONPATH RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
export AMENT_PREFIX_PATH := $(CURDIR)/$(VENV)

# tools/install does not byte-compile packages, which would take 20 s. Python compiles each module
# when it is first imported, unless this variable forbids it.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo action test test-fast coverage lint style types real-time nodes jazzy some-nodes computing docs constraints lowest dist clean

help:
	@echo 'make demo    run the demonstration'
	@echo 'make action  build the action ~/run and simulation_interfaces (needs a C++ compiler)'
	@echo 'make test    lint, check types, run all tests'
	@echo 'make test LAUNCH=DIR/launch/launch:DIR/launch_ros/launch_ros   include tests of launch files;'
	@echo '             DIR: absolute path of a folder with the sources of ros2/launch and'
	@echo '             ros2/launch_ros, which are not on PyPI'
	@echo 'make test-fast   run tests of the changes since main, and core tests, in two minutes; list'
	@echo '             the tests left out. BASE=COMMIT: changes since that commit'
	@echo 'make coverage    measure the lines that tests run, without ROS nodes; pages in out/coverage'
	@echo 'make lint    run ruff and mypy only'
	@echo 'make docs    build the documentation site: docs/_build/html/index.html'
	@echo 'make constraints   resolve the pinned versions for Python 3.10 to 3.14, Kilted and Jazzy'
	@echo 'make lowest PYTHON=python3.10   run main commands with the lowest versions in setup.py'
	@echo 'make dist    build source distribution and wheel into dist, install and run each'
	@echo 'make clean   remove environments, build results and caches'
	@echo 'make ... PYTHON=python3.12   make .venv with another Python'
	@echo 'make demo ROS=jazzy   run the demonstration on ROS 2 Jazzy, in .venv-jazzy, not on Kilted'
	@echo 'make test ROS=jazzy   run all tests that start nodes on Jazzy; make test runs some of them'

demo: $(VENV)/run.stamp
	$(BIN)/ab-sim demo

action: $(VENV)/action.stamp

# LAUNCH: folders with ROS's launch packages, for PYTHONPATH; PyPI has no wheels of them.
# One BLAS thread per test process: several would compete for the same two cores.
PYTEST = OPENBLAS_NUM_THREADS=1 PYTHONPATH=$(LAUNCH) $(BIN)/python -m pytest --durations=15
# Keep the order of tests/conftest.py, long tests first. By default, xdist starts files with few
# tests last, so that one worker would run a long test alone at the end.
SHARED = --dist loadfile --no-loadscope-reorder

# Tests that start ROS 2 nodes mostly sleep, but fail if they wait for the processor. So they run at
# normal priority, while computing tests and mypy use the idle processor time at low priority.
ifeq ($(ROS),kilted)
test:
	@$(MAKE) --jobs=2 --no-print-directory style $(FROM_DISTRIBUTION)
	@$(MAKE) --jobs=4 --no-print-directory types computing nodes jazzy
else
test: nodes
endif

# Tests with limits in real time run before all others, so that no other nodes load the processor.
REAL_TIME = tests/nodes/test_floods.py
# Give pytest only the files that have node tests: collecting all files takes each worker 5 s.
NODES = $(filter-out $(REAL_TIME),$(sort $(shell grep -rl 'mark\.ros\b' tests --include='test_*.py')))
# For computing tests, skip the files with node tests only: collecting them takes each worker 2 s.
COMPUTING = -m 'not ros' $(addprefix --ignore=,$(shell grep -rl '^pytestmark.*mark\.ros\b' tests --include='test_*.py'))

real-time: $(FOR_TESTS)
	$(PYTEST) $(REAL_TIME)

# Write the output to a file and print it at the end, also after Ctrl-C: the lines of two test runs
# at a time would be mixed.
define print_at_end
	@mkdir -p out
	@echo 'Tests that start nodes: output in out/$@.txt, printed at their end.'
	@trap : INT; $1 >out/$@.txt 2>&1; status=$$?; cat out/$@.txt; exit $$status
endef

nodes: real-time
	$(call print_at_end,$(PYTEST) -n 2 $(SHARED) -m ros $(NODES))

jazzy: real-time
	$(call print_at_end,$(MAKE) --no-print-directory some-nodes ROS=jazzy)

# Tests on Jazzy in addition to Kilted: drive, controller and recorder together; discovery, because
# the releases have different versions of Fast DDS; and nodes of both releases together.
SOME_NODES := tests/nodes/test_start_up.py::test_recorded_start_up_equals_an_offline_run \
	tests/nodes/test_discovery.py::test_the_ros2_command_line_finds_a_drive_at_once \
	tests/nodes/test_discovery.py::test_what_is_said_is_acknowledged_soon \
	tests/nodes/test_two_releases.py

some-nodes: $(VENV)/dev.stamp
	$(PYTEST) $(SOME_NODES)

computing: $(FOR_TESTS)
	nice env $(PYTEST) -n 2 $(SHARED) $(COMPUTING)

lint: style types

OFFLINE := --follow-imports=silent --exclude 'ab_sim/(nodes/|cli/live)' ab_sim ab_msgs_py

style: $(VENV)/dev.stamp
	$(BIN)/ruff check
# The encoding of text files must be stated: on Windows, the default is not UTF-8.
	$(BIN)/ruff check --preview --select PLW1514
	$(BIN)/ruff format --check

types: $(VENV)/dev.stamp
	nice $(BIN)/mypy
# What offline parts use must exist on Windows and macOS, too; nodes run on Linux only.
	nice $(BIN)/mypy --platform win32 $(OFFLINE)
	nice $(BIN)/mypy --platform darwin $(OFFLINE)

# --fresh-env reads every page again: Sphinx would miss a removed page, and changed code whose page
# is unchanged.
docs: $(VENV)/docs.stamp
	$(BIN)/python -m sphinx -W --keep-going --fresh-env --quiet docs docs/_build/html
	@echo 'docs/_build/html/index.html'

clean:
	rm -rf .venv .venv-* docs/_build docs/examples build dist install log *.egg-info ab_interfaces/build ab_interfaces/*.egg-info .mypy_cache .pytest_cache .ruff_cache

constraints: $(VENV)/dev.stamp
	$(BIN)/python tools/check_constraints.py

lowest: $(VENV)/dev.stamp
	tools/check-lowest $(BIN)/uv $(PYTHON) .venv-lowest

dist: $(VENV)/dev.stamp
	tools/check-dist $(BIN)/uv $(PYTHON) .venv-dist

test-fast: $(VENV)/dev.stamp
	$(BIN)/python tools/test_fast.py $(BASE)

# Without node tests: their processes are killed before they could write coverage data.
coverage: $(VENV)/dev.stamp
	$(PYTEST) -n 2 $(SHARED) $(COMPUTING) --cov --cov-report=term:skip-covered --cov-report=html:out/coverage

# Stamps: install again only after one of a stamp's prerequisites has changed.
$(VENV)/run.stamp: setup.py constraints.txt $(ROS_CONSTRAINTS) tools/install | $(VENV)/venv.stamp
	@echo 'Installing into $(VENV): 400 MB to download, half a minute or more ...'
	@tools/install $(BIN)/python $(ROS_CONSTRAINTS) --editable '.[ros]'
	@touch $@

$(VENV)/dev.stamp: setup.py constraints.txt $(ROS_CONSTRAINTS) tools/install | $(VENV)/venv.stamp
	@echo 'Installing into $(VENV): 490 MB to download, half a minute or more ...'
	@tools/install $(BIN)/python $(ROS_CONSTRAINTS) --editable '.[ros,dev]'
	@touch $(VENV)/run.stamp $@

$(VENV)/docs.stamp: setup.py constraints.txt $(ROS_CONSTRAINTS) tools/install | $(VENV)/venv.stamp
	@echo 'Installing Sphinx and its extensions into $(VENV) ...'
	@tools/install $(BIN)/python $(ROS_CONSTRAINTS) --editable '.[docs]'
	@touch $@

$(VENV)/action.stamp: tools/install-action $(wildcard ab_interfaces/*.py ab_interfaces/*/*.action ab_interfaces/simulation_interfaces/*/*) \
		| $(VENV)/run.stamp
	@tools/install-action $(BIN)/python
	@touch $@

$(VENV)/browser.stamp: tools/install-browser | $(VENV)/venv.stamp
	@tools/install-browser
	@touch $@

$(VENV)/cyclonedds.stamp: tools/install-cyclonedds | $(VENV)/venv.stamp
	@tools/install-cyclonedds
	@touch $@

$(VENV)/venv.stamp:
	@tools/make-venv $(PYTHON) $(VENV)
	@touch $@
