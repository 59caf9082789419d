# make demo shows what robocal does, make test proves it. Needs only make and Python 3.11 to 3.13; the rest goes into .venv.

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
# Choose the Python with make PYTHON=/path/to/python; otherwise scripts/find_python.sh looks for one.
PYTHON ?=

# A sourced ROS or a neighbour's PYTHONPATH must not leak into the environment. Nor an image's wish for no bytecode: every command that a
# test starts, and every worker, would compile its sources again (0.3 s of 1.1 s).
unexport PYTHONHOME PYTHONPATH PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test test-all all quick opencv-5 lint bench coverage clean remake

help:
	@echo "make demo      calibrate real and simulated robots and write a report (the first run installs into .venv)"
	@echo "make test      lint, types, layers and the tests, without the long statistics"
	@echo "make test-all  everything, as CI runs it"
	@echo "make lint      ruff, mypy and import-linter only"
	@echo "make bench     robocal against its peers, in environments of their own"
	@echo "make coverage  which lines the quick tests reach (kernels as plain Python)"
	@echo "make clean     remove .venv and what the tools left behind"

demo: $(VENV)/.has-robocal
	@$(BIN)/robocal demo

# Types are checked beside the tests: one core would wait for the other.
test: $(VENV)/.has-dev
	@$(MAKE) --no-print-directory -j2 -Oline lint quick

test-all: $(VENV)/.has-dev
	@$(MAKE) --no-print-directory -j2 -Oline lint all
	@$(MAKE) --no-print-directory opencv-5

# Images with the other major version of OpenCV: constraints.txt has 4.
opencv-5: $(VENV)/.has-opencv-5
	@printf '\n== pytest: images, with OpenCV 5 ==\n'
	@PYTHONPATH=$(CURDIR)/$(VENV)/opencv-5 $(PYTEST) -m "not slow" tests/cli/test_vision_detect.py tests/cli/test_vision_advice.py \
		tests/cli/test_vision_files.py tests/cli/test_detect_sheets.py tests/files/test_image_files.py tests/files/test_images.py \
		tests/files/test_sheet.py tests/unit/test_sightings.py tests/real/test_images.py

all: $(VENV)/.has-dev
	@printf '\n== pytest: all tests ==\n'
	@$(PYTEST)

quick: $(VENV)/.has-dev
	@printf '\n== pytest: all tests but the long statistics ==\n'
	@$(PYTEST) -m "not slow"

lint: $(VENV)/.has-dev
	@printf '\n== ruff check ==\n'
	@$(BIN)/python -m ruff check
	@printf '\n== ruff format --check ==\n'
	@$(BIN)/python -m ruff format --check
	@printf '\n== mypy --strict ==\n'
	@$(BIN)/python -m mypy
	@printf '\n== import-linter: layers and boundaries ==\n'
	@$(BIN)/lint-imports --no-logo

bench: $(VENV)/.has-dev
	@$(BIN)/python -m benchmarks

coverage: $(VENV)/.has-dev
	@NUMBA_DISABLE_JIT=1 $(PYTEST) -m "not slow" --cov

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis .coverage .coverage.*
	find src tests -type d -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true

# One worker per core already fills the machine; BLAS threads inside each would only wait for one another. Neighbours in a file share
# what they compute once: each worker takes a stretch of the tests, and from the other when it is done.
PYTEST := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --dist worksteal

# An environment belongs to its folder and its Python: it is made anew when the project was moved or that Python has gone.
USABLE := $(shell test "$$(cat $(VENV)/.made-in 2>/dev/null)" = "$(CURDIR)" && $(BIN)/python -c "" 2>/dev/null && echo yes)

$(VENV)/.made-in: $(if $(USABLE),,remake)
	@python=$$(sh scripts/find_python.sh "$(PYTHON)") || exit 1; \
	echo "Making $(VENV) with $$python"; \
	rm -rf $(VENV) && "$$python" -m venv $(VENV) && echo "$(CURDIR)" > $@

$(VENV)/.has-robocal: $(VENV)/.made-in pyproject.toml constraints.txt
	@echo "Installing robocal (the first time takes a minute and the internet)"
	@$(PIP) --editable .
	@touch $@

$(VENV)/.has-dev: $(VENV)/.made-in pyproject.toml constraints.txt
	@echo "Installing robocal, its extras and its tests' tools (the first time takes a minute and the internet)"
	@$(PIP) --editable ".[dev,all]"
	@touch $(VENV)/.has-robocal $@

$(VENV)/.has-opencv-5: $(VENV)/.has-dev
	@echo "Installing OpenCV 5 beside the environment"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --target $(VENV)/opencv-5 --upgrade opencv-python-headless==5.0.0.93
	@touch $@
