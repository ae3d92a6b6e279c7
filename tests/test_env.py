"""`DirtPushEnv` by itself: arguments, actions, lifecycle, determinism, state."""

import copy
import itertools
import json
import os
import pickle
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from dirt_env.env import DirtPushEnv
from dirt_env.snapshot import MAGIC, pack, unpack

EVERYTHING = {"overview": True, "map": True}
SHOVE = {  # a small heap right before a goal, the machine behind it
    "site": {"size": [16.0, 16.0]},
    "start": [{"region": {"kind": "circle", "center": [6.0, 8.0], "radius": 1.5}, "volume": 1.0}],
    "goal": [{"region": {"kind": "rectangle", "center": [11.0, 8.0], "size": [6.0, 6.0]}}],
    "machine": {"pose": [3.0, 8.0, 0.0]},
}
TRACE = """
import hashlib, numpy as np
from dirt_env.env import DirtPushEnv
env = DirtPushEnv(level=2)
digest = hashlib.sha256()
observation, _ = env.reset(seed=7)
rng = np.random.default_rng(7)
for _ in range(60):
    observation, reward, *_ = env.step(rng.uniform(-1, 1, 3))
    digest.update(observation["patch"].tobytes() + observation["pose"].tobytes() + np.float64(reward).tobytes())
print(digest.hexdigest())
"""


def drive(env, steps, seed=0):
    """What a random drive brings: everything that `step` returns, as bytes and plain values."""
    rng = np.random.default_rng(seed)
    return [frozen(env.step(rng.uniform(-1, 1, 3))) for _ in range(steps)]


def frozen(returned):
    """Something that compares by value and to the last bit."""
    observation, *rest = returned
    return {name: array.tobytes() for name, array in observation.items()}, *rest


def into_the_heap(env):
    """Let the machine, set down behind the heap of level 0, dig and push."""
    return [env.step([0.0, 1.0, -0.3]) for _ in range(6)]


def edge_over_target(env):
    """Height of the middle of the edge over the target surface under it [m], where that is level."""
    machine = env.episode.world.machine[0]
    x = machine["x"] + env.config.blade.reach * np.cos(machine["heading"])
    column = int(x / env.config.grid.cell)
    target = env.episode.job.target[int(machine["y"] / env.config.grid.cell), column]
    return machine["z"] + machine["pitch"] * env.config.blade.reach + machine["edge"] - target


# Grade control


@pytest.mark.parametrize(("blade", "height"), [(0.0, 0.0), (-0.4, -0.1), (-1.0, -0.25)])
@pytest.mark.parametrize("x", [3.0, 7.0])
def test_grade_control_holds_the_edge_at_the_target_whatever_the_tracks_stand_on(blade, height, x):
    env = DirtPushEnv(scene=SHOVE, machine={"cut": 2.0}, action={"blade": "grade"})
    env.reset(seed=0, options={"pose": (x, 8.0, 0.0)})  # on the level, and on the heap
    tilted = abs(env.episode.world.machine[0]["pitch"]) > 0.05
    assert tilted == (x == 7.0)
    for _ in range(8):
        env.step([0.0, 0.0, blade * 0.25 / 2.0])
    assert edge_over_target(env) == pytest.approx(height, abs=1e-6)


def test_grade_control_lets_go_as_the_blade_is_lifted():
    env = DirtPushEnv(scene=SHOVE, action={"blade": "grade"})
    env.reset(seed=0, options={"pose": (7.0, 8.0, 0.0)})
    for _ in range(8):
        env.step([0.0, 0.0, 1.0])
    assert env.episode.world.machine[0]["edge"] == env.config.machine.lift


def test_with_grade_control_a_machine_that_drives_over_heaps_does_not_dig():
    deepest = {}
    for blade in ("tracks", "grade"):
        env = DirtPushEnv(scene=SHOVE, action={"blade": blade})
        env.reset(seed=0)
        for _ in range(9):
            env.step([0.0, 1.0, 0.0])
        episode = env.episode
        deepest[blade] = float((episode.job.target - episode.world.height).max())
    assert deepest["grade"] < 0.05
    assert deepest["tracks"] > 2 * deepest["grade"]


# Arguments


def test_unknown_arguments_are_refused_and_the_known_ones_listed():
    with pytest.raises(ValueError, match=r"soi.*known.*soil") as caught:
        DirtPushEnv(soi={"repose": 30})
    assert "observation" in str(caught.value)


