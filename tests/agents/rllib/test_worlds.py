"""The worlds of env runners: training layouts, and others in every runner."""

from pathlib import Path

from dirt_env.agents.rllib.settings import load_cluster_settings
from dirt_env.agents.rllib.worlds import env_config, make_worlds

from dirt_env.split import TRAINING

SMOKE = Path(__file__).resolve().parents[3] / "configs" / "rllib" / "smoke.toml"


def seeds_of(worlds):
    return [env.np_random_seed for env in worlds.envs]


def test_runners_play_training_layouts_of_their_own():
    """RLlib seeds them one after the other, as a batch its worlds: without care they would share all but one."""
    settings = load_cluster_settings(SMOKE, {})
    first, second = (make_worlds({**env_config(settings), "num_envs": 8}) for _ in range(2))
    first.reset(seed=settings.seed + 1)
    second.reset(seed=settings.seed + 2)
    assert set(seeds_of(first)) | set(seeds_of(second)) <= set(TRAINING)
    assert not set(seeds_of(first)) & set(seeds_of(second))
    again = make_worlds({**env_config(settings), "num_envs": 8})
    again.reset(seed=settings.seed + 1)
    assert seeds_of(again) == seeds_of(first)
    again.reset()
    assert seeds_of(again) == seeds_of(first), "generators go on"


def test_levels_are_dealt_to_the_worlds_in_turn():
    worlds = make_worlds({**env_config(load_cluster_settings(SMOKE, {})), "num_envs": 4})
    assert [env.config.layout.level for env in worlds.envs] == [0, 1, 0, 1]
    assert [env.config.steps for env in worlds.envs] == [20] * 4
