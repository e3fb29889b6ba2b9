# Everything runs in private environments under .venv/; the work is done by scripts/*.py, for any Python from 3.8 on.
# PYTHON=... names the Python to use, 3.11 or 3.13; without it one is looked for.

export PYTHON

# The first Python that runs at all. It finds the right one, or says clearly what is missing.
BOOT := $(shell for python in "$(PYTHON)" python3.11 python3.13 python3 python "$(HOME)"/.pyenv/versions/*/bin/python3; do \
	"$$python" -c "import sys; sys.exit(sys.version_info < (3, 8))" >/dev/null 2>&1 && echo "$$python" && break; done)
run = $(if $(BOOT),"$(BOOT)",$(error No Python is found: install Python 3.11 or 3.13, or name it by PYTHON=...)) -B scripts/

.PHONY: help demo test test-all test-gui build wheel validate audit lint docs benchmark index pictures release publish clean

help: ## Show this list (default)
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "%-12s%s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: ## Analyze a sample point cloud, or SCAN=file.ply (UP=Z if its Z axis points upwards), and render it
	@$(run)in_blender.py demo.py $(if $(SCAN),"$(SCAN)") $(if $(UP),--up $(UP))

test: ## Test core, and the extension in the newest Blender for this Python
	@$(run)run_tests.py

test-all: ## Test core and the extension in every supported Python and Blender, and window, that can run here
	@$(run)run_tests.py --all

test-gui: ## Test with real keys and mouse in a Blender window, prepared once: some minutes, 1.7 GB, Linux and root
	@$(run)run_tests.py --gui

build: ## Build one zip per platform into dist/
	@$(run)package.py

wheel: ## Build the wheel for scripts without Blender into dist/
	@$(run)environments.py hatch -m hatchling build -t wheel -d dist

validate: ## Build, and run Blender's validator on every zip
	@$(run)package.py --validate

audit: ## Ask the public database of vulnerabilities about the wheels that the zips bring (needs the internet)
	@$(run)environments.py audit -m pip_audit --vulnerability-service osv --disable-pip --requirement wheels.txt

lint: ## Check style, format and the types of core
	@$(run)environments.py lint -m ruff check .
	@$(run)environments.py lint -m ruff format --check .
	@$(run)environments.py lint -m mypy

docs: ## Build the site of the manual and the API into build/docs/; warnings, as of broken links, are errors
	@$(run)environments.py docs -m mkdocs build --strict

benchmark: ## Compute the tables and figures of the paper and the peers
	@$(run)environments.py benchmark -m benchmarks.run $(ARGUMENTS)

index: ## Renew the table of operators in docs/manual.md from the registered tools
	@$(run)in_blender.py manual_index.py

pictures: ## Render the pictures of the manual, or some: ARGUMENTS="smooth rim"; those of scans from MESHFREE_SCANS=folder
	@$(run)in_blender.py pictures.py $(ARGUMENTS)

release: ## Check, test and build a release into dist/: VERSION=1.2.3 [PAGE=address] [UNTESTED="why no test was run"]
	@$(run)release.py "$(VERSION)" $(if $(PAGE),--page "$(PAGE)") $(if $(UNTESTED),--untested "$(UNTESTED)")

publish: ## Upload a release in dist/ to Blender's extensions platform: VERSION=1.2.3 [PLATFORMS="linux-x64 ..."]
	@$(run)publish.py "$(VERSION)" $(PLATFORMS)

clean: ## Remove everything that was made, the environments too
	rm -rf .venv build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