def test_an_unknown_argument_is_what_python_calls_one():
    """A TypeError too, in Python's words: TorchRL tries `frameskip` out and goes on without."""
    for make in (lambda: DirtPushEnv(frameskip=1), lambda: gymnasium.make_vec("DirtPush-v0", 2, frameskip=1)):
        with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'"):
            make()


def test_an_unknown_render_mode_is_refused():
    with pytest.raises(ValueError, match="render_mode is 'ansi'; allowed: None, rgb_array, human"):
        DirtPushEnv(render_mode="ansi")


def test_arguments_reach_the_scene():
    env = DirtPushEnv(level=0, soil={"repose": 30}, observation={"size": 48, **EVERYTHING})
    observation, _ = env.reset(seed=0)
    assert env.config.soil.slope == pytest.approx(np.tan(np.radians(30)))
    shapes = {name: array.shape for name, array in observation.items()}
    assert shapes == {"patch": (2, 48, 48), "pose": (15,), "overview": (2, 12, 12), "map": (2, 64, 64)}


def test_size_resolution_and_channels_of_the_patch_are_options():
    """Pixels of two cells show every other cell of the same ground; a channel alone is what it is among all."""
    whole = DirtPushEnv(scene="posts", observation={"size": 32, "ahead": 0.5})
    half = DirtPushEnv(scene="posts", observation={"size": 8, "resolution": 2.0, "ahead": 0.5, "channels": ["todo"]})
    pose = {"pose": (16.25, 15.25, 0.0)}
    seen, wide = (env.reset(seed=0, options=pose)[0]["patch"] for env in (whole, half))
    assert seen.shape == (3, 32, 32)
    assert half.observation_space["patch"].shape == wide.shape == (1, 8, 8)
    assert half.observation_space["patch"].contains(wide)
    assert np.array_equal(wide[0], seen[1, 2::4, 2::4])


def test_only_scenes_that_can_have_obstacles_have_their_channel():
    channels = [DirtPushEnv(level=level).observation_space["patch"].shape[0] for level in range(6)]
    assert channels == [2, 2, 2, 2, 2, 3]


@pytest.mark.parametrize("options", [{"sed": 1}, {"layout_seed": 1, "position": 3}])
def test_unknown_reset_options_are_refused_and_the_known_ones_listed(options):
    with pytest.raises(ValueError, match="is unknown; known: layout_seed, pose"):
        DirtPushEnv().reset(options=options)


@pytest.mark.parametrize("seed", [-1, 0.5, "a", True])
def test_a_layout_seed_is_a_whole_number(seed):
    with pytest.raises(ValueError, match="layout_seed is"):
        DirtPushEnv().reset(options={"layout_seed": seed})


@pytest.mark.parametrize("options", [[1], "pose", 0, {"pose"}])
def test_options_are_a_mapping(options):
    with pytest.raises(ValueError, match=r"reset options are .*; allowed: None or a mapping of layout_seed, pose"):
        DirtPushEnv().reset(options=options)


@pytest.mark.parametrize("pose", ["abc", {"x": 1}, [[1], 2, 3], (10**400, 0, 0), 3])
def test_a_pose_that_is_none_is_refused_by_name(pose):
    with pytest.raises(ValueError, match=r"reset option pose is .*; allowed: x m, y m, heading rad"):
        DirtPushEnv().reset(options={"pose": pose})


@pytest.mark.parametrize("seed", [None, 7])
@pytest.mark.parametrize("options", [{"pose": (-5, 0, 0)}, {"pose": "abc"}, {"sed": 1}, [1]])
def test_a_refused_reset_changes_nothing(options, seed):
    env = DirtPushEnv()
    env.reset(seed=3)
    drive(env, 3)
    before, generator = env.get_state(), env.np_random
    with pytest.raises(ValueError, match=r"allowed|known"):
        env.reset(seed=seed, options=options)
    assert env.get_state() == before
    assert env.np_random is generator


@pytest.mark.parametrize("pose", [(1, 2), (1, 2, np.nan), (-5, 0, 0), (1e9, 0, 0)])
def test_a_pose_that_cannot_be_is_refused(pose):
    with pytest.raises(ValueError, match="allowed"):
        DirtPushEnv().reset(options={"pose": pose})


