# `make demo` and `make test` install what they need into .venv the first time.

PYTHON ?= python3
ROS := kilted
VENV := .venv$(filter-out -kilted,-$(ROS))
ROS_CONSTRAINTS := constraints-$(ROS).txt
$(if $(wildcard $(ROS_CONSTRAINTS)),,$(error ROS=$(ROS): give kilted or jazzy))
BIN := $(VENV)/bin
FROM_DISTRIBUTION := $(VENV)/browser.stamp $(VENV)/cyclonedds.stamp
FOR_TESTS := $(VENV)/dev.stamp $(VENV)/action.stamp $(FROM_DISTRIBUTION)

# A sourced ROS 2 or another active environment must not leak into this one: its packages and
# libraries would be found first, and the variable by which its ROS wheels know that they have set
# the library path would keep ours from doing so.
unexport LD_LIBRARY_PATH PYTHONHOME PYTHONPATH RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
export AMENT_PREFIX_PATH := $(CURDIR)/$(VENV)

# What is installed is not byte-compiled, which takes 20 s: Python itself does it of what is used.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo action test test-fast coverage lint style types real-time nodes jazzy some-nodes computing docs constraints lowest dist clean

help:
	@echo 'make demo    run the demonstration'
	@echo 'make action  build the action ~/run and simulation_interfaces, which takes a C++ compiler'
	@echo 'make test    lint, check types, run the tests'
	@echo 'make test LAUNCH=DIR/launch/launch:DIR/launch_ros/launch_ros   also of launch files: DIR, not'
	@echo '             relative, holds sources of ros2/launch and ros2/launch_ros, of which PyPI has none'
	@echo 'make test-fast   below two minutes: tests of what differs from main, and a core; BASE=COMMIT:'
	@echo '             of what differs from that commit; says what it leaves out'
	@echo 'make coverage    which lines the tests run, as a figure and in out/coverage; without ROS nodes'
	@echo 'make lint    ruff and mypy only'
	@echo 'make docs    build the documentation site: docs/_build/html/index.html'
	@echo 'make constraints   resolve the pinned versions for Python 3.10 to 3.14, Kilted and Jazzy'
	@echo 'make lowest PYTHON=python3.10   run main commands with the lowest versions of setup.py'
	@echo 'make dist    build source distribution and wheel into dist, and try to install each'
	@echo 'make clean   remove .venv and what builds and tools leave'
	@echo 'make ... PYTHON=python3.12   make .venv with another Python'
	@echo 'make demo ROS=jazzy   the demonstration on ROS 2 Jazzy, in .venv-jazzy, instead of Kilted'
	@echo 'make test ROS=jazzy   all tests that start nodes, on Jazzy; make test runs some of them'

demo: $(VENV)/run.stamp
	$(BIN)/ab-sim demo

action: $(VENV)/action.stamp

# PyPI has no wheels of ROS's launch: LAUNCH names folders in which Python finds it.
# Of linear algebra one thread a process: several would wait for each other on two cores.
PYTEST = OPENBLAS_NUM_THREADS=1 PYTHONPATH=$(LAUNCH) $(BIN)/python -m pytest --durations=15
# Files go out as tests/conftest.py orders them; by default those of few tests, long ones too, came
# last.
SHARED = -n 2 --dist loadfile --no-loadscope-reorder

# Tests that start ROS 2 nodes wait most of their time, and must not be kept waiting: those that
# compute, and mypy, get what they leave of the processor.
ifeq ($(ROS),kilted)
test:
	@$(MAKE) --jobs=2 --no-print-directory style $(FROM_DISTRIBUTION)
	@$(MAKE) --jobs=4 --no-print-directory types computing nodes jazzy
else
test: nodes
endif

# What is judged by real time runs beside no other nodes.
REAL_TIME = tests/nodes/test_floods.py
# Only those of nodes are read for them: all others would take each worker 5 s.
NODES = $(filter-out $(REAL_TIME),$(sort $(shell grep -rl 'mark\.ros\b' tests --include='test_*.py')))
# Nor are those of nothing but nodes for tests that compute: they would take each worker 2 s.
COMPUTING = -m 'not ros' $(addprefix --ignore=,$(shell grep -rl '^pytestmark.*mark\.ros\b' tests --include='test_*.py'))

real-time: $(FOR_TESTS)
	$(PYTEST) $(REAL_TIME)

# What they say comes when they have ended, by Ctrl-C too: of two that report at once nobody could
# read either.
define shown_at_its_end
	@mkdir -p out
	@echo 'Tests that start nodes write into out/$@.txt, which is shown when they have ended.'
	@trap : INT; $1 >out/$@.txt 2>&1; ended=$$?; cat out/$@.txt; exit $$ended
endef

nodes: real-time
	$(call shown_at_its_end,$(PYTEST) $(SHARED) -m ros $(NODES))

jazzy: real-time
	$(call shown_at_its_end,$(MAKE) --no-print-directory some-nodes ROS=jazzy)

# Drive, controller and recorder together, what differs between releases (Fast DDS), and both of them
# together.
SOME_NODES := tests/nodes/test_start_up.py::test_recorded_start_up_equals_an_offline_run \
	tests/nodes/test_discovery.py::test_the_ros2_command_line_finds_a_drive_at_once \
	tests/nodes/test_discovery.py::test_what_is_said_is_acknowledged_soon \
	tests/nodes/test_two_releases.py

some-nodes: $(VENV)/dev.stamp
	$(PYTEST) $(SOME_NODES)

computing: $(FOR_TESTS)
	nice env $(PYTEST) $(SHARED) $(COMPUTING)

lint: style types

style: $(VENV)/dev.stamp
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: $(VENV)/dev.stamp
	nice $(BIN)/mypy

# From scratch: a page that is gone, or code that changed behind an unchanged page, is noticed.
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

# Nodes run in processes that are killed, which leave no figures.
coverage: $(VENV)/dev.stamp
	$(PYTEST) $(SHARED) $(COMPUTING) --cov --cov-report=term:skip-covered --cov-report=html:out/coverage

# Stamps: nothing is installed again until one of the files behind them changes.
$(VENV)/run.stamp: setup.py constraints.txt $(ROS_CONSTRAINTS) tools/install | $(VENV)/venv.stamp
	@echo 'Installing into $(VENV): 400 MB to download, half a minute or more ...'
	@tools/install $(BIN)/python $(ROS_CONSTRAINTS) --editable '.[ros]'
	@touch $@

$(VENV)/dev.stamp: setup.py constraints.txt $(ROS_CONSTRAINTS) tools/install | $(VENV)/venv.stamp
	@echo 'Installing into $(VENV): 490 MB to download, half a minute or more ...'
	@tools/install $(BIN)/python $(ROS_CONSTRAINTS) --editable '.[ros,dev]'
	@touch $(VENV)/run.stamp $@

$(VENV)/docs.stamp: setup.py constraints.txt $(ROS_CONSTRAINTS) tools/install | $(VENV)/venv.stamp
	@echo 'Installing what builds the site into $(VENV) ...'
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
