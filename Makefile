PYTHON ?= python3
BIN := .venv/bin
INSTALL := $(BIN)/pip install --quiet --disable-pip-version-check --editable

# Some machines set it; each process, and each worker of the tests, would compile all modules again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: derive test campaign check check-generated format lint types bench bench-quick bench-count bench-check docs site reproduce wheel kernels robots-wheel robots lock gallery clean help

# Another hash seed, and a processor for which OpenBLAS and NumPy round otherwise: neither may show
# in a generated file. `make derive UNDER='$(ELSEWHERE)'`
ELSEWHERE := PYTHONHASHSEED=4242 OPENBLAS_CORETYPE=Prescott \
  NPY_DISABLE_CPU_FEATURES="X86_V3 X86_V4 AVX512_ICL AVX512_SPR"

derive: .venv/derive ## derive, generate and compile every robot
	@$(UNDER) $(BIN)/chasles derive derive/robots/*.toml && $(BIN)/python -m chasles build

# Compiles shipped robots first: workers would compile each of them several times. Tests wait for
# compilers and browsers, so a worker more than there are cores keeps the cores busy.
test: .venv/dev ## the whole test suite
	@$(BIN)/python -m chasles build >/dev/null
	@OPENBLAS_NUM_THREADS=1 PYTEST_XDIST_AUTO_NUM_WORKERS=$$(($$(getconf _NPROCESSORS_ONLN) + 1)) $(BIN)/python -m pytest

SECONDS ?= 300
CAMPAIGN = --seconds $(SECONDS) $(if $(SEED),--seed $(SEED)) $(if $(ONLY),--only $(ONLY)) \
  $(if $(TRIAL),--trial $(TRIAL))

campaign: .venv/dev ## random trials: SECONDS=300 SEED=7 ONLY=losses,field; TRIAL=N repeats one
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.campaigns $(CAMPAIGN)

check: format lint types check-generated test ## everything that a change must pass

check-generated: .venv/dev ## derive again and compare every byte with generated/
	@$(ELSEWHERE) $(BIN)/chasles derive --up-to-date derive/robots/*.toml

format: .venv/dev ## fail where a formatter would change something
	@$(BIN)/ruff format --check .
	@git ls-files '*.c' '*.h' '*.cpp' '*.cuh' '*.hpp' ':!generated' | xargs $(BIN)/clang-format --dry-run --Werror

lint: .venv/dev ## ruff's rules
	@$(BIN)/ruff check .

types: .venv/dev build/typing/chasles ## mypy, strict
	@MYPYPATH=build/typing $(BIN)/mypy -p chasles

bench: .venv/bench ## speed and size, as ratios to peers measured in the same run
	@$(BIN)/python -m bench

bench-quick: .venv/dev ## see that every benchmark runs
	@$(BIN)/python -m bench --quick

bench-count: .venv/dev ## counted instructions, compared with bench/instructions.json (needs valgrind)
	@$(BIN)/python -m bench count

bench-check: .venv/bench ## a short run, compared with bench/baseline.json, and counted instructions
	@$(BIN)/python -m bench check && $(BIN)/python -m bench count

docs: .venv/derive ## every robot's equations as PDF in build/docs (needs pdflatex)
	@$(BIN)/python docs/build.py

site: .venv/site build/typing/chasles ## the documentation as a site in build/site
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

reproduce: .venv/dev ## the five papers: numbers and pictures in build/reproduce, their pages checked
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python docs/papers/report.py

# The wheel contains kernels for all processors, so that the robots load without a compiler. zig links
# against an old glibc.
ZIG = $(CURDIR)/$(BIN)/python -m ziglang cc -target $$(uname -m)-linux-gnu.2.28
REPAIR = PATH=$(CURDIR)/$(BIN):$$PATH auditwheel repair --plat manylinux_2_28_$$(uname -m) --wheel-dir dist
wheel: .venv/wheel kernels ## the wheel with compiled robots, in dist
	@rm -rf build/wheel build/unrepaired && mkdir -p build/wheel dist && git archive HEAD | tar -x -C build/wheel
	@for kernel in build/kernels/*/*.so; do cp $$kernel build/wheel/generated/$$(basename $$(dirname $$kernel)); done
	@cd build/wheel && CC="$(ZIG)" LDSHARED="$(ZIG) -shared" $(CURDIR)/$(BIN)/python -m build --wheel --outdir ../unrepaired . >../wheel.log
	@$(REPAIR) build/unrepaired/*.whl
	@$(BIN)/twine check --strict dist/*.whl

kernels: .venv/derive ## the kernels of the shipped robots, in build/kernels
	@$(BIN)/chasles build --portable build/kernels

robots-wheel: .venv/wheel robots ## the wheel of chasles-robots, in dist
	@rm -rf build/unrepaired packages/robots/build && mkdir -p dist
	@$(BIN)/python -m build --wheel --outdir build/unrepaired packages/robots >build/robots-wheel.log
	@$(REPAIR) build/unrepaired/*.whl
	@$(BIN)/twine check --strict dist/chasles_robots-*.whl

robots: .venv/derive ## the shelf, derived and compiled, in packages/robots; up to date parts stay
	@$(BIN)/chasles derive derive/robots/shelf/*.toml --to build/shelf --detail none --languages c,python
	@$(BIN)/chasles build build/shelf/*/ --portable packages/robots/chasles_robots

gallery: .venv/dev ## a page with sliders of every robot in build/gallery
	@$(BIN)/python docs/gallery.py

clean: ## remove the environment and everything built
	@rm -rf .venv build dist *.egg-info runtime/*/*.so generated/*/.derived

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 18

.venv/bin/python:
	@$(PYTHON) -m venv .venv

SOURCES := pyproject.toml setup.py $(wildcard contract/*.h runtime/*/*.[ch] runtime/*/*/*.[ch])

.venv/derive: .venv/bin/python $(SOURCES)
	@echo "installing chasles and its compiler into .venv" && $(INSTALL) '.[derive]' && touch $@

# Compiles the shipped robots, too, which a wheel contains compiled.
.venv/dev: .venv/bin/python $(SOURCES)
	@echo "installing chasles, its compiler, the tests' tools and oracles into .venv" && $(INSTALL) '.[derive,files,calibration,study,cluster,test,crosscheck,view,dev]' && $(BIN)/python -m chasles build >/dev/null && touch .venv/derive $@

.venv/bench: .venv/dev
	@echo "installing the benchmarks' peers into .venv" && $(INSTALL) '.[bench]' && touch $@

# The packages that the continuous integration installs.
EXTRAS := derive files calibration study cluster test crosscheck view dev docs
lock: .venv/bin/python ## resolve the locked packages of .ci/requirements.txt anew
	@$(BIN)/pip install --quiet uv && $(BIN)/uv pip compile pyproject.toml $(EXTRAS:%=--extra %) --generate-hashes --upgrade \
	  --no-annotate --no-header --python-version 3.11 --python-platform x86_64-manylinux_2_28 -q -o .ci/requirements.txt

.venv/wheel: .venv/dev
	@echo "installing the tools that build wheels into .venv" && $(INSTALL) '.[wheel]' && touch $@

.venv/site: .venv/bin/python pyproject.toml
	@echo "installing the builder of the site into .venv" && $(INSTALL) '.[docs]' && touch $@

build/typing/chasles: $(wildcard runtime/* runtime/*/* apps/*)
	@rm -rf $@ && mkdir -p $@ && ln -sfn $(CURDIR)/runtime/* $(CURDIR)/apps/* $(CURDIR)/contract $(CURDIR)/derive $(CURDIR)/generated $@/