def test_the_layout_seed_says_which_layout_it_is():
    env = DirtPushEnv()
    env.reset(seed=1, options={"layout_seed": 5})
    first = env.episode.layout.height.copy()
    env.reset(options={"layout_seed": 5})
    assert np.array_equal(env.episode.layout.height, first)
    env.reset()
    assert not np.array_equal(env.episode.layout.height, first)


def test_the_pose_says_where_the_machine_is():
    env = DirtPushEnv()
    observation, _ = env.reset(seed=1, options={"pose": (16.0, 12.0, 0.5)})
    found = env.read_pose(observation["pose"])
    assert [found["x"], found["y"], found["heading"]] == pytest.approx([16.0, 12.0, 0.5], abs=1e-5)


# Actions and lifecycle


@pytest.mark.parametrize(
    "action", [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf], [0, 0], np.zeros((3, 1)), None, "go"]
)
def test_a_bad_action_changes_nothing(action):
    env = DirtPushEnv()
    env.reset(seed=0)
    into_the_heap(env)
    before = env.get_state()
    with pytest.raises(ValueError, match="action"):
        env.step(action)
    assert env.get_state() == before


def test_out_of_range_is_the_same_as_clipped():
    inside, outside = DirtPushEnv(), DirtPushEnv()
    for env in (inside, outside):
        env.reset(seed=3)
    rng = np.random.default_rng(0)
    for action in rng.normal(scale=3, size=(40, 3)):
        assert frozen(outside.step(action)) == frozen(inside.step(np.clip(action, -1, 1)))


def test_lists_and_every_precision_are_taken():
    env = DirtPushEnv()
    action = [0.5, -0.25, 1.0]
    returned = []
    for kind in (list, tuple, np.float32, np.float64):
        env.reset(seed=3)
        returned.append(frozen(env.step(kind(action) if kind in (list, tuple) else np.array(action, kind))))
    assert all(found == returned[0] for found in returned)


def test_step_and_render_before_reset():
    env = DirtPushEnv(render_mode="rgb_array")
    with pytest.raises(ResetNeeded):
        env.step([0, 0, 0])
    with pytest.raises(ResetNeeded):
        env.render()


def test_close_before_reset_and_twice():
    env = DirtPushEnv(render_mode="human")
    env.close()
    env.reset(seed=0)
    env.close()
    env.close()


def test_success_terminates_and_stepping_on_does_not_crash():
    env = DirtPushEnv(scene=SHOVE, task={"success": 0.05})
    env.reset(seed=0)
    steps = []
    for _ in range(14):
        steps.append(env.step([0.0, 0.5, -0.1]))
        if steps[-1][2]:
            break
    _, _, terminated, truncated, info = steps[-1]
    assert terminated is True
    assert truncated is False
    assert info["is_success"] is True
    assert info["share_in_goal"] >= 0.05
    assert info["reward"]["success"] == 1.0
    assert not any(step[2] for step in steps[:-1])
    observation, _, terminated, _, info = env.step([0.0, -0.1, 1.0])
    assert terminated
    assert info["reward"]["success"] == 0.0
    assert env.observation_space.contains(observation)


def test_the_base_environment_never_truncates():
    env = DirtPushEnv()
    env.reset(seed=0)
    assert not any(env.step([0, 0, 1])[3] for _ in range(700))


@pytest.mark.parametrize(("steps", "truncated"), [(3, True), (-1, False)])
def test_max_episode_steps_is_honoured(steps, truncated):
    env = gymnasium.make("DirtPush-v0", max_episode_steps=steps)
    env.reset(seed=0)
    assert [env.step(np.array([0, 0, 1], np.float32))[3] for _ in range(3)] == [False, False, truncated]


def test_types_are_pythons_own():
    env = DirtPushEnv()
    observation, info = env.reset(seed=0)
    assert json.loads(json.dumps(info)) == info
    observation, reward, terminated, truncated, info = env.step([0, 1, 0])
    assert [type(value) for value in (reward, terminated, truncated)] == [float, bool, bool]
    assert json.loads(json.dumps(info)) == info
    assert {array.dtype for array in observation.values()} == {np.dtype(np.float32)}


