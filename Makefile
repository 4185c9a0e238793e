# SPDX-License-Identifier: Apache-2.0
# plenofir: see README.md. `make sim` and `make test` set up everything they need.

# The other variables (docs/simulation.md, docs/boards/) go to the command as they are set, which has their
# defaults: golden/plenofir/commands/make_variables.py.
JOBS ?= $(shell nproc)

PLENOFIR := .venv/bin/plenofir --make
PYTHON := .venv/bin/python
PYTEST := $(PYTHON) -m pytest -n $(JOBS) --dist worksteal

.PHONY: help check dist site sim formal synth pnr mutants mutants-python coverage figures compare test test-full hunt golden lint docs waves bench bitstream bitstreams bitstream-check venv simulator test-tools libpython clean

help: ## List the targets
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20
	@echo "  Other targets: CONTRIBUTING.md. Everything else: .venv/bin/plenofir --help"

sim: venv simulator ## Refocus an image in the simulated VHDL and compare every pixel: RAW= M= A= OUT=, more in docs/simulation.md
	@$(PLENOFIR) sim

synth: venv ## Synthesise with GHDL and Yosys: SCENE= OUT= (by default all shipped scenes)
	@scripts/setup.sh ghdl
	@$(PLENOFIR) synth

pnr: venv ## Place and route with nextpnr (ECP5, Nexus, Gowin, GateMate): SCENE= DEVICE=
	@scripts/setup.sh ghdl
	@scripts/setup.sh pnr
	@$(PYTHON) scripts/resources.py place $(if $(SCENE),"$(SCENE)" $(DEVICE))

mutants: venv libpython # Change the VHDL in 120 ways; fails if a change is neither noticed by a test nor explained
	@scripts/setup.sh ghdl
	@$(PYTHON) scripts/mutate.py

coverage: venv test-tools libpython # Count the statements and branches of the VHDL and the lines of the package that tests reach: FULL=1 (long tests too) TESTS="tb/board" (these alone, added to the last run) JOBS=
	@JOBS=$(JOBS) $(PYTHON) scripts/measure_coverage.py $(if $(FULL),--full) $(if $(TESTS),--tests $(TESTS))

mutants-python: venv # The same for golden model, ray model and calibration: ROOM= SEED= COUNT= JOBS=
	@scripts/setup.sh mutants
	@nice $(PYTHON) scripts/mutate_python.py --room $(or $(ROOM),golden rays calibration) --seed $(or $(SEED),0) --count $(or $(COUNT),120) --jobs $(JOBS)

figures: venv # Record the figures of synthesis that `make test` checks (4 minutes; earlier results are in build/yosys): JOBS=
	@scripts/setup.sh ghdl
	@JOBS=$(JOBS) $(PYTHON) scripts/resources.py figures
	@$(PYTHON) scripts/build_docs.py

compare: venv # Synthesise and place the missing cells of the tables that compare both engines, and pixels a clock (hours)
	@scripts/setup.sh ghdl
	@scripts/setup.sh pnr
	@$(PYTHON) scripts/resources.py compare
	@$(PYTHON) scripts/resources.py pixels
	@$(PYTHON) scripts/pictures.py engines moving-sum
	@$(PYTHON) scripts/build_docs.py

test: venv simulator test-tools libpython lint bitstream-check ## Run the tests: style, types, golden model, testbenches
	@DRAWN=$${DRAWN:-$$(date +%s)}; export DRAWN; echo "DRAWN=$$DRAWN: which of the long lists' cases run"; $(PYTEST) -m "not slow"

test-full: venv simulator test-tools libpython lint bitstream-check ## Run the tests and the long ones too
	@$(PYTEST)

check: venv simulator lint ## Run the quick tests, for the edit loop: style, types, golden model, a small frame through each engine
	@$(PYTEST) -q -m quick

