# Two commands do everything: `make demo` runs the main job, `make test` passes the tests.
# Both put what they need into this checkout (.tools, .venv) and leave the rest of the machine alone.

UV := .tools/bin/uv
PYTHON := .venv/bin/python
DEMO := demo

.DEFAULT_GOAL := help
.PHONY: help install demo test check bench study wheel clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*## ' Makefile | sed 's/:.*## /\t/' | expand -t 12

$(UV):
	python3 -m pip install --quiet --target .tools uv

.venv/.ready: pyproject.toml | $(UV)
	test -x $(PYTHON) || $(UV) venv --quiet --python python3 .venv
	$(UV) pip install --quiet --python $(PYTHON) --group dev --editable .
	touch $@

install: .venv/.ready  ## install sixthlink and its tools into .venv

demo: .venv/.ready  ## simulate the paper's cell, calibrate, verify on the ruler, leave demo/result/report.html
	rm -rf $(DEMO)
	.venv/bin/sixthlink simulate $(DEMO) --scenario paper --seed 0
	.venv/bin/sixthlink calibrate $(DEMO)
	.venv/bin/sixthlink verify $(DEMO)
	@echo "open $(DEMO)/result/report.html"

check: .venv/.ready  ## lint, types, floors
	.venv/bin/ruff check src tests benchmarks examples
	.venv/bin/ruff format --check src tests benchmarks examples
	.venv/bin/mypy
	.venv/bin/lint-imports

test: check  ## everything that must be green
	OPENBLAS_NUM_THREADS=1 .venv/bin/pytest -n 2 --dist loadfile

bench: .venv/.ready .venv-cv4/.ready .venv-peers/.ready  ## figures of the docs, with OpenCV 4.14 and other libraries beside
	$(PYTHON) benchmarks/paper_cell.py
	$(PYTHON) benchmarks/table_two.py
	$(PYTHON) benchmarks/tracker_arm.py
	$(PYTHON) benchmarks/real_recordings.py
	$(PYTHON) benchmarks/certified_heads.py
	$(PYTHON) benchmarks/degenerate_motion.py
	$(PYTHON) benchmarks/wrong_shots.py
	$(PYTHON) benchmarks/boards.py
	$(PYTHON) benchmarks/detection_speed.py
	$(PYTHON) benchmarks/detection_table.py
	PYTHONPATH=src .venv-cv4/bin/python benchmarks/solver_times.py
	PYTHONPATH=src .venv-cv4/bin/python benchmarks/closed_forms_against_opencv.py
	OMP_NUM_THREADS=1 .venv-peers/bin/python benchmarks/global_search.py
	OMP_NUM_THREADS=1 .venv-peers/bin/python benchmarks/joint_times.py

study: .venv/.ready  ## thousands of simulated recordings judge the uncertainties (half an hour on two cores; goes on where it was stopped)
	$(PYTHON) benchmarks/honest_uncertainty.py study 2000

.venv-cv4/.ready: | $(UV)
	test -x .venv-cv4/bin/python || $(UV) venv --quiet --python python3 .venv-cv4
	$(UV) pip install --quiet --python .venv-cv4/bin/python numpy scipy clarabel 'opencv-python-headless==4.14.*'
	touch $@

.venv-peers/.ready: | $(UV)
	test -x .venv-peers/bin/python || $(UV) venv --quiet --python python3 .venv-peers
	$(UV) pip install --quiet --python .venv-peers/bin/python --editable . pyswarms cma pymoo pyceres
	touch $@

wheel: .venv/.ready  ## build the wheel into dist/
	$(UV) build --quiet --wheel

clean:  ## remove everything that the targets made
	rm -rf .tools .venv .venv-cv4 .venv-peers dist study $(DEMO)
