"""Options of a scene that change nothing where nobody asks for them: traction, soils by name, noise of the senses."""

import copy
from math import atan, degrees, radians, tan

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import dirt_env  # noqa: F401
from dirt_env.config import load
from dirt_env.config.presets import PRESETS
from dirt_env.env import DirtPushEnv
from dirt_env.sim.params import Soil, Traction
from tests.test_vector import assert_same_play

NOISE = {"height": 0.05, "position": 0.2, "heading": 3.0}
FULL = {"soil": {"preset": "loam"}, "traction": {"mass": 6000.0}, "observation": {"noise": NOISE, "map": True}}


def played(steps=12, seed=4, **scene):
    """What an environment returns over a drive with a lowered blade."""
    env = DirtPushEnv(**{"level": 0, **scene})
    returned = [env.reset(seed=seed)]
    for step in range(steps):
        seen, reward, _, _, info = env.step([0.2, 0.9, -0.6 if step > 2 else 0.2])
        returned.append((seen, {**info, "total": reward}))
    return env, returned


# A batch equals single environments


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_batches_with_traction_and_noise_equal_single_environments(mode):
    options = {**FULL, "level": 0, "max_episode_steps": 5}
    one = gymnasium.make_vec("DirtPush-v0", num_envs=3, autoreset_mode=mode, **options)
    vector_kwargs = {"autoreset_mode": mode}
    other = gymnasium.make_vec("DirtPush-v0", 3, "sync", vector_kwargs=vector_kwargs, **options)
    assert assert_same_play(one, other, steps=12, manual=mode == AutoresetMode.DISABLED) > 0


def test_worlds_of_a_batch_may_have_soils_machines_and_noise_of_their_own():
    variants = [
        {"soil": {"preset": "clay"}, "observation": {"noise": {"height": 0.1}}},
        {"traction": {"mass": 2e4}, "observation": {"noise": {"position": 0.5}}},
    ]
    env = gymnasium.make_vec("DirtPush-v0", num_envs=2, level=0, traction={}, variants=variants)
    env.reset(seed=1)
    actions = np.tile(np.float32([0.0, 1.0, 0.0]), (2, 1))
    infos = env.step(actions)[-1]
    singles = [DirtPushEnv(level=0, **{"traction": {}, **variant}) for variant in variants]
    for index, single in enumerate(singles):
        single.reset(seed=1 + index)
        assert single.step(actions[index])[-1]["energy_kj"] == infos["energy_kj"][index]
    assert infos["energy_kj"][0] != infos["energy_kj"][1]


@pytest.mark.parametrize("table", [{"traction": {}}, {"observation": {"noise": {}}}])
def test_worlds_with_and_without_are_not_put_into_one_batch(table):
    with pytest.raises(ValueError, match=r"(traction|observation.noise) True, and world 0 .* False"):
        gymnasium.make_vec("DirtPush-v0", num_envs=2, variants=[{}, table])


# Noise


def test_noise_blurs_what_is_seen_and_nothing_else():
    (plain, clear), (noisy, blurred) = played(), played(observation={"noise": NOISE})
    assert plain.episode.world.height.tobytes() == noisy.episode.world.height.tobytes()
    assert plain.episode.world.machine.tobytes() == noisy.episode.world.machine.tobytes()
    for (exact, told), (seen, said) in zip(clear, blurred, strict=True):
        assert told == said
        assert np.any(exact["patch"] != seen["patch"])
        assert noisy.observation_space.contains(seen)


def test_the_errors_have_the_asked_size_and_are_new_in_every_step():
    env = DirtPushEnv(level=0, observation={"noise": NOISE, "map": True})
    seen, errors, heights = env.reset(seed=0)[0], [], []
    for _ in range(300):
        machine = env.episode.world.machine[0]
        pose = env.read_pose(seen["pose"])
        errors.append([pose["x"] - machine.x + 16, pose["y"] - machine.y + 16, pose["heading"] - machine.heading])
        heights.append(seen["map"][0] - env.episode.world.height)
        seen = env.step([0.0, 0.0, 1.0])[0]
    errors = np.array(errors)
    errors[:, :2] -= np.round(errors[:, :2].mean(axis=0) / 16) * 16  # the pose counts from the site's middle
    errors[:, 2] = (errors[:, 2] + np.pi) % (2 * np.pi) - np.pi
    assert errors.std(axis=0) == pytest.approx([0.2, 0.2, radians(3.0)], rel=0.15)
    assert abs(errors.mean(axis=0)) == pytest.approx(0.0, abs=0.05)
    assert np.std(heights) == pytest.approx(0.05, rel=0.01)
    assert abs(np.corrcoef(heights[0].ravel(), heights[1].ravel())[0, 1]) < 0.1


