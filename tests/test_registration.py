"""`import dirt_env` registers the environment and is cheap."""

import json
import subprocess
import sys
from importlib.metadata import version

import gymnasium
import pytest

import dirt_env

HEAVY = {"numba", "torch", "stable_baselines3", "pygame", "matplotlib", "PIL", "scipy", "rasterio", "pandas"}


def fresh(code: str) -> str:
    """What a new process prints."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True).stdout


def test_importing_brings_in_nothing_heavy():
    loaded = json.loads(fresh("import dirt_env, json, sys; print(json.dumps(list(sys.modules)))"))
    assert not HEAVY & set(loaded)


def test_the_environment_is_made_by_name_in_a_fresh_process():
    code = "import gymnasium; print(type(gymnasium.make('dirt_env:DirtPush-v0').unwrapped).__name__)"
    assert fresh(code).strip() == "DirtPushEnv"


@pytest.mark.parametrize("options", [{}, {"scene": "heap", "soil": {"repose": 30}}])
def test_the_specification_survives_json(options):
    spec = gymnasium.make("DirtPush-v0", **options).spec
    assert gymnasium.envs.registration.EnvSpec.from_json(spec.to_json()) == spec
    assert spec.max_episode_steps == 600


def test_the_version_is_the_installed_one():
    assert dirt_env.__version__ == version("dirt-push")
