# Chauffeur. Each target prepares what it needs in .venv; nothing is installed outside this folder.
#   make drive   drive a wish end to end (WISH="..." to choose another)
#   make test    the test suite
#   make lint    formatting, lint, types, import floors
#   make bench   measurements against peers and references
#   make docs    the documentation site
#   make dist    both packages, as wheels and as sources

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV ?= .venv
BIN := $(VENV)/bin
WISH ?= Overtake the car in front of you.
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
JOBS ?= auto
VERSIONS ?= 3.11 3.12 3.13
# What lint reads the types of, beside what tests need; and what CI tests with it.
EXTRAS ?= maps,carla,speech,viewer,transformers
LAB_EXTRAS ?= $(if $(filter command environment,$(origin EXTRAS)),,models)

# Where it is set, every worker of the tests rewrites every module's assertions again: 17 s of processor time each.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: drive test lint format bench docs extras dist fresh-core clean

# A wish of one's own may need a town, the test track or the camera: with it comes what every world of ours drives with.
drive: $(VENV)/.core $(if $(filter command environment,$(origin WISH)),$(VENV)/.driving)
	$(BIN)/chauffeur drive "$(WISH)" --save trips/latest

test: $(VENV)/.dev
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal

lint: extras
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/.dev
	$(BIN)/python benchmarks/program_tick.py
	@echo "LaMPilot-Bench: $(BIN)/chauffeur bench lampilot --data DIR --planner onboard"

extras: $(VENV)/.extras

docs: $(VENV)/.docs
	$(BIN)/python docs/stage.py
	$(BIN)/zensical build --strict

# In an environment that has nothing but its own requirements, `chauffeur` alone must show its help and drive with every
# Python it is for (those that are not installed here are left out), and the lab measure beside it; with the first
# Python, both do what the README shows.
fresh-core:
	@set -e; tried=""; for version in $(VERSIONS); do \
		python$$version -c "" 2>/dev/null || { echo "No python$$version here: not tried."; continue; }; \
		echo "Python $$version, core requirements alone ..."; \
		rm -rf .venv-fresh; \
		python$$version -m venv .venv-fresh; \
		pip=".venv-fresh/bin/python -m pip --disable-pip-version-check --quiet"; \
		$$pip install -c constraints.txt .; \
		.venv-fresh/bin/python -m chauffeur --help > /dev/null; \
		.venv-fresh/bin/chauffeur drive "Change to the left lane." --quiet; \
		test -n "$$tried" || .ci/core .venv-fresh/bin; \
		$$pip install -c constraints.txt ./lab; \
		.ci/lab .venv-fresh/bin; \
		tried=yes; \
		rm -rf .venv-fresh; \
	done; test -n "$$tried" || { echo "None of Python $(VERSIONS) is here."; exit 1; }

# Both packages, as wheels and as sources, in dist/.
dist: $(VENV)/.dev
	rm -rf dist
	$(BIN)/hatchling build -d dist
	cd lab && $(abspath $(BIN))/hatchling build -d ../dist

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Chauffeur needs Python 3.11 or newer; set PYTHON=/path/to/python3.11")'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.core: $(VENV)/.made pyproject.toml lab/pyproject.toml constraints.txt
	@echo "Installing Chauffeur into $(VENV) (once) ..."
	$(PIP) install -c constraints.txt -e . -e lab
	@touch $@

$(VENV)/.driving: $(VENV)/.core
	@echo "Installing what towns, the test track and the camera need (once) ..."
	$(PIP) install -c constraints.txt -e ".[motion,camera,town]"
	@touch $@

$(VENV)/.dev: $(VENV)/.core
	$(PIP) install -c constraints.txt -e ".[dev]"
	@touch $@

$(VENV)/.extras: $(VENV)/.dev
	$(PIP) install -c constraints.txt -e ".[$(EXTRAS)]" $(if $(LAB_EXTRAS),-e "lab[$(LAB_EXTRAS)]")
	@touch $@

$(VENV)/.docs: $(VENV)/.core
	$(PIP) install -c constraints.txt -e ".[docs]"
	@touch $@

clean:
	rm -rf $(VENV) .venv-fresh trips runs dist build
