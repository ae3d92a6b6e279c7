"""What docs/integrations.md says of other libraries; `make test-integrations` has those that few have installed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(*command, cwd):
    """Output of a command; fails with what it said."""
    surroundings = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, *command], cwd=cwd, env=surroundings, capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.mark.slow
def test_the_single_file_learns_to_shove(tmp_path):
    """The file asserts itself that more than 60 % of the soil are in the goal at the end."""
    pytest.importorskip("torch")
    said = run(str(ROOT / "docs" / "examples" / "cleanrl_ppo.py"), cwd=tmp_path)
    assert said.splitlines()[-1].endswith("% of the soil in the goal")


@pytest.mark.slow
def test_rl_zoo_trains_and_shows_what_it_trained(tmp_path):
    pytest.importorskip("rl_zoo3")
    common = ["--algo", "ppo", "--env", "DirtPush-v0", "--gym-packages", "dirt_env", "--device", "cpu"]
    ours = ["--conf-file", str(ROOT / "configs" / "rl_zoo" / "ppo.yml")]
    seen = ["--env-kwargs", "level:0", "observation:" + json.dumps({"size": 16, "resolution": 1.0})]
    short = ["--n-timesteps", "256", "--eval-freq", "-1", "-params", "n_envs:2", "n_steps:64", "batch_size:64"]
    train = ["-m", "rl_zoo3.train", *common, *ours, *seen, "--log-folder", "logs", "--seed", "1"]
    assert "Saving to logs/ppo/DirtPush-v0_1" in run(*train, *short, cwd=tmp_path)
    enjoy = ["-m", "rl_zoo3.enjoy", *common, "--folder", "logs", "--n-timesteps", "601", "--no-render"]
    assert "Episode Length 600" in run(*enjoy, cwd=tmp_path)


def test_torchrl_checks_and_rolls_out_the_environment():
    pytest.importorskip("torchrl")
    from torchrl.envs import CatTensors, Compose, FlattenObservation, GymEnv, TransformedEnv, check_env_specs

    env = GymEnv("dirt_env:DirtPush-v0", level=1)
    check_env_specs(env)
    flat = Compose(FlattenObservation(-3, -1, in_keys=["patch"]), CatTensors(["patch", "pose"], "observation"))
    env = TransformedEnv(env, flat)
    env.set_seed(3)
    steps = env.rollout(20)
    assert steps["observation"].shape == (20, 2 * 32 * 32 + 15)
    single = gymnasium.make("dirt_env:DirtPush-v0", level=1)
    single.reset(seed=3)
    single.reset()  # set_seed plays no episode of that layout; the rollout begins the next one
    rewards = [single.step(action)[1] for action in steps["action"].numpy()]
    assert steps["next", "reward"].flatten().tolist() == pytest.approx(rewards, abs=1e-6)


def test_torchrl_takes_the_native_batch():
    pytest.importorskip("torchrl")
    from torchrl.envs import GymWrapper, check_env_specs

    batch = gymnasium.make_vec("dirt_env:DirtPush-v0", 4, max_episode_steps=5, autoreset_mode="SameStep", info="end")
    env = GymWrapper(batch)
    check_env_specs(env)
    steps = env.rollout(12, break_when_any_done=False)
    assert steps.batch_size == (4, 12)
    assert steps["next", "done"].flatten(1).sum(1).tolist() == [2, 2, 2, 2]