hunt: venv simulator libpython ## Send random streams, good and broken, into every entity with a stream: MINUTES= SEED= ENTITY= CASE= WAVES=
	@$(PYTHON) tb/hunt/hunt.py --jobs $(JOBS) $(if $(SEED),--seed $(SEED)) $(if $(MINUTES),--minutes $(MINUTES)) $(if $(ENTITY),--entity "$(ENTITY)") $(if $(CASE),--case $(CASE)) $(if $(filter 1,$(WAVES)),--waves)

formal: venv ## Prove the properties in formal/; one that fails leaves a VCD in build/formal: LONG=1 (all of them, an hour) JOBS=
	@scripts/setup.sh ghdl
	@$(PYTHON) scripts/prove.py --jobs $(JOBS) $(if $(LONG),--long)

golden: venv ## Run the tests of the Python package (no simulator needed)
	@$(PYTEST) golden

lint: venv # Style of Python and VHDL, Python types
	@$(PYTHON) -m mypy --no-error-summary & types=$$!; \
	$(PYTHON) -m ruff check --quiet conftest.py golden studies tb scripts examples && \
	$(PYTHON) -m ruff format --quiet --check conftest.py golden studies tb scripts examples && \
	$(PYTHON) scripts/lint_vhdl.py && \
	$(PYTHON) scripts/lint_xst.py && \
	$(PYTHON) scripts/build_docs.py --check && \
	$(PYTHON) scripts/build_hdl.py --check; \
	others=$$?; wait $$types && exit $$others

bitstream: venv ## Build the bitstream of a board: BOARD=atlys|ulx3s|tangnano20k|lifcl40|ecp5-eval DEVICE= SCENE= OUT=, more in docs/boards/
	@$(if $(filter-out atlys,$(BOARD)),scripts/setup.sh ghdl && scripts/setup.sh pnr,:)
	@ISE_LD_LIBRARY_PATH="$$LD_LIBRARY_PATH" LD_LIBRARY_PATH= $(PLENOFIR) bitstream build

bitstreams: venv ## Build the bitstreams of ULX3S, Tang Nano 20K and LIFCL-40 into one archive (build/bitstreams); BOARDS="ulx3s:25f lifcl40" for these
	@scripts/setup.sh ghdl && scripts/setup.sh pnr
	@$(PYTHON) scripts/bitstreams.py $(BOARDS)

bitstream-check: venv simulator # Check everything of the Atlys' bitstream build that can be checked without ISE
	@$(PYTHON) scripts/check_bitstream.py

bench: venv simulator ## Measure error and run time of refocuser, ray model, calibration, simulators; RECORD=1 updates the docs
	@scripts/setup.sh compiler
	@$(PYTHON) scripts/bench.py $(if $(RECORD),--record)
	@$(if $(RECORD),$(PYTHON) scripts/build_docs.py)

docs: venv ## Build the parts of the documentation that come from the sources
	@scripts/setup.sh registers
	@$(PYTHON) scripts/build_registers.py
	@$(PYTHON) scripts/build_hdl.py
	@$(PYTHON) scripts/build_docs.py

site: venv ## Build the documentation as a web site (build/site); to read it: python -m http.server -d build/site
	@scripts/setup.sh site
	@$(PYTHON) scripts/build_site.py

waves: venv # Draw the timing diagrams of docs/fir-array.md from simulations
	@scripts/setup.sh ghdl
	@$(PYTHON) scripts/pictures.py waves

dist: venv test-tools # Build and check the source distribution and the wheel (build/dist)
	@rm -rf build/dist
	@$(PYTHON) -m hatchling build -d build/dist
	@$(PYTHON) -m twine check --strict build/dist/*
	@.venv/bin/check-wheel-contents build/dist/*.whl
	@du -k build/dist/*

venv: # Create .venv
	@scripts/setup.sh venv

test-tools: venv
	@scripts/setup.sh tests

libpython: venv
	@scripts/setup.sh libpython

simulator:
	@$(if $(filter nvc,$(SIM)),:,scripts/setup.sh ghdl)
	@$(if $(filter verilator,$(SIM)),scripts/setup.sh compiler,:)

clean: ## Remove what was built (not .venv)
	@rm -rf build