@pytest.mark.parametrize("error", [0.003, 0.03])
def test_errors_do_not_add_up_to_soil_in_the_overview(error):
    """Half of those of four thousand level cells lie above it, and would be worth a tenth of the heap or more."""
    env = DirtPushEnv(level=1, observation={"noise": {"height": error}, "overview": True})
    seen, _ = env.reset(seed=3)
    soil = []
    for _ in range(20):
        soil.append(seen["overview"][0].sum())
        seen = env.step(np.zeros(3))[0]
    assert np.mean(soil) == pytest.approx(1.0, abs=0.06)


def test_noise_of_size_0_shows_what_there_is():
    (_, clear), (_, blurred) = played(), played(observation={"noise": {}})
    for (exact, _), (seen, _) in zip(clear, blurred, strict=True):
        assert all(exact[name].tobytes() == seen[name].tobytes() for name in exact)


def test_noise_is_the_generators_and_comes_back_with_a_state():
    env, _ = played(observation={"noise": NOISE})
    state, twin = env.get_state(), copy.deepcopy(env)
    first = env.step([0.0, 1.0, 0.0])[0]
    env.set_state(state)
    assert env.step([0.0, 1.0, 0.0])[0]["patch"].tobytes() == first["patch"].tobytes()
    assert twin.step([0.0, 1.0, 0.0])[0]["patch"].tobytes() == first["patch"].tobytes()


def test_without_noise_the_generator_is_only_asked_for_layouts():
    env, _ = played()
    state = env.np_random.bit_generator.state
    env.step([0.0, 1.0, 0.0])
    assert env.np_random.bit_generator.state == state
    bad, _ = played(observation={"noise": NOISE})
    state = bad.np_random.bit_generator.state
    with pytest.raises(ValueError, match="allowed"):
        bad.step([np.nan, 0.0, 0.0])
    assert bad.np_random.bit_generator.state == state


def test_a_masked_reset_shows_the_other_worlds_as_they_were_seen():
    env = gymnasium.make_vec("DirtPush-v0", 2, autoreset_mode="Disabled", level=0, observation=FULL["observation"])
    env.reset(seed=0)
    seen = env.step(np.zeros((2, 3)))[0]
    again = env.reset(options={"reset_mask": np.array([False, True])})[0]
    assert again["patch"][0].tobytes() == seen["patch"][0].tobytes()
    assert again["patch"][1].tobytes() != seen["patch"][1].tobytes()


# Traction in an environment


def test_info_tells_draft_slip_and_energy_and_the_reward_pays_for_the_energy():
    env, returned = played(traction={})
    infos = [info for _, info in returned]
    assert infos[0]["slip"] == infos[0]["energy_kj"] == 0.0
    assert max(info["draft_kn"] for info in infos) > 5.0
    assert max(info["slip"] for info in infos) > 0.0
    assert all(info["energy_kj"] > info["work_kj"] for info in infos[1:])
    spent = 1e3 * (infos[-1]["energy_kj"] - infos[-2]["energy_kj"])
    scale = env.config.soil.density * 9.81 * env.config.soil.friction * env.episode.start.potential
    assert infos[-1]["reward"]["energy"] == pytest.approx(-spent / scale)


def test_without_traction_energy_is_the_work_and_nothing_slips():
    _, returned = played()
    for _, info in returned:
        assert info["energy_kj"] == info["work_kj"]
        assert info["slip"] == 0.0


def test_a_machine_that_is_too_light_for_its_job_says_that_it_stalls():
    _, returned = played(soil={"preset": "clay"}, traction={"mass": 1500.0, "track_width": 0.1}, steps=16)
    info = returned[-1][1]
    assert info["slip"] == 1.0
    assert info["draft_kn"] > 1.0


