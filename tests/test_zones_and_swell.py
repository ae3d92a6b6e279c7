"""Soils by region and swell in scenes, episodes and batches: off unless asked for, and true to their numbers."""

import copy
import re
import tomllib
from math import radians, tan
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import dirt_env  # noqa: F401
from baselines.pushing.imagine import ImaginedSite
from baselines.pushing.site import Site
from dirt_env.config import layout, load
from dirt_env.config.presets import PRESETS
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy
from dirt_env.rollout import REPORTED
from tests.test_vector import assert_same_play

EAST = {"kind": "rectangle", "center": [24.0, 16.0], "size": [16.0, 32.0]}
STRIP = {"kind": "rectangle", "center": [16.0, 16.0], "size": [4.0, 32.0]}
OWN = [{"region": EAST}, {"region": STRIP}]
FULL = {"soil": {"preset": "loam", "swell": 0.25}, "traction": {}, "zone": [{"region": EAST, "preset": "clay"}]}


def played(steps=15, seed=4, **scene):
    """What an environment returns over a drive with a lowered blade."""
    env = DirtPushEnv(**{"level": 0, **scene})
    returned = [env.reset(seed=seed)]
    for step in range(steps):
        seen, reward, _, _, info = env.step([0.2, 0.9, -0.6 if step > 2 else 0.2])
        returned.append((seen, {**info, "total": reward}))
    return env, returned


def assert_same(one, other):
    for (seen, told), (looked, said) in zip(one, other, strict=True):
        assert told == said
        assert all(seen[name].tobytes() == looked[name].tobytes() for name in seen)


# Off unless asked for


@pytest.mark.slow
def test_zones_of_the_scenes_own_soil_change_nothing_to_the_last_bit():
    (plain, one), (zoned, other) = (played(traction={}, zone=zones) for zones in ([], OWN))
    assert zoned.episode.layout.zone.max() == 2
    assert plain.episode.layout.zone is None
    assert_same(one, other)


def test_a_scene_without_swell_has_no_maps_of_bank_soil():
    assert load(soil={"swell": 0.0}) == load()
    env, _ = played(steps=0)
    assert env._worlds.batch.bank is env._worlds.batch.natural is env.episode.world.bank is None


def test_without_swell_bank_and_loose_soil_are_the_same():
    _, returned = played()
    assert all(info["loose_moved_m3"] == info["volume_moved_m3"] for _, info in returned)
    assert "loose_moved_m3" in REPORTED


# Batches, states, copies


@pytest.mark.slow
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED])
def test_batches_equal_single_environments(mode):
    options = {**FULL, "level": 0, "max_episode_steps": 6}
    one = gymnasium.make_vec("DirtPush-v0", num_envs=3, autoreset_mode=mode, **options)
    other = gymnasium.make_vec("DirtPush-v0", 3, "sync", vector_kwargs={"autoreset_mode": mode}, **options)
    assert assert_same_play(one, other, steps=12, manual=mode == AutoresetMode.DISABLED) > 0


def test_worlds_of_a_batch_may_have_other_zones():
    variants = [{"zone": [{"region": EAST, "density": 900.0}], "traction": {}}, {"zone": OWN, "traction": {}}]
    env = gymnasium.make_vec("DirtPush-v0", num_envs=2, level=0, variants=variants)
    env.reset(seed=1)
    actions = np.tile(np.float32([0.0, 1.0, -0.3]), (2, 1))
    for _ in range(4):
        env.step(actions)
    for index, variant in enumerate(variants):
        single = DirtPushEnv(level=0, **variant)
        single.reset(seed=1 + index)
        for _ in range(4):
            single.step(actions[index])
        assert single.episode.world.height.tobytes() == env._worlds.batch.height[index].tobytes()


@pytest.mark.parametrize("table", [{"zone": [{"region": EAST}]}, {"soil": {"swell": 0.1}}])
def test_worlds_with_and_without_are_not_put_into_one_batch(table):
    with pytest.raises(ValueError, match=r"(zones|soil.swell) True, and world 0 .* False"):
        gymnasium.make_vec("DirtPush-v0", num_envs=2, variants=[{}, table])