def test_the_reward_is_the_weighted_sum_of_its_terms():
    weights = {"work": 3.0, "energy": 0.5, "time": 0.25, "spill": 2.0, "success": 4.0}
    env = DirtPushEnv(level=0, reward=weights)
    env.reset(seed=0)
    for _, reward, _, _, info in into_the_heap(env):
        assert reward == pytest.approx(sum(weight * info["reward"][name] for name, weight in weights.items()))


def test_pushing_the_heap_to_the_goal_is_rewarded():
    env = DirtPushEnv(scene=SHOVE)
    env.reset(seed=0)
    steps = [env.step([0.0, 0.5, -0.1]) for _ in range(12)]
    assert sum(info["reward"]["work"] for *_, info in steps) > 0.1
    assert steps[-1][-1]["work_kj"] > 0


def test_info_adds_up():
    env = DirtPushEnv(level=0)
    env.reset(seed=0)
    info = into_the_heap(env)[-1][-1]
    assert info["time_s"] == 3.0
    assert 0 < info["distance_m"] <= 6.0
    assert info["lost_m3"] == 0.0
    assert info["misplaced_m3"] > 0


def test_draft_is_the_work_of_the_step_over_its_distance():
    env = DirtPushEnv(level=0)
    env.reset(seed=0)
    infos = [info for *_, info in into_the_heap(env)]
    for before, after in itertools.pairwise(infos):
        work, distance = (after[name] - before[name] for name in ("work_kj", "distance_m"))
        assert after["draft_kn"] == pytest.approx(work / distance if distance else 0.0)
    assert max(info["draft_kn"] for info in infos) > 0


def test_blocked_is_the_share_of_the_step_that_a_wall_held_the_machine():
    env = DirtPushEnv(scene=SHOVE)
    env.reset(seed=0, options={"pose": (3.0, 3.0, np.pi)})
    found = [env.step([0.0, 1.0, 1.0])[-1]["blocked"] for _ in range(6)]
    assert env.step([0.0, -1.0, 1.0])[-1]["blocked"] == 0.0
    assert found[-1] == pytest.approx(1.0)


def test_soil_lost_over_an_open_border_is_spilled():
    env = DirtPushEnv(scene=SHOVE, site={"border": "open"})
    env.reset(seed=0)
    for _ in range(16):
        info = env.step([0.0, 1.0, -0.1])[-1]
    episode = env.episode
    assert info["lost_m3"] > 0
    assert info["spilled_m3"] == max(0.0, episode.remaining.stray - episode.start.stray) + info["lost_m3"]


def test_the_time_left_falls_by_a_period_each_step():
    env = DirtPushEnv(task={"time": 5.0})
    observations = [env.reset(seed=0)[0], *(env.step([0, 0, 1])[0] for _ in range(12))]
    found = [env.read_pose(observation["pose"])["time_left"] for observation in observations]
    share = env.config.task.period / 5.0
    assert found == pytest.approx([max(0.0, 1.0 - share * step) for step in range(13)], abs=1e-6)


def test_no_memory_is_shared_between_returns():
    env = DirtPushEnv(observation=EVERYTHING, render_mode="rgb_array")
    returned = [env.reset(seed=0)[0], *(env.step([0, 1, 0])[0] for _ in range(2))]
    kept = copy.deepcopy(returned[1])
    arrays = [array for observation in returned for array in observation.values()]
    arrays += [env.render(), env.render(), env.episode.world.height]
    for i, one in enumerate(arrays):
        assert not any(np.shares_memory(one, other) for other in arrays[:i])
    assert all(np.array_equal(kept[name], returned[1][name]) for name in kept)


@pytest.mark.parametrize(
    "options", [{"level": 2}, {"level": 5, "observation": EVERYTHING}, {"site": {"border": "open"}}]
)
def test_observations_stay_inside_the_space(options):
    """Random, extreme and stubborn actions, on several layouts."""
    env = DirtPushEnv(**options)
    rng = np.random.default_rng(0)
    for seed in range(4):
        observation, _ = env.reset(seed=seed)
        action = np.zeros(3)
        for step in range(850):
            if step % 5 == 0:
                action = rng.choice([rng.uniform(-1, 1, 3), rng.choice([-1, 0, 1], 3), rng.normal(scale=1e6, size=3)])
            assert env.observation_space.contains(observation)
            observation, reward, *_ = env.step(action)
            assert np.isfinite(reward)


# Determinism and state