def test_the_planner_imagines_the_machine_with_its_traction():
    from baselines.pushing.imagine import ImaginedSite

    config = load(level=0, traction={"mass": 5000.0})
    assert ImaginedSite(config)._pull == config.pull
    assert ImaginedSite(load(level=0))._pull is None


# Scenes


@pytest.mark.parametrize("name", PRESETS)
def test_a_soil_by_name_has_its_numbers_and_keys_beside_it_replace_them(name):
    row, config = PRESETS[name], load(soil={"preset": name})
    assert config.soil.slope == pytest.approx(tan(radians(row["repose"])))
    assert (config.soil.density, config.soil.friction) == (row["density"], row["friction"])
    assert degrees(config.strength.internal_friction) == pytest.approx(row["internal_friction"])
    assert config.strength.cohesion == row["cohesion"]
    assert load(config.to_dict()) == config
    other = load(soil={"preset": name, "density": 999.0})
    assert other.soil == config.soil._replace(density=999.0)
    assert other.strength == config.strength


def test_another_soil_replaces_all_of_the_one_below():
    below = load(soil={"repose": 20.0, "cohesion": 7.0}).to_dict()
    assert load(below, soil={"preset": "gravel"}).earth == load(soil={"preset": "gravel"}).earth
    assert load(below, soil={"adhesion": 3.0}).strength.cohesion == 7.0


def test_the_strength_follows_from_the_repose_if_nothing_is_said():
    config = load(soil={"repose": 30.0})
    assert degrees(config.strength.internal_friction) == pytest.approx(30.0)
    assert degrees(config.strength.external_friction) == pytest.approx(20.0)
    assert config.strength.cohesion == config.strength.adhesion == 0.0
    assert load().soil == Soil()
    assert degrees(load().strength.internal_friction) == pytest.approx(degrees(atan(Soil().slope)))


def test_traction_and_noise_are_off_unless_asked_for():
    config = load()
    assert config.traction is config.pull is config.observation.noise is None
    assert load(traction={}).traction == Traction()
    both = load(traction={"power": 5e4, "rake": 75}, observation={"noise": NOISE})
    assert load(both.to_dict()) == both
    assert load(both.to_dict(), traction=None).traction is None


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"soil": {"preset": "mud"}}, r"soil.preset is 'mud'; allowed: \"dry_sand\", .*\"lunar_regolith\""),
        ({"soil": {"preset": 3}}, "soil.preset is 3; allowed"),
        ({"soil": {"preset": "clay", "coheson": 1}}, "soil.coheson is not known, did you mean cohesion"),
        ({"soil": {"cohesion": -1}}, "soil.cohesion is -1; allowed: >= 0 and <= 1e[+]09 Pa"),
        ({"soil": {"internal_friction": 90}}, "soil.internal_friction is 90; allowed: >= 0 and < 90 degrees"),
        ({"soil": {"shear_deformation": 11}}, "soil.shear_deformation is 11; allowed: >= 0 and <= 10 m"),
        ({"traction": {"mass": 0}}, "traction.mass is 0; allowed: > 0 and <= 1e[+]09 kg"),
        ({"traction": {"efficiency": 1.1}}, "traction.efficiency is 1.1; allowed: > 0 and <= 1"),
        ({"traction": {"rake": 5}}, "traction.rake is 5; allowed: >= 10 and <= 120 degrees"),
        ({"traction": True}, "traction is True; allowed: a table"),
        ({"traction": {"weight": 3}}, "traction.weight is not known; known: mass, power"),
        (
            {"traction": {"rake": 110}, "soil": {"internal_friction": 45, "external_friction": 30}},
            r"traction.rake 110, soil.internal_friction 45 and .* make 185; allowed: at most 174.3 together",
        ),
        ({"traction": {}, "terrain": "voxel"}, 'traction is given and terrain is "voxel"; allowed: "heightfield"'),
        ({"observation": {"noise": {"height": -1}}}, "observation.noise.height is -1; allowed: >= 0"),
        ({"observation": {"noise": {"speed": 1}}}, "observation.noise.speed is not known; known: height, position"),
        ({"observation": {"noise": 0.1}}, "observation.noise is 0.1; allowed: a table"),
    ],
    ids=str,
)
def test_what_cannot_be_is_refused_by_name(tables, said):
    with pytest.raises(ValueError, match=said):
        load(**tables)
