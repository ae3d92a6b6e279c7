"""Episodes go into a batch and come out as they were; its worlds know nothing of one another."""

import copy
import json
import os
import pickle
import subprocess
import sys

import gymnasium
import numba
import numpy as np
import pytest

from dirt_env import worlds as module
from dirt_env.config import load
from dirt_env.config.episode import layout
from dirt_env.episode import Episode
from dirt_env.snapshot import pack
from dirt_env.worlds import Worlds

SCENES = [{"level": 2}, {"level": 5}, {"scene": "pad"}, {"site": {"border": "open"}}, {"scene": "several_goals"}]


def begun(config, seed):
    return Episode.begin(config, layout(config, np.random.default_rng(seed)))


def drive(worlds, index, steps, seed=0):
    rng = np.random.default_rng(seed)
    returned = [worlds.step(index, rng.uniform(-1, 1, 3)) for _ in range(steps)]
    return [({name: array.tobytes() for name, array in seen.items()}, figures) for seen, figures in returned]


@pytest.mark.parametrize("options", SCENES, ids=str)
def test_an_episode_comes_out_as_it_went_in(options):
    config = load(**options) if "scene" in options else load("heap", **options)
    worlds = Worlds([config] * 2)
    episode = begun(config, 3)
    worlds.put(1, episode)
    found, expected = worlds.episode(1).to_tree(), episode.to_tree()
    for tree in (found, expected):
        tree["world"]["changed"] = None  # what a reader of the batch has seen
        tree["world"]["solid"] = None  # in the batch all False where there is nothing solid
    assert pack(found) == pack(expected)
    assert worlds.episode(1).remaining == episode.remaining
    assert worlds.layouts[0] is None


@pytest.mark.parametrize("options", SCENES, ids=str)
def test_a_world_does_the_same_wherever_it_is(options):
    config = load(**options) if "scene" in options else load("heap", **options)
    alone, many = Worlds([config]), Worlds([config] * 3)
    alone.put(0, begun(config, 5))
    for index, seed in enumerate((4, 6, 5)):
        many.put(index, begun(config, seed))
    before = pack(many.episode(1).to_tree())
    drive(many, 0, 20)
    assert drive(many, 2, 20) == drive(alone, 0, 20)
    assert pack(many.episode(1).to_tree()) == before


def test_more_goals_than_ever_before_find_room():
    """The number of goals is an episode's own; the arrays grow with it, and what was there stays."""
    config = load("heap")
    worlds = Worlds([config] * 2)
    first, other = begun(config, 1), begun(config, 2)
    worlds.put(0, first)
    centers = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    worlds.put(1, other._replace(job=other.job._replace(centers=centers)))
    assert worlds.episode(1).job.centers.tolist() == centers.tolist()
    assert worlds.episode(0).job.centers.tolist() == first.job.centers.tolist()


@pytest.mark.parametrize("copy_of", [copy.deepcopy, lambda worlds: pickle.loads(pickle.dumps(worlds))])
def test_copies_go_on_by_themselves(copy_of):
    config = load("heap")
    worlds = Worlds([config] * 2)
    for index in range(2):
        worlds.put(index, begun(config, index))
    drive(worlds, 0, 5)
    twin = copy_of(worlds)
    expected = pack(twin.episode(0).to_tree())
    drive(worlds, 0, 5, seed=1)
    assert pack(twin.episode(0).to_tree()) == expected
    drive(twin, 0, 5, seed=1)
    assert pack(twin.episode(0).to_tree()) == pack(worlds.episode(0).to_tree())


NOISE = {"observation": {"noise": {"height": 0.01, "position": 0.05, "heading": 1.0}}}


@pytest.mark.parametrize("options", [*SCENES, {"level": 4}, NOISE, {"terrain": "voxel"}], ids=str)
def test_what_is_compiled_on_another_core_is_what_a_step_calls(options, monkeypatch):
    asked, called, compile_here = [], [], module.machine_code

    def types(function, *arguments):
        return function, tuple(map(numba.typeof, arguments))

    def called_with(function, *arguments):
        called.append(types(function, *arguments))
        return compile_here(function, *arguments)

    monkeypatch.setattr(module, "compile_aside", lambda *arguments: asked.append(types(*arguments)))
    monkeypatch.setattr(module, "machine_code", called_with)
    for cores, expected in ((1, 0), (2, 1)):
        monkeypatch.setattr(module, "cores", lambda cores=cores: cores)
        envs = [gymnasium.make("DirtPush-v0", **options)]
        if options != {"terrain": "voxel"}:
            envs.append(gymnasium.make_vec("DirtPush-v0", num_envs=3, **options))
        for env in envs:
            asked.clear(), called.clear()
            env.reset(seed=1)
            env.reset(seed=2)
            env.step(env.action_space.sample())
            assert len(asked) == expected
            assert set(asked) <= set(called)
            assert [function for function, _ in called].count(module.step_worlds) == 1


@pytest.mark.slow
def test_a_first_reset_has_the_step_compiled_on_another_core(tmp_path):
    code = """
import json, gymnasium, dirt_env.worlds
dirt_env.worlds.cores = lambda: 2
env = gymnasium.make("DirtPush-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
stats = dirt_env.worlds.step_worlds.stats
print(json.dumps([sum(stats.cache_hits.values()), sum(stats.cache_misses.values())]))
"""
    variables = os.environ | {"DIRT_ENV_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}
    assert json.loads(subprocess.check_output([sys.executable, "-c", code], env=variables, text=True)) == [1, 0]