def test_same_seed_same_bits():
    one, other = DirtPushEnv(level=3), DirtPushEnv(level=3)
    assert frozen(one.reset(seed=5)) == frozen(other.reset(seed=5))
    assert drive(one, 80) == drive(other, 80)


def test_another_seed_is_another_episode():
    env = DirtPushEnv()
    assert frozen(env.reset(seed=5)) != frozen(env.reset(seed=6))


@pytest.mark.slow
def test_same_bits_in_other_processes_with_other_hash_seeds():
    found = set()
    for hash_seed in ("0", "1", "random"):
        environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
        done = subprocess.run(
            [sys.executable, "-c", TRACE], env=environment, capture_output=True, text=True, check=True, timeout=300
        )
        found.add(done.stdout)
    assert len(found) == 1


def test_global_random_numbers_change_nothing():
    one, other = DirtPushEnv(), DirtPushEnv()
    np.random.seed(0)  # noqa: NPY002
    first = frozen(one.reset(seed=5)), drive(one, 20)
    np.random.seed(1)  # noqa: NPY002
    np.random.random(10)  # noqa: NPY002
    assert (frozen(other.reset(seed=5)), drive(other, 20)) == first


def test_reset_after_a_dirty_episode_equals_a_fresh_environment():
    dirty, fresh = DirtPushEnv(level=2), DirtPushEnv(level=2)
    dirty.reset(seed=1)
    drive(dirty, 100)
    assert frozen(dirty.reset(seed=9)) == frozen(fresh.reset(seed=9))
    assert drive(dirty, 60) == drive(fresh, 60)
    assert frozen(dirty.reset()) == frozen(fresh.reset())


@pytest.mark.parametrize("options", [{"level": 2}, {"level": 5}, {"site": {"border": "open"}}, {"scene": "pad"}])
def test_a_state_goes_round_to_the_last_byte_and_replays(options):
    env, other = DirtPushEnv(**options), DirtPushEnv(**options)
    env.reset(seed=4)
    drive(env, 30)
    state = env.get_state()
    expected = drive(env, 40), frozen(env.reset()), drive(env, 5)
    for player in (env, other):
        player.set_state(state)
        assert player.get_state() == state
        assert (drive(player, 40), frozen(player.reset()), drive(player, 5)) == expected


def test_a_state_of_another_scene_is_refused():
    env = DirtPushEnv()
    env.reset(seed=0)
    with pytest.raises(ValueError, match="differently configured"):
        DirtPushEnv(soil={"repose": 30}).set_state(env.get_state())


@pytest.mark.parametrize("damage", [lambda s: b"", lambda s: s[:50], lambda s: s[:-1000], lambda s: b"x" + s, str, len])
def test_a_damaged_state_is_refused_and_changes_nothing(damage):
    env = DirtPushEnv()
    env.reset(seed=0)
    state = env.get_state()
    with pytest.raises(ValueError, match="state"):
        env.set_state(damage(state))
    assert env.get_state() == state