def test_states_and_copies_go_on_identically():
    env, _ = played(**FULL)
    state, twin = env.get_state(), copy.deepcopy(env)
    fresh = DirtPushEnv(level=0, **FULL)
    fresh.set_state(state)
    assert fresh.get_state() == state
    for other in (twin, fresh):
        assert_same([env.step([0.1, 1.0, -0.5])[::4]], [other.step([0.1, 1.0, -0.5])[::4]])
        env.set_state(state)
    batch = env._worlds.batch
    assert (batch.natural - batch.bank).max() > 0.05


def test_a_state_with_a_zone_that_does_not_exist_is_refused():
    env, _ = played(steps=0, **FULL)
    for number in (2, -1):
        env.episode.layout.zone[5, 5] = number
        with pytest.raises(ValueError, match=r"state has zones with the numbers .*; allowed: 0 to 1"):
            env.read_state(env.get_state())


# What they do


def test_a_hard_strip_beside_soft_ground_has_another_draft():
    scene = {"scene": "dig", "machine": {"pose": [12.0, 16.0, 0.0]}, "traction": {}}
    soft, hard = load(**scene).pull, load(**scene, soil={"cohesion": 2e4}).pull
    drafts = {}
    for name, zones in (("plain", []), ("strip", [{"region": STRIP, "cohesion": 2e4}])):
        env = DirtPushEnv(**scene, zone=zones)
        env.reset(seed=0)
        infos = [env.step([0.0, 0.2, -0.6])[-1]["draft_kn"] for _ in range(20)]
        drafts[name] = max(infos[2:])
    assert drafts["strip"] > drafts["plain"] + 5.0
    assert hard.hold > soft.hold == 0.0


def test_the_whole_of_a_pit_in_the_goal_is_all_of_its_soil_and_more_room():
    env = DirtPushEnv(scene="dig", soil={"swell": 0.25})
    _, info = env.reset(seed=0)
    episode, cell = env.episode, env.config.grid.cell
    assert episode.job.soil == pytest.approx(episode.layout.soil) == pytest.approx(info["misplaced_m3"])
    world, goal = episode.world, episode.layout.goal
    depth = np.maximum(world.height - episode.job.target, 0.0) * ~goal
    for part in (world.height, world.bank):
        part -= depth
    world.height[goal] += np.float32(1.25 * depth.sum() / goal.sum())
    world.changed[:] = 0, *world.height.shape[:1], 0, world.height.shape[1]
    info = env.step([0.0, 0.0, 1.0])[-1]
    assert info["share_in_goal"] == pytest.approx(1.0, abs=1e-4)
    assert info["volume_moved_m3"] == pytest.approx(episode.layout.soil, rel=1e-4)
    assert info["loose_moved_m3"] == pytest.approx(1.25 * episode.layout.soil, rel=1e-4)
    assert info["loose_moved_m3"] == pytest.approx(1.25 * depth.sum() * cell**2, rel=1e-4)
    assert info["misplaced_m3"] == pytest.approx(0.0, abs=1e-3)


def test_loosening_is_no_setback():
    """The potential goes by mass: soil that is cut and lies where it was is as far from done as before."""
    env = DirtPushEnv(scene="dig", soil={"swell": 0.25})
    env.reset(seed=0)
    world, start = env.episode.world, env.episode.start
    pit = world.height > env.episode.job.target + 0.1
    world.bank[pit] -= np.float32(2.0**-4)
    world.height[pit] += np.float32(2.0**-6)
    world.changed[:] = 0, world.height.shape[0], 0, world.height.shape[1]
    info = env.step([0.0, 0.0, 1.0])[-1]
    assert info["misplaced_m3"] == pytest.approx(start.misplaced, rel=1e-3)
    assert info["reward"]["work"] == pytest.approx(0.0, abs=1e-3)


