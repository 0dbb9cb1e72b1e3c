# Two commands are all a newcomer needs: `make run` and `make test`. `make help` lists the rest.

PYTHON ?= python3
HOST   ?= 127.0.0.1
PORT   ?= 8000
ARGS   ?=

VENV := .venv
BIN  := $(VENV)/bin
DONE := .make

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

# pip must see neither the user's site-packages nor the modules of a sourced ROS.
export PYTHONNOUSERSITE := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# With ROS_PYTHON_CHECK_FIELDS, ROS raises an error for a field of the wrong type instead of writing garbage.
# Bytecode is always written, because the tests start hundreds of processes with the same modules.
TEST_ENV := PYTHONDONTWRITEBYTECODE= ROS_PYTHON_CHECK_FIELDS=1 \
            ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ROS_LOG_DIR=$(CURDIR)/$(DONE)/ros_log
# Benchmarks run without these checks, as in a greenhouse.
BENCH_ENV := ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ROS_LOG_DIR=$(CURDIR)/$(DONE)/ros_log

say = @printf '\033[1m==> %s\033[0m\n'

.PHONY: help setup run run-fleet docs check quick test lint types collect unit hmi-test dist bench bench-live soak clean

help: ## this list
	@grep -E '^[a-z-]+:.*## ' Makefile | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 20

run: setup ## the demo: twin, bridge, page and simulated robot on http://127.0.0.1:8000 (PORT=…, HOST=…)
	$(say) 'demo on http://$(HOST):$(PORT) (Ctrl-C ends it)'
	@exec $(BIN)/lupin-twin demo --host $(HOST) --port $(PORT) $(ARGS)

run-fleet: setup $(DONE)/tools ## three simulated greenhouses, a PostgreSQL and the page over them
	$(say) 'three greenhouses on http://$(HOST):$(PORT) (Ctrl-C ends it)'
	@exec $(BIN)/python -m tests.support.run_fleet --host $(HOST) --port $(PORT) $(ARGS)

setup: $(DONE)/python $(DONE)/hmi ## install everything that `make run` needs

# --- set-up ------------------------------------------------------------------------------------

$(DONE)/checked: .ci/preflight Makefile
	@mkdir -p $(DONE)
	@PYTHON='$(PYTHON)' .ci/preflight
	@touch $@

$(VENV)/pyvenv.cfg: | $(DONE)/checked
	$(say) 'making a virtual environment in $(VENV)'
	@$(PYTHON) -m venv $(VENV)

