# mracad: multiresolution editing for CAD models.
#
#   make demo    set everything up and smooth a sample
#   make example smooth, sweep, emboss and knurl a shell of a dozen patches, step by step (docs/example.md)
#   make test    set everything up and run the tests
#   make test-long  at more scales, with the largest real models everywhere
#   make site    build the documentation as a site, in build/site
#   make regress compare every sample with the reference figures in samples/figures.json
#   make fresh   build wheel and sdist, install each in an empty environment and try it
#   make random  take features from 200 random places to others, against the closed form (ten minutes)
#   make fuzz    feed the commands 2 000 damaged files and kill 200 writers (half an hour)
#
# The pattern rule below is the use the tool is for: copy it into a Makefile beside your own models.

PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
SCALE  ?= 5%

export PIP_CONSTRAINT := $(abspath constraints.txt)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export SOURCE_DATE_EPOCH ?= 0

SAMPLES := $(wildcard samples/*.step)

.PHONY: demo example test test-long regress random fuzz lint bench bench-batch bench-fill bench-large docs site pictures samples smooth wheel fresh man clean

demo: $(VENV)/ready
	@mkdir -p build
	@echo 'mracad smooth samples/panel.step --scale 25mm -o build/panel.smooth.step -o build/panel.smooth.stl'
	@$(BIN)/mracad smooth samples/panel.step --scale 25mm --overwrite -o build/panel.smooth.step -o build/panel.smooth.stl
	@echo 'The result lies in build/panel.smooth.step (and .stl); compare it with samples/panel.step.'

example: $(VENV)/ready
	@mkdir -p build
	$(BIN)/mracad run samples/example/recipe.toml samples/shell.step --overwrite -o build/example.step -o build/example.stl
	@echo 'The result lies in build/example.step (and .stl); docs/example.md shows each step.'

test: $(VENV)/dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2

test-long: $(VENV)/dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --long

regress: $(VENV)/ready
	$(BIN)/python samples/regress.py samples/*.step

fuzz: $(VENV)/dev
	$(BIN)/python -m tests.robust.mutate 2000
	$(BIN)/python -m tests.robust.kill 200

random: $(VENV)/dev
	$(BIN)/python -m tests.edit.feature.random_places 200

lint: $(VENV)/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/dev
	$(BIN)/python benchmarks/transform.py
	$(BIN)/python benchmarks/phases.py
	$(BIN)/python benchmarks/features.py
	$(BIN)/python benchmarks/seams.py
	$(BIN)/python benchmarks/workers.py

# 5 000 dimples all over a ball of six patches, to a closed mesh
bench-fill: $(VENV)/dev
	$(BIN)/python benchmarks/fill.py

# One face of up to 515 x 515 control points: time, memory, exponents; five minutes
bench-large: $(VENV)/dev
	$(BIN)/python benchmarks/large.py

# Batches: what workers gain, kills, a lost cluster worker; some minutes
bench-batch: $(VENV)/dev
	$(BIN)/python benchmarks/batch.py

# The pages of steps and commands, from their declarations, and the picture of the rooms, from the imports
docs: $(VENV)/ready
	$(BIN)/python -c 'from mracad.spec.schema import page; print(page(), end="")' > docs/steps.md
	$(BIN)/python docs/commands.py > docs/commands.md
	$(BIN)/python -c 'from mracad.api.stub import stub; print(stub(), end="")' > mracad/__init__.pyi
	$(BIN)/python docs/house.py > docs/house.svg

# The documentation as a site; a link or an anchor that leads nowhere is an error
site: $(VENV)/dev
	$(BIN)/python -m sphinx -q -W --keep-going -c docs -d build/site.read . build/site
	@echo 'The site lies in build/site; begin with build/site/docs/index.html.'

# All other pictures of the documentation, and the gallery, by mracad itself
pictures: $(VENV)/ready
	$(BIN)/python docs/pictures.py
	$(BIN)/python docs/curves.py

samples: $(VENV)/ready
	$(BIN)/python samples/make.py samples
	$(BIN)/python samples/example/make.py

# All samples smoothed: make smooth SCALE=2% -j2
smooth: $(SAMPLES:samples/%.step=build/%.smooth.step)

build/%.smooth.step: samples/%.step $(VENV)/ready
	@mkdir -p $(@D)
	$(BIN)/mracad smooth $< --scale $(SCALE) --overwrite -o $@

build/%.stl: build/%.step
	$(BIN)/mracad convert $< --overwrite -o $@

wheel: $(VENV)/dev
	$(BIN)/python -m build --wheel

# The packages as users get them, installed where nothing else is: some minutes and a gigabyte
fresh: $(VENV)/dev
	rm -rf build/fresh && mkdir -p build/fresh
	$(BIN)/python -m build --outdir build/fresh
	for package in build/fresh/*.whl build/fresh/*.tar.gz; do \
	  rm -rf build/fresh/venv && $(PYTHON) -m venv build/fresh/venv && \
	  build/fresh/venv/bin/pip install --quiet "$$package[view]" && \
	  (cd build/fresh && PATH="$$PWD/venv/bin:$$PATH" sh -e ../../packaging/try.sh ../../samples) || exit 1; \
	done

# Manual pages, for packagers
man: $(VENV)/ready
	$(BIN)/mracad man build/man/man1

$(VENV)/ready: pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "mracad needs Python 3.11 or newer: make PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --editable '.[cadquery,features,view]'
	$(BIN)/python -m mracad.warm
	@touch $@

$(VENV)/dev: $(VENV)/ready
	$(BIN)/pip install --quiet --editable '.[dev]'
	@touch $@

clean:
	rm -rf build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
