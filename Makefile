# The one door to padlab: `make help` lists what there is.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMPS := $(VENV)/.stamps
HOST   ?= 127.0.0.1
PORT   ?= 8000
export PADLAB_HOME ?= $(CURDIR)/instance
export PIP_DISABLE_PIP_VERSION_CHECK = 1

CATALOGUES := $(wildcard webapp/translations/*/LC_MESSAGES/messages.po)

.DEFAULT_GOAL := help
.PHONY: help setup demo serve test soak lint format bench lock clean

help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-8s %s\n", $$1, $$2}'

setup: $(STAMPS)/python $(STAMPS)/translations $(STAMPS)/face ## install everything; a second run does nothing

demo: setup ## set up, render and serve the demo study (HOST=, PORT=)
	@$(BIN)/padlab demo --host $(HOST) --port $(PORT)

test: setup ## all tests, on SQLite and PostgreSQL, with a real browser; two files at a time
	@$(BIN)/python -m pytest -n 2 --dist loadfile

soak: setup ## slower proofs: more of the random tests, and whole studies over HTTP (many minutes)
	@PADLAB_SOAK=1 $(BIN)/python -m pytest tests/soak tests/webapp/services/test_engine_machine.py \
	  tests/evaluation/statistics/test_bad_data.py -s

lint: setup ## style, types and the direction of imports
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

format: setup ## put the code into the house's form
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

bench: setup $(STAMPS)/peers ## measure rendering, training, the study engine, and the statistics beside other packages
	@$(BIN)/padlab bench render
	@$(BIN)/padlab bench train
	@$(BIN)/padlab bench study
	@$(BIN)/padlab bench statistics

lock: setup ## write requirements/lock.txt and bench.txt anew from pyproject.toml
	@$(BIN)/python -m pip install -qq uv
	@$(BIN)/uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate \
	  --no-emit-index-url --no-emit-find-links --group dev pyproject.toml -o requirements/lock.txt >/dev/null
	@$(BIN)/uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate \
	  --no-emit-index-url --no-emit-find-links --extra bench -c requirements/lock.txt pyproject.toml \
	  -o requirements/bench.txt >/dev/null

clean: ## remove the environment and caches; studies and ratings (instance/) stay
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis

$(STAMPS)/system: requirements/system.txt requirements/system.sh
	@sh requirements/system.sh $(PYTHON)
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/python: requirements/lock.txt pyproject.toml $(STAMPS)/system
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "Installing Python packages"
	@$(BIN)/python -m pip install -qq --require-hashes --no-deps -r requirements/lock.txt
	@$(BIN)/python -m pip install -qq --no-deps --no-build-isolation -e .
	@touch $@

$(STAMPS)/translations: $(CATALOGUES) $(STAMPS)/python
	@$(BIN)/pybabel -q compile -d webapp/translations
	@touch $@

# What benchmarks compare with; padlab itself needs none of it.
$(STAMPS)/peers: requirements/bench.txt $(STAMPS)/python
	@echo "Installing the packages that are compared with"
	@$(BIN)/python -m pip install -qq --require-hashes --no-deps -r requirements/bench.txt
	@touch $@

# The command checks what is there and returns at once when it is sound; the stamp follows the code that compiles it.
$(STAMPS)/face: synth/face/assets.py synth/face/compilation.py $(STAMPS)/python
	@$(BIN)/padlab assets fetch
	@touch $@