MSGS_SOURCES := $(wildcard ros_node/lupin_msgs/*.* ros_node/lupin_msgs/*/*)
$(DONE)/wheels/built: $(MSGS_SOURCES) $(VENV)/pyvenv.cfg
	$(say) 'building lupin_msgs against the ROS wheels (about a minute)'
	@rm -rf $(@D)
	@env -u PYTHONPATH $(BIN)/pip wheel --quiet --no-deps --wheel-dir $(@D) ./ros_node/lupin_msgs
	@env -u PYTHONPATH $(BIN)/pip install --quiet --no-deps --force-reinstall $(@D)/*.whl
	@touch $@

$(DONE)/python: pyproject.toml requirements.txt $(DONE)/wheels/built
	$(say) 'installing ROS and the Python packages'
	@grep -v '^\./ros_node/lupin_msgs' requirements.txt > $(DONE)/requirements.txt
	@env -u PYTHONPATH $(BIN)/pip install --quiet -r $(DONE)/requirements.txt
	@touch $@

$(DONE)/node_modules: package.json package-lock.json | $(DONE)/checked
	$(say) 'installing the front-end packages'
	@npm ci --no-audit --no-fund --no-update-notifier --loglevel=error
	@touch $@

HMI_SOURCES := $(shell find frontend -type f -not -path '*/node_modules/*' 2>/dev/null) \
               backend/lupin_bridge/sensors.json
$(DONE)/hmi: $(HMI_SOURCES) $(DONE)/node_modules
	$(say) 'building the HMI'
	@npm run --silent build
	@touch $@

docs: setup $(DONE)/docs ## build the guide, which the bridge serves at /docs/guide/

# Much of the guide is generated from the code, so it depends on the code too.
DOCS_SOURCES := $(shell find docs backend ros_node -type f \( -name '*.py' -o -name '*.md' -o \
                -name '*.msg' -o -name '*.srv' -o -name '*.json' -o -name '*.png' -o -path 'docs/_*' \) \
                -not -path 'docs/reference/*' -not -path 'backend/lupin_bridge/static/*' \
                -not -path 'backend/lupin_bridge/guide/*' 2>/dev/null)
$(DONE)/docs: $(DOCS_SOURCES) $(DONE)/python
	$(say) 'building the guide'
	@$(BIN)/sphinx-build --quiet -n -W --keep-going -E -d $(DONE)/doctrees docs backend/lupin_bridge/guide
	@find backend/lupin_bridge/guide -name '*.map' -delete
	@touch $@

$(DONE)/tools: .ci/tools | $(DONE)/checked
	@.ci/tools
	@touch $@

# For the tests: messages of TF and apriltag_ros, which have no wheels.
TEST_MSGS := tests/ros_msgs/tf2_msgs tests/ros_msgs/apriltag_msgs
$(DONE)/test_msgs/built: $(wildcard $(addsuffix /*.*,$(TEST_MSGS)) $(addsuffix /msg/*,$(TEST_MSGS))) \
                         $(DONE)/python
	$(say) 'building the messages of TF and apriltag_ros for the tests (about a minute)'
	@rm -rf $(@D)
	@env -u PYTHONPATH $(BIN)/pip wheel --quiet --no-deps --wheel-dir $(@D) $(addprefix ./,$(TEST_MSGS))
	@env -u PYTHONPATH $(BIN)/pip install --quiet --no-deps --force-reinstall $(@D)/*.whl
	@touch $@

dist: setup docs ## build a release into dist/: wheels, sdist, and the context of a container image
	$(say) 'building into dist/'
	@.ci/dist dist
	@ls dist

# --- checks ------------------------------------------------------------------------------------

# Two at a time, because none of them keeps two cores busy. The longest comes first.
check: setup ## quick checks: lint, types, and every test that needs neither ROS nor a browser
	@$(MAKE) --no-print-directory -j 2 --output-sync=target quick lint types hmi-test LINT=lint:changed
	$(say) 'quick checks passed; `make test` is the whole'

# Four workers here too: they wait for threads and timers.
quick: setup ## Python tests that need neither ROS nor a browser
	$(say) 'Python tests without ROS and browser'
	@$(TEST_ENV) $(BIN)/pytest -q -n 4 --dist worksteal -r fE --quick tests

test: setup $(DONE)/tools $(DONE)/test_msgs/built ## all checks: lint, types, guide, unit tests, real ROS, browser
	@$(MAKE) --no-print-directory -j 2 --output-sync=target lint types docs hmi-test collect
	@$(MAKE) --no-print-directory unit
	$(say) 'all checks passed'

# `make check` lints changed files only. An unchanged file can break a rule through the types of a changed one,
# but rarely. `make test` lints all files.
LINT := lint

lint: setup ## ruff, import-linter, ESLint, Prettier
	$(say) 'lint'
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/lint-imports | tail -n +10
	@npm run --silent $(LINT)
	@npm run --silent format:check

types: setup ## mypy and tsc, both strict; the page's types against the server's schema
	$(say) 'types'
	@$(BIN)/mypy
	@npm run --silent typecheck
	@npm run --silent types:check

hmi-test: setup ## the page's unit tests, and the size limits of its build
	$(say) 'front-end unit tests, size of the build'
	@npm run --silent test
	@npm run --silent size >/dev/null

# In a fresh checkout, each pytest worker would otherwise rewrite the assertions of all test files.
collect: setup
	$(say) 'collecting the Python tests'
	@$(TEST_ENV) $(BIN)/pytest -qq --collect-only tests >$(DONE)/collected || { cat $(DONE)/collected; exit 1; }

# Four workers on two cores, because they mostly wait for processes.
unit: setup docs $(DONE)/tools $(DONE)/test_msgs/built ## Python tests, real ROS and real browser included
	$(say) 'Python tests: units, ROS over DDS, browser'
	@$(TEST_ENV) $(BIN)/pytest -q -n 4 --dist worksteal tests

bench: setup $(DONE)/tools ## all benchmarks but bench-live (ARGS=bench_field: one of them)
	@$(BENCH_ENV) $(BIN)/python -m tests.bench $(ARGS)

bench-live: setup ## benchmark of the live bridge with up to 5,000 clients
	@$(BENCH_ENV) $(BIN)/python -m tests.bench bench_live

soak: setup ## endurance: 50 kills under load, of the archive too, and eight hours of writing
	@$(TEST_ENV) KILLS=50 $(BIN)/pytest -s tests/soak_hours.py \
	  tests/test_live_disk.py::test_a_killed_twin_knows_everything_shown_100_ms_before \
	  tests/test_live_archive.py::test_kills_at_any_moment_lose_and_double_nothing

clean: ## remove everything that setup and builds have created
	rm -rf $(VENV) $(DONE) node_modules backend/lupin_bridge/static backend/lupin_bridge/guide docs/reference dist
