# plenofir: see README.md. `make sim` and `make test` set up everything they need.

RAW ?=
M ?=
A ?=
SWEEP ?=
IOTA ?= 1
INTERPOLATION ?= nearest
OUT ?= build/sim
ARITH ?= exact
FRACTION ?=
GUARD ?=
SIM ?= ghdl
WAVES ?= 0
JOBS ?= $(shell nproc)

PYTHON := .venv/bin/python
PYTEST := SIM=$(SIM) $(PYTHON) -m pytest -n $(JOBS) --dist worksteal

.PHONY: help sim test test-full golden lint docs waves bench venv simulator libpython clean

help: ## List the targets
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

sim: venv simulator ## Refocus an image in the VHDL core: RAW= M= A= SWEEP= IOTA= INTERPOLATION= OUT= ARITH= FRACTION= GUARD= SIM= WAVES=
	@.venv/bin/plenofir sim $(if $(RAW),--raw "$(RAW)") $(if $(M),--micro-image="$(M)") $(if $(A),--a="$(A)") \
		--sweep="$(SWEEP)" --iota="$(IOTA)" --interpolation "$(INTERPOLATION)" --out "$(OUT)" --arith "$(ARITH)" --fraction "$(FRACTION)" --guard "$(GUARD)" \
		--simulator "$(SIM)" --waves "$(WAVES)"

test: venv simulator libpython lint ## Style, types, golden model, testbenches
	@$(PYTEST) -m "not slow"

test-full: venv simulator libpython lint ## All of the above, and the long runs
	@$(PYTEST)

golden: venv ## Golden-model tests alone (no simulator needed)
	@$(PYTEST) golden

lint: venv ## Style of Python and VHDL, Python types
	@$(PYTHON) -m ruff check --quiet golden tb scripts
	@$(PYTHON) -m ruff format --quiet --check golden tb scripts
	@$(PYTHON) -m mypy --no-error-summary
	@.venv/bin/vsg --configuration scripts/vsg.yaml --output_format syntastic --filename $$(find hdl tb -name '*.vhd')
	@$(PYTHON) scripts/build_docs.py --check

bench: venv simulator ## Measure refocuser, ray model, calibration, simulators; error against run time, stability (build/bench)
	@$(PYTHON) scripts/bench.py

docs: venv ## Build what the documentation takes from the sources
	@$(PYTHON) scripts/build_docs.py

waves: venv ## Draw the timing diagrams of docs/waves.md from simulations
	@scripts/setup.sh ghdl
	@$(PYTHON) scripts/draw_waves.py

venv: ## Create .venv
	@scripts/setup.sh venv

libpython: venv
	@scripts/setup.sh libpython

simulator:
	@$(if $(filter ghdl,$(SIM)),scripts/setup.sh ghdl,:)

clean: ## Remove what was built (not .venv)
	@rm -rf build
