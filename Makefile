SHELL := /bin/bash
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
RGSPIPE := $(VENV)/bin/python -m rgspipe
MKDOCS := NO_MKDOCS_2_WARNING=1 $(VENV)/bin/python -m mkdocs
STAMP := $(VENV)/.installed
BENCH_STAMP := $(VENV)/.bench_installed
TEST_WORKERS ?= 2
ARGS ?=

.DEFAULT_GOAL := help
.PHONY: help setup test test-python test-slurm third-party crash soak bits devices large-capture fuzz fuzz-commands smoke reproduce scenes train-study light-study bench docs lint house

help:  ## this list
	@echo "rgspipe: from images of a scene, find its lights"
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-12s %s\n", $$1, $$2}'
	@echo "  Then: $(RGSPIPE) --help"

setup: $(STAMP)  ## create .venv with the pinned packages (nothing is done when it is up to date)

$(STAMP): requirements.txt pyproject.toml
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; sys.exit(v != (3, 11) and "The pinned packages, with Blender, need Python 3.11, found %d.%d: make PYTHON=/path/to/python3.11 ..., or see docs/guides/install.md" % v)'
	test -x $(VENV)/bin/python || $(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r requirements.txt
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

# Bytecode is written even where it is not otherwise: tests start a hundred processes that import the package.
test: setup  ## every test
	PYTHONDONTWRITEBYTECODE= $(VENV)/bin/python -m pytest -q -n $(TEST_WORKERS) --dist loadfile --no-loadscope-reorder $(ARGS)

PYTHON_VENV = $(VENV)-$(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')
test-python:  ## every test with another Python and the newest packages, without bpy (PYTHON=python3.13; PACKAGES="torch==2.13.0 ...")
	test -x $(PYTHON_VENV)/bin/python || $(PYTHON) -m venv $(PYTHON_VENV)
	$(PYTHON_VENV)/bin/python -m pip install --quiet --disable-pip-version-check -e '.[dev]' $(PACKAGES)
	$(PYTHON_VENV)/bin/python -m pytest -q -n $(TEST_WORKERS) --dist loadfile --no-loadscope-reorder $(ARGS)

test-slurm: setup  ## sweeps on a Slurm cluster of this machine alone (Debian: apt-get install slurm-wlm munge)
	$(VENV)/bin/python -m pytest -q -m slurm $(ARGS) tests/slurm

third-party: setup  ## exports read by Mitsuba, USD and the validator of glTF (npm), and renderers of others (minutes)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r requirements-third-party.txt
	! command -v npm > /dev/null || npm install --silent --no-fund --prefix $(VENV)/npm gltf-validator@2.0.0-dev.3.10
	$(VENV)/bin/python -m pytest -q tests/light_export tests/tools/test_foreign_room.py $(ARGS)

crash: setup  ## kills, power cuts, full disks while a tiny scene is made: what the next run ends with (ARGS="CASES SEED")
	$(VENV)/bin/python tests/crash.py $(ARGS)

soak: setup  ## a sweep of 200 jobs, 8 at a time, with random kills; its memory (many minutes; ARGS="JOBS KILLS SEED [slurm]")
	$(VENV)/bin/python tests/soak.py $(ARGS)

bits: setup  ## training and a fit with other numbers of threads, and other instructions of the processor (minutes)
	$(VENV)/bin/python tests/bits.py

devices: setup  ## how long freezing, training, images and fits take on the CPU and on a GPU (minutes)
	$(VENV)/bin/python tests/device_times.py

large-capture: setup  ## 200 large photographs to lamps and a frozen scene: seconds and memory of each stage (an hour; ARGS="VIEWS WIDTH SURFELS")
	$(VENV)/bin/python tests/large_capture.py $(ARGS)

fuzz: setup  ## damaged files of every kind that is read: each is read or refused (a minute; ARGS="CASES SEED")
	$(VENV)/bin/python tests/fuzz.py $(ARGS)

fuzz-commands: setup  ## command lines made up by chance: each is right or refused with a remedy (minutes; ARGS="COMPOSED STARTED SEED")
	$(VENV)/bin/python tests/command_lines.py $(ARGS)

smoke: setup  ## the whole way on a tiny scene, in minutes
	$(RGSPIPE) pipeline=smoke $(ARGS)

reproduce: setup  ## everything in pipelines/reproduce.yaml, from nothing to the report
	$(RGSPIPE) pipeline=reproduce $(ARGS)

scenes: setup  ## every modelled scene, to its report, and one page over all of them (an hour of rendering, then training and fits)
	$(RGSPIPE) pipeline=scenes $(ARGS)

train-study: setup  ## how well scenes are trained and what bad captures cost, in one table (hours; goes on where it was)
	$(RGSPIPE) pipeline=training $(ARGS)

light-study: setup  ## how recovered lights depend on views, errors and places, with the reports that show it (hours; goes on where it was)
	$(RGSPIPE) pipeline=lights $(ARGS)

bench: setup $(BENCH_STAMP)  ## accuracy against path-traced truth and what it costs on this machine (an hour, idle)
	$(RGSPIPE) stage=benchmark $(ARGS)

$(BENCH_STAMP): requirements-bench.txt $(STAMP)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r requirements-bench.txt
	@touch $@

docs: setup  ## the documentation as a site in site/, which is read without a server or a network
	$(MKDOCS) build --strict --quiet

lint: setup  ## style and mistakes
	$(VENV)/bin/ruff check src tests examples tools
	$(VENV)/bin/ruff format --check src tests examples tools

house: setup  ## the measures of the code: rooms, functions, imports, what stands twice (ARGS="--since REV --list")
	$(VENV)/bin/python tools/house.py $(ARGS)
