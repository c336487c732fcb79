# make demo, make benchmark and make test set up .venv from requirements.lock first; Python compiles what is imported.
# make test-all runs the slow tests too, but for the modules of make test-integration: tests that need PyTorch, an S3 server, SLURM,
# validators of other formats, other simulators or Sphinx, in an environment of their own; make docs builds the site there.

PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3 python; do \
	$$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo benchmark pytest static test test-all test-integration docs reference pictures sample validation lock clean

demo: .venv/ready
	$(BIN)/echotruth run config/demo.yaml

benchmark: .venv/ready  ## the suite and docs/benchmark.md; takes hours, and goes on where it was stopped
	for part in 1 2 3 4 5 6 7 8 9 10; do $(BIN)/python -m benchmarks.suite part $$part --jobs 2 || exit; done
	$(BIN)/python -m benchmarks.suite page

# Some workers, and the static checks beside them; the tests of a module stay on one worker, because they share expensive
# fixtures.
WORKERS := 2
test: CHOICE = -m "not slow"
test-all: CHOICE = $(INTEGRATION:%=--ignore=%)
test test-all: .venv/ready
	$(MAKE) -j 2 static pytest CHOICE='$(CHOICE)'

pytest:
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadscope --no-loadscope-reorder $(CHOICE)

static:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/mypy

# Modules with tests that need more than .venv; tests/docs/test_site.py builds the site.
INTEGRATION := tests/cluster tests/test_torch.py tests/learning/test_baselines.py tests/sharing tests/repository/test_remote.py \
	tests/repository/test_export.py tests/repository/test_tensorstore.py tests/imaging/test_peers.py tests/imaging/test_row_column.py \
	tests/tracking/test_onnx.py tests/docs/test_site.py

test-integration: .venv-integration/ready
	.venv-integration/bin/python -m pytest -n 2 --dist loadscope --no-loadscope-reorder $(INTEGRATION)

# It finds in .venv what both need, pip too, and holds only the rest.
.venv-integration/ready: .venv/ready integration.lock
	$(BIN)/python -m venv --clear --without-pip .venv-integration
	for packages in .venv/lib/python*/site-packages; do \
		echo "$(CURDIR)/$$packages" > ".venv-integration$${packages#.venv}/shared.pth"; done
	.venv-integration/bin/python -m pip install --quiet --no-compile --disable-pip-version-check --require-hashes --no-deps -r integration.lock
	.venv-integration/bin/python -m pip install --quiet --no-compile --disable-pip-version-check "torch==2.13.0"
	.venv-integration/bin/python -m pip install --quiet --no-compile --disable-pip-version-check --no-build-isolation --no-deps -e .
	touch $@

.venv/ready: requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "echotruth needs Python 3.11, 3.12 or 3.13: install one, or give its path: make PYTHON=/path/to/python"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null || { echo "echotruth needs Python 3.11, 3.12 or 3.13, but $(PYTHON) is another version: give the path of one: make PYTHON=/path/to/python"; exit 1; }
	$(PYTHON) -m venv --clear .venv
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --require-hashes --no-deps -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --no-build-isolation --no-deps -e .
	touch $@

docs: .venv-integration/ready  ## the site, in out/site
	.venv-integration/bin/python -m sphinx -W --keep-going -b html -c docs . out/site

pictures: .venv/ready  ## of docs/gallery; half an hour; MICE is the folder of real mice (benchmarks/realism.py)
	$(BIN)/python benchmarks/physiology_pictures.py
	$(BIN)/python benchmarks/realism_picture.py $(MICE:%=--mice %)
	$(BIN)/python benchmarks/moving_pictures.py $(MICE:%=--mice %)
	$(BIN)/python benchmarks/doppler_pictures.py
	$(BIN)/python benchmarks/volume_picture.py
	$(BIN)/echotruth run config/demo.yaml
	$(BIN)/python benchmarks/gallery_pictures.py out/demo
	$(BIN)/echotruth run benchmarks/default.yaml
	$(BIN)/python benchmarks/default_pictures.py out/default

reference: .venv/ready  ## generated pages: schema and tables
	$(BIN)/python docs/reference.py

# Without scatterers and lines, which no reader needs, so that it is small.
SAMPLE := src/echotruth/shipped/sample.zip
sample: .venv/ready config/sample.yaml  ## the repository that comes with the package
	rm -rf out/sample
	$(BIN)/echotruth run config/sample.yaml
	rm -rf out/sample/sample.zarr/clips/*/*/rf out/sample/sample.zarr/clips/*/*/phantom
	$(BIN)/python workflow/scripts/repository.py out/sample
	$(BIN)/python -c 'import sys; from pathlib import Path; from echotruth.archive import pack; pack(*map(Path, sys.argv[1:3]), *sys.argv[3:])' \
		$(SAMPLE) out/sample sample.zarr config.yaml cases.csv cases SHA256SUMS
	$(BIN)/echotruth check sample

validation: .venv/ready  ## docs/validation.md; takes half an hour on one core
	$(BIN)/python -m validation

COMPILE := uv pip compile pyproject.toml --extra make --extra test --extra browser --extra build --universal --python-version 3.11 \
	--generate-hashes --no-header --no-annotate --quiet

lock:  ## needs uv
	$(COMPILE) --output-file requirements.lock
	$(COMPILE) --extra integration --extra peers --extra docs --output-file integration.lock

clean:
	rm -rf .venv .venv-integration .snakemake out docs/notebooks/.snakemake docs/notebooks/out
