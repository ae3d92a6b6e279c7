"""`DirtPush-v0` on the paper's cells: the same observations, actions, reward and metrics in every shipped scene."""

import pickle

import gymnasium as gym
import numpy as np
import pytest

import dirt_env  # noqa: F401
from dirt_env.config import load, scene_names
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy
from dirt_env.rollout import play
from dirt_env.sim.voxel_state import FOOTINGS, GRAIN, volume
from dirt_env.sim.voxel_surface import position_on_surface
from dirt_env.task.reward import TERMS

PUSH = np.array([0.1, 1.0, -0.3], np.float32)


def started(**options):
    env = DirtPushEnv(terrain="voxel", **options)
    env.reset(seed=3)
    return env


@pytest.mark.parametrize("scene", scene_names())
def test_every_shipped_scene_runs_with_the_same_spaces_and_infos(scene):
    cells, field = (gym.make("DirtPush-v0", scene=scene, **more) for more in ({"terrain": "voxel"}, {}))
    assert cells.observation_space == field.observation_space
    assert cells.action_space == field.action_space
    (seen, info), (seen_field, info_field) = cells.reset(seed=5), field.reset(seed=5)
    assert set(info) == set(info_field)
    np.testing.assert_allclose(seen["patch"], seen_field["patch"], atol=0.3)
    for _ in range(5):
        seen, reward, *_, info = cells.step(PUSH)
        assert cells.observation_space.contains(seen)
        assert np.isfinite(reward)
    assert set(info["reward"]) == set(TERMS)


def test_the_terrain_may_be_a_table_with_the_papers_numbers():
    config = load("heap", terrain={"kind": "voxel", "dy": 0.4, "life": 50, "transfer_rate": 0.1, "exact": True})
    rules = config.terrain.rules_for(config.grid, config.soil)
    assert (rules.life, rules.rate, rules.grain) == (50, 0.1, GRAIN)
    assert rules.difference == pytest.approx(config.soil.slope * 0.5 / 0.4)
    assert load(config.to_dict()) == config
    assert load("heap").to_dict()["terrain"] == {"kind": "heightfield"}


def test_levels_are_higher_where_repose_is_steep():
    config = load("heap", terrain="voxel", soil={"repose": 50})
    assert config.terrain.dy_for(config.grid, config.soil) == pytest.approx(0.5 * config.soil.slope / 0.75)
    assert config.terrain.rules_for(config.grid, config.soil).difference == pytest.approx(0.75)


@pytest.mark.parametrize(
    "terrain", ["sand", {"kind": "voxel", "lives": 3}, {"kind": "voxel", "neighbours": 6}, {"dy": 1}]
)
def test_what_is_not_known_is_refused(terrain):
    with pytest.raises(ValueError, match="terrain"):
        load("heap", terrain=terrain)


@pytest.mark.parametrize("terrain", [{"required_difference": 1.0}, {"dy": 0.3}])
def test_cells_whose_walls_never_fall_are_warned_of(terrain):
    with pytest.warns(UserWarning, match=r"terrain.required_difference is 1\.\d\d: .* vertical walls never fall"):
        load("heap", terrain={"kind": "voxel", **terrain})


@pytest.mark.parametrize("footing", FOOTINGS)
def test_what_the_agents_height_follows_is_a_reading_by_name(footing):
    config = load("uneven", terrain={"kind": "voxel", "footing": footing})
    assert FOOTINGS[config.terrain.rules_for(config.grid, config.soil).footing] == footing
    env = DirtPushEnv(scene=config.to_dict())
    env.reset(seed=0)
    world, cell = env.episode.world, config.grid.cell
    for _ in range(4):
        pose = world.machine[0]
        at_point, *_ = position_on_surface(world.surface, cell, pose.x, pose.y)
        assert (pose.z == at_point) == (footing == "point")
        env.step(np.array([0.0, 1.0, 1.0], np.float32))
    assert load("heap", terrain="voxel").terrain.footing == "tracks"


def test_states_pickles_and_copies_go_on_identically():
    env = started(level=1)
    for _ in range(6):
        env.step(PUSH)
    state = env.get_state()
    twin, pickled = DirtPushEnv(terrain="voxel", level=1), pickle.loads(pickle.dumps(env))
    twin.set_state(state)
    assert twin.get_state() == state
    for _ in range(4):
        expected = env.step(PUSH)
        for other in (twin, pickled):
            found = other.step(PUSH)
            np.testing.assert_array_equal(found[0]["patch"], expected[0]["patch"])
            assert found[1] == expected[1]
    assert twin.get_state() == env.get_state() == pickled.get_state()


def test_a_state_of_the_other_terrain_is_refused():
    env = started()
    with pytest.raises(ValueError, match="differently configured"):
        DirtPushEnv().set_state(env.get_state())


def test_the_metrics_know_all_the_soil_even_in_transit():
    env = started(level=0)
    world, cell = env.episode.world, env.config.grid.cell
    for _ in range(30):
        env.step(PUSH)
        over_bottom = float((world.height.astype(float) - world.bottom).sum()) * cell**2
        assert over_bottom == pytest.approx(volume(world.voxels, cell), rel=1e-6)


def test_other_readings_run_in_the_environment():
    reading = {"kind": "voxel", "neighbours": 8, "reads": "in place", "sinking": "in transit", "updates_per_second": 8}
    env = DirtPushEnv(terrain=reading, level=0)
    env.reset(seed=0)
    before = volume(env.episode.world.voxels, 0.5)
    for _ in range(3):
        env.step(PUSH)
    assert volume(env.episode.world.voxels, 0.5) == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("view", ["surface", "cells"])
def test_the_pictures_of_figure_1(view):
    env = started(level=0, view=view, render_mode="rgb_array")
    before = env.render()
    assert before.dtype == np.uint8
    assert before.shape[1:] == (640, 3)
    np.testing.assert_array_equal(before, env.render())
    for _ in range(8):
        env.step(PUSH)
    assert (env.render() != before).any(axis=2).sum() > 200


def test_cells_are_shown_of_cells_only():
    with pytest.raises(ValueError, match=r'view is .cells.; allowed: top, surface, and cells with terrain "voxel"'):
        DirtPushEnv(view="cells")
    assert DirtPushEnv(view="surface").config.terrain.kind == "heightfield"


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["heap", "several_starts", "several_goals", "uneven", "dig"])
def test_adaptive_push_solves_the_papers_scenes_on_the_papers_cells(scene):
    options = {"level": 0} if scene == "heap" else {}
    env = DirtPushEnv(scene=scene, terrain="voxel", observation={"map": True}, **options)
    summary = play(env, load_policy("adaptive_push", env.config), 0, env.config.steps)
    assert summary["success"] == 1.0
