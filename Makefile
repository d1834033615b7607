# Every command makes the environment in .venv first, from a bare clone, without root.
PYTHON ?= python3
PYTHON311 ?= python3.11
SCALE ?= smoke
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/purelight-ready

.PHONY: demo gallery test test-all test-matrix test-node test-web test-blender web blender lint docs bench bench-fidelity

demo: $(READY)  ## train, export and render a lamp; the report lands in out/demo
	$(BIN)/purelight-demo --output out/demo

gallery: $(READY)  ## every lamp and room of the examples; look at out/gallery/gallery.html
	$(BIN)/purelight-gallery --output out/gallery

test: $(READY)  ## the quick tests
	$(BIN)/pytest -n auto --maxprocesses 4 --dist loadfile -m "not slow"

test-all: $(READY)  ## the quick, statistical and fuzz tests
	$(BIN)/pytest

test-matrix:  ## the quick tests on every Python that is installed, each in its own environment
	.ci/matrix

test-node: $(READY)  ## the conformance suite against the host in JavaScript; needs Node.js and npm
	npm ci --ignore-scripts --prefix examples/hosts/node
	$(BIN)/pytest tests/conformance/test_hosts.py -k another_language

web:  ## the page of `purelight-view --web`, built anew; needs Node.js and npm
	npm ci --ignore-scripts --prefix web
	npm run build --prefix web -- $(CURDIR)/runtimes/onnx/purelight_onnx/page.html

test-web: $(READY)  ## the page in a headless Chromium; needs Node.js, npm and chromium
	npm ci --ignore-scripts --prefix web
	$(BIN)/pytest tests/unit/web

blender: $(READY)  ## the extension for Blender; install out/purelight-blender.zip
	$(BIN)/purelight-blender --output out/purelight-blender.zip

test-blender: $(READY)  ## the extension in Blender as a module; needs Python 3.11
	@test -x out/bpy/bin/python || { command -v $(PYTHON311) >/dev/null || \
	  { echo "error: Blender's module needs Python 3.11; name one with make PYTHON311=..." >&2; exit 1; }; \
	  $(PYTHON311) -m venv out/bpy; }
	out/bpy/bin/python -c 'import importlib.util as u, sys; sys.exit(not u.find_spec("bpy"))' || \
	  out/bpy/bin/python -m pip install bpy==5.0.1
	PURELIGHT_BPY_PYTHON=$(CURDIR)/out/bpy/bin/python $(BIN)/pytest tests/unit/blender tests/unit/shader/test_osl.py

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(READY)  ## the site; open out/docs/index.html
	$(BIN)/python -m sphinx --fail-on-warning --keep-going -q docs out/docs

bench: $(READY)  ## systems side by side at SCALE=smoke, small or full; see out/systems/SCALE/report
	$(BIN)/python -m benchmarks.systems --output out/systems --scale $(SCALE)

bench-fidelity: $(READY)  ## how near bundles are to their lamps; the tables land in out/bench
	$(BIN)/python -m benchmarks --output out/bench

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' || \
	  { echo "error: PureLight needs Python 3.10 to 3.13; name one with make PYTHON=python3.11" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -c constraints.txt -e '.[dev]'
	@touch $@