def test_a_heap_is_loose_from_the_start():
    env = DirtPushEnv(level=0, soil={"swell": 0.25})
    _, info = env.reset(seed=4)
    assert info["misplaced_m3"] == pytest.approx(env.episode.layout.soil / 1.25, rel=1e-3)
    world = env.episode.world
    assert world.bank.max() == 0.0 < world.height.max()


@pytest.mark.parametrize("scene", [{"level": 0}, {"scene": "dig"}], ids=["random layout", "fixed scene"])
def test_the_planner_imagines_zones_as_they_are(scene):
    """Across a strip of heavy, cohesive ground, with traction, the copy goes as the real machine does."""
    config = load(**scene)
    x, y = 16.0, 16.0
    strip = {"kind": "rectangle", "center": [x + 4.0, y], "size": [6.0, 20.0]}
    zones = [{"region": strip, "repose": 20.0, "cohesion": 2e4, "density": 2200.0}]
    if config.layout is None:
        scene = {**scene, "machine": {"pose": [x - 6.0, y, 0.0]}}
    env = DirtPushEnv(**scene, traction={}, zone=zones, observation={"map": True})
    options = {"pose": (x - 6.0, y, 0.0)} if config.layout is not None else None
    observation, _ = env.reset(seed=4, options=options)
    site, copy, plain = Site(env.config), ImaginedSite(env.config), ImaginedSite(load(**scene, traction={}))
    site.see(observation)
    copy.copy(site)
    plain.copy(site)
    for step in range(40):
        action = np.array([0.1, 0.8, -0.4 if step > 1 else 0.0], np.float32)
        observation, *_ = env.step(action)
        copy.step(action)
        plain.step(action)
    site.see(observation)
    for name, tolerance in (("x", 5e-3), ("y", 5e-3), ("heading", 5e-3), ("edge", 5e-3), ("load", 0.02)):
        assert copy.pose[name] == pytest.approx(site.pose[name], abs=tolerance), name
    assert np.abs(copy.height - site.height).mean() < 1e-3
    assert np.hypot(plain.pose["x"] - site.pose["x"], plain.pose["y"] - site.pose["y"]) > 0.1, "the zone matters"


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ({"soil": {"swell": 0.25}}, "soil.swell is 0.25; allowed for the planner: 0"),
        (
            {"scene": "posts", "vary": {"shift": [1.0, 1.0]}, "zone": [{"region": {**STRIP, "size": [4.0, 8.0]}}]},
            r"zone has 1 and the scene has \[vary\]; allowed for the planner: zones without vary",
        ),
    ],
)
def test_the_planner_refuses_soil_that_a_map_does_not_show(scene, said):
    config = load(**scene)
    with pytest.raises(ValueError, match=said):
        load_policy("planner", config)


def test_the_planner_takes_scenes_that_vary_without_zones():
    assert ImaginedSite(load("layers", level=1))._zones is None


# Scenes


def test_a_zone_has_what_is_said_of_it_and_the_rest_from_the_scene():
    base = {"repose": 30.0, "cohesion": 500.0, "density": 1234.0, "swell": 0.1}
    zones = [{"region": EAST, "adhesion": 7.0}, {"region": STRIP, "preset": "clay", "density": 9}]
    config = load(soil=base, zone=zones)
    assert load(config.to_dict()) == config
    own, east, strip = config.soils
    assert own == config.earth
    assert east.soil == own.soil
    assert east.strength == own.strength._replace(adhesion=7.0)
    assert strip.soil == own.soil._replace(slope=tan(radians(33.0)), density=9.0, friction=0.65)
    assert strip.strength.cohesion == PRESETS["clay"]["cohesion"]