def test_any_flipped_or_trailing_byte_is_damage():
    env = DirtPushEnv()
    env.reset(seed=0)
    state = env.get_state()
    for place in [0, len(MAGIC), len(MAGIC) + 32, *range(100, len(state), len(state) // 40), len(state) - 1]:
        damaged = bytearray(state)
        damaged[place] ^= 1
        with pytest.raises(ValueError, match="state is damaged"):
            env.set_state(bytes(damaged))
    with pytest.raises(ValueError, match="state is damaged"):
        env.set_state(state + b"x")
    assert env.get_state() == state


FORGED = {  # what becomes of a part of the state, and a word of the complaint; None takes the part away
    ("config",): (None, "differently configured"),
    ("generator",): ({"bit_generator": "PCG64"}, "state.generator"),
    ("generator", "bit_generator"): ("MT19937", "state.generator"),
    ("seed",): ("a", "state.seed"),
    ("episode",): ([1], "state.episode"),
    ("episode", "job"): (None, "state.episode is a table"),
    ("episode", "layout", "pose"): ([1.0, 2.0], "layout.pose"),
    ("episode", "layout", "design"): (3, "layout.design"),
    ("episode", "layout", "solid"): (np.zeros((64, 64), bool), "layout.solid"),
    ("episode", "world", "height"): (np.zeros((64, 63), np.float32), "world.height"),
    ("episode", "world", "tally"): (np.zeros(1), "world.tally"),
    ("episode", "world", "outside"): (np.zeros((64, 64), np.float32), "world.outside"),
    ("episode", "world", "changed"): (np.array([0, 64, 0, 65]), "window changed"),
    ("episode", "world", "pending"): (np.array([-1, 64, 0, 64]), "window pending"),
    ("episode", "world", "quantum"): (0.0, "quantum"),
    ("episode", "job", "target"): (np.zeros((64, 64)), "job.target"),
    ("episode", "job", "centers"): (np.zeros((0, 2)), "job.centers"),
    ("episode", "job", "soil"): (float("nan"), "job.soil"),
    ("episode", "start", "potential"): (True, "start.potential"),
    ("episode", "totals", "steps"): (1.5, "totals.steps"),
    ("episode", "totals", "more"): (1, "state.episode.totals"),
}


@pytest.mark.parametrize("path", FORGED, ids=".".join)
def test_a_forged_state_is_refused_and_changes_nothing(path):
    """The checksum is right, what it covers is not."""
    value, complaint = FORGED[path]
    refuse(path, lambda parent: parent.pop(path[-1]) if value is None else parent.update({path[-1]: value}), complaint)


@pytest.mark.parametrize(("name", "kind"), [("height", "f4"), ("machine", "f8")])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_state_with_numbers_that_are_not_finite_is_refused(name, kind, value):
    refuse(("episode", "world", name), lambda world: world[name].view(kind).fill(value), f"world.{name} is")


def test_a_state_with_the_machine_off_the_site_is_refused():
    refuse(("episode", "world", "machine"), lambda world: world["machine"]["x"].fill(1e9), "the machine at x 1e")


def refuse(path, forge, complaint):
    """A state in which `forge` has changed the table that holds the path's last part is refused, with the complaint."""
    env = DirtPushEnv()
    env.reset(seed=0)
    state = env.get_state()
    tree = parent = unpack(state)
    for name in path[:-1]:
        parent = parent[name]
    forge(parent)
    with pytest.raises(ValueError, match=complaint):
        env.set_state(pack(tree))
    assert env.get_state() == state


@pytest.mark.parametrize("copy_of", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("mode", [None, "rgb_array", "human"])
def test_a_copy_in_mid_episode_goes_on_identically(copy_of, mode):
    env = DirtPushEnv(render_mode=mode)
    env.reset(seed=2)
    drive(env, 3)
    env.render() if mode else None
    twin = copy_of(env)
    assert drive(twin, 5) == drive(env, 5)
    assert frozen(twin.reset()) == frozen(env.reset())
    twin.close()
    env.close()


def test_the_episode_of_a_copy_is_its_own():
    env = DirtPushEnv()
    env.reset(seed=2)
    state = env.get_state()
    drive(copy.deepcopy(env), 10)
    assert env.get_state() == state


# Pictures


def test_rgb_array_is_a_picture_of_now():
    env = DirtPushEnv(level=0, render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    assert first.dtype == np.uint8
    assert first.ndim == 3
    assert first.shape[2] == 3
    assert np.array_equal(env.render(), first)
    into_the_heap(env)
    assert not np.array_equal(env.render(), first)


def test_the_picture_of_a_second_episode_shows_its_own_goal():
    env, fresh = (DirtPushEnv(level=2, render_mode="rgb_array") for _ in range(2))
    env.reset(seed=0)
    env.render()
    env.reset(seed=1)
    fresh.reset(seed=1)
    assert np.array_equal(env.render(), fresh.render())


def test_rendering_changes_nothing():
    seen, unseen = DirtPushEnv(render_mode="rgb_array"), DirtPushEnv()
    for env in (seen, unseen):
        env.reset(seed=0)
    seen.render()
    assert drive(seen, 10) == drive(unseen, 10)


@pytest.mark.parametrize(("limit", "blade"), [(0.5, 1.0), (6.0, 1.0), (0.5, 3.0)])
def test_heights_in_the_observation_end_at_the_limit_of_the_scene(limit, blade):
    env = DirtPushEnv(observation={"height_limit": limit}, blade={"height": blade})
    observation, _ = env.reset(seed=1)
    assert env.observation_space["patch"].high.max() == limit
    assert env.observation_space.contains(observation)
