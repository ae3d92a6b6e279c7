# The one task runner. Needs make and a Python of 3.11 or newer; everything else goes into .venv/.
SHELL = /bin/sh
.DEFAULT_GOAL = help
unexport PYTHONHOME PYTHONPATH

PYTHON ?=
SCENE ?= heap
POLICY ?= adaptive_push,ppo
EPISODES ?= 3
SEED ?= 0
OUT ?= runs/demo
WORKERS ?= 2
CONFIG ?= configs/train/ppo_heap.toml
# Say where a smaller, CPU-only build of torch is to be had (an index for pip), if you do not want the default one.
TORCH_INDEX ?=
OLDEST = gymnasium==1.2.2
# Tests of these let soil move for thousands of sweeps or updates, which takes minutes in plain Python.
MANY_SWEEPS = tests/sim/test_slump.py tests/sim/test_advance.py tests/sim/test_voxel.py tests/sim/test_voxel_advance.py

environment = @PYTHON="$(PYTHON)" sh .ci/environment
pytest = .venv/test/bin/python -m pytest
torch_index = $(if $(TORCH_INDEX),--extra-index-url $(TORCH_INDEX))

.PHONY: help
help: ## what can be made
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-18s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "Variables: PYTHON, SCENE, POLICY, EPISODES, SEED, OUT (demo), CONFIG (train), WORKERS, TESTS (test), TORCH_INDEX."

.PHONY: demo
demo: .venv-demo ## set up what it needs, then push the soil of a scene: pictures and numbers in runs/demo/
	.venv/demo/bin/dirt-push run --scene $(SCENE) --policy $(POLICY) --episodes $(EPISODES) --seed $(SEED) --out $(OUT)

.PHONY: train
train: .venv-train ## set up what it needs, then train a policy, or go on with it (CONFIG, SEED)
	@.venv/train/bin/python agents/train.py --config $(CONFIG) --seed $(SEED)

.PHONY: test
test: check ## set up what it needs, then lint, contracts and all tests (TESTS="tests/sim -k slump" for some)
	@$(pytest) -n $(WORKERS) $(TESTS)

.PHONY: check
check: lint contracts ## lint and contracts

.PHONY: lint
lint: .venv-test ## style: ruff
	@.venv/test/bin/ruff check . && .venv/test/bin/ruff format --check .

.PHONY: format
format: .venv-test ## put the style right where that can be done automatically
	@.venv/test/bin/ruff check --quiet --fix . ; .venv/test/bin/ruff format .

.PHONY: contracts
contracts: .venv-test ## who may import whom: import-linter
	@.venv/test/bin/lint-imports --no-logo

.PHONY: test-oldest
test-oldest: .venv-oldest ## the environment's tests on the oldest supported gymnasium
	@.venv/oldest/bin/python -m pytest tests/test_registration.py tests/test_env.py tests/test_conformance.py

.PHONY: test-interpreted
test-interpreted: .venv-test ## tests of kernels without compilation, where that takes seconds only
	@NUMBA_DISABLE_JIT=1 $(pytest) -m "not slow" tests/task tests/sim $(addprefix --ignore=,$(MANY_SWEEPS))

.PHONY: test-ray
test-ray: .venv-ray ## evaluation and RLlib's PPO on a local Ray cluster of two nodes that loses one
	@.venv/ray/bin/python -m pytest tests/bench/evaluate/test_cluster.py tests/agents/rllib

.PHONY: test-integrations
test-integrations: .venv-integrations ## what others train with: RL Zoo and TorchRL
	@.venv/integrations/bin/python -m pytest tests/docs/test_integrations.py

.PHONY: package
package: .venv-test ## build the wheel and the source distribution into dist/
	@.venv/test/bin/python -m build --outdir dist

.PHONY: clean
clean: ## remove everything that was made, environments included
	@rm -rf .venv build dist runs *.egg-info .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +

.PHONY: .venv-demo .venv-train .venv-test .venv-oldest .venv-ray .venv-integrations
.venv-demo:
	$(environment) demo 400 -c constraints.txt -e '.[render]'

.venv-train:
	$(environment) train 1500 $(torch_index) -c constraints.txt -e '.[train]'

.venv-test:
	$(environment) test 2000 $(torch_index) -c constraints.txt -e '.[all,dev]'

.venv-oldest:
	@mkdir -p .venv && sed 's/^gymnasium==.*/$(OLDEST)/' constraints.txt > .venv/oldest.txt
	$(environment) oldest 600 -c .venv/oldest.txt -e '.[render,files,dev]'

# Ray pins the oldest gymnasium that is supported, so it lives apart.
.venv-ray:
	@mkdir -p .venv && sed 's/^gymnasium==.*/$(OLDEST)/' constraints.txt > .venv/ray.txt
	$(environment) ray 2500 $(torch_index) -c .venv/ray.txt -e '.[ray,rllib,bench]' pytest hypothesis

# RL Zoo wants an older python-dateutil than matplotlib would take.
.venv-integrations:
	@mkdir -p .venv && sed '/^python-dateutil==/d' constraints.txt > .venv/integrations.txt
	$(environment) integrations 2500 $(torch_index) -c .venv/integrations.txt -e '.[integrations]' pytest hypothesis