def test_the_later_of_two_zones_counts_and_zones_shift_and_mirror_with_the_scene():
    drawn = layout(load(zone=OWN), np.random.default_rng(0)).zone
    assert [drawn[3, c] for c in (10, 30, 34, 38, 60)] == [0, 2, 2, 1, 1]
    post = {"kind": "post", "center": [26.0, 6.0], "radius": 1.0}
    scene = {"scene": "posts", "vary": {"shift": [3.0, 3.0]}, "obstacle": [post]}
    scene["zone"] = [{"region": {"kind": "circle", "center": [26.0, 6.0], "radius": 1.0}}]
    config = load(**scene)
    for seed in range(6):
        found = layout(config, np.random.default_rng(seed))
        np.testing.assert_array_equal(found.zone == 1, found.solid)


def test_repose_of_a_zone_is_that_of_the_ground_at_the_start():
    mound = {"kind": "circle", "center": [24.0, 16.0], "radius": 6.0}
    scene = {"start": [{"region": mound, "volume": 10.0}], "goal": [{"region": {**mound, "center": [8, 16]}}]}
    env = DirtPushEnv(scene=scene, zone=[{"region": EAST, "repose": 15.0}], traction={})
    env.reset(seed=0)
    height = env.episode.world.height[32, 33:]
    assert np.abs(np.diff(height)).max() == pytest.approx(0.5 * tan(radians(15.0)), rel=0.01)


def test_the_manuals_example_runs():
    manual = (Path(__file__).parents[1] / "docs" / "scenes.md").read_text(encoding="utf-8")
    section = manual.split("### `[[zone]]`")[1]
    scene = tomllib.loads(re.search(r"```toml\n(.*?)```", section, re.DOTALL)[1])
    env = DirtPushEnv(scene=scene)
    env.reset(seed=0)
    drafts = [env.step([0.0, 0.3, -0.3])[-1]["draft_kn"] for _ in range(12)]
    assert max(drafts) > 3.0
    assert env.episode.layout.zone.any()
    assert env.config.soil.swell == 0.25


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"soil": {"swell": -0.1}}, "soil.swell is -0.1; allowed: >= 0 and <= 2"),
        ({"zone": [{}]}, r"zone\[0\].region is missing; needed: region"),
        ({"zone": [{"region": EAST}, {"region": EAST, "swell": 0.2}]}, r"zone\[1\].swell is not known; known: region"),
        ({"zone": [{"region": EAST, "cohesion": -1}]}, r"zone\[0\].cohesion is -1; allowed: >= 0"),
        ({"zone": [{"region": EAST, "preset": "mud"}]}, r"zone\[0\].preset is 'mud'; allowed: \"dry_sand\""),
        ({"zone": {"region": EAST}}, r"zone is .*; allowed: an array of tables, \[\[zone\]\]"),
        ({"zone": [{"region": {**EAST, "center": [30, 16]}}]}, r"zone\[0\].region reaches from x = 22 to 38 m"),
        ({"zone": [{"region": EAST}] * 101}, "the scene has 101 zones; allowed: at most 100"),
        ({"zone": [{"region": EAST}] * 128}, "the scene has 128 zones; allowed: at most 100"),
        ({"zone": [{"region": EAST}], "terrain": "voxel"}, 'zone is given and terrain is "voxel"; allowed: "heightf'),
        ({"soil": {"swell": 0.1}, "terrain": "voxel"}, 'soil.swell is given and terrain is "voxel"; allowed: "heightf'),
        (
            {"ground": {"kind": "ridge", "height": 0.5}, "zone": [{"region": EAST, "repose": 5}]},
            "ground is as steep as 0.196; allowed: at most 0.087, the slope of soil.repose or of the gentlest zone",
        ),
        (
            {"traction": {"rake": 110}, "zone": [{"region": EAST, "internal_friction": 60}]},
            r"traction.rake 110, zone\[0\].internal_friction 60 and zone\[0\].external_friction",
        ),
        (
            {
                "scene": "posts",
                "vary": {"shift": [3.0, 3.0]},
                "zone": [{"region": EAST}],
            },
            r"zone\[0\].region, shifted as far as it may be, reaches",
        ),
    ],
    ids=str,
)
def test_what_cannot_be_is_refused_by_name(tables, said):
    with pytest.raises(ValueError, match=said):
        load(**tables)
