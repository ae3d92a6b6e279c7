"""The native batch: equal to `SyncVectorEnv` to the last bit, and what it has beyond that."""

import copy
import multiprocessing
import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from hypothesis import given, settings
from hypothesis import strategies as st

import dirt_env  # noqa: F401
from dirt_env.env import DirtPushEnv
from dirt_env.task.step import MANY

QUICK = {  # a small heap right before a goal, the machine behind it: some worlds are done after a few pushes
    "scene": {
        "site": {"size": [16.0, 16.0]},
        "start": [{"region": {"kind": "circle", "center": [6.0, 8.0], "radius": 1.5}, "volume": [0.9, 1.1]}],
        "goal": [{"region": {"kind": "rectangle", "center": [11.0, 8.0], "size": [6.0, 6.0]}}],
        "machine": {"pose": [3.0, 8.0, 0.0]},
        "task": {"success": 0.05},
    }
}
MODES = list(AutoresetMode)
SCENES = [
    QUICK,
    {"level": 5},
    {"level": 1, "observation": {"overview": True, "map": True}},
    {"level": 1, "site": {"border": "open"}},
    {"scene": "pad"},
    {"scene": "dig"},
    {"scene": "several_goals"},
]
EQUAL_STEPS = 18


def native(count=4, **options):
    return gymnasium.make_vec("DirtPush-v0", num_envs=count, **options)


def sync(count=4, autoreset_mode=AutoresetMode.NEXT_STEP, **options):
    return gymnasium.make_vec("DirtPush-v0", count, "sync", vector_kwargs={"autoreset_mode": autoreset_mode}, **options)


def actions(count, steps, seed=0):
    """Pushes that wander: some worlds get on with the job, others do not."""
    rng = np.random.default_rng(seed)
    wander = rng.uniform(-1, 1, (steps, count, 3)) * [0.1, 0.3, 0.1]
    return (wander + np.array([0.0, 0.7, -0.1])).astype(np.float32)


def assert_equal(found, expected, place=""):
    """The same structure, types, shapes and bits; where it differs is said."""
    assert type(found) is type(expected), place
    if isinstance(expected, dict):
        assert set(found) == set(expected), place
        for name in expected:
            assert_equal(found[name], expected[name], f"{place}.{name}")
    elif isinstance(expected, tuple):
        assert len(found) == len(expected), place
        for index, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_equal(one, other, f"{place}[{index}]")
    elif isinstance(expected, np.ndarray) and expected.dtype == object:
        assert found.dtype == object, place
        assert_equal(tuple(found), tuple(expected), place)
    elif isinstance(expected, np.ndarray):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape), place
        assert found.tobytes() == expected.tobytes(), place
    else:
        assert found == expected, place


def assert_same_play(one, other, steps=EQUAL_STEPS, seed=3, manual=False):
    """Both return the same from a reset and from every step; returns how many episodes ended."""
    assert_equal(one.reset(seed=seed), other.reset(seed=seed), "reset")
    ends = 0
    for step, action in enumerate(actions(one.num_envs, steps)):
        found, expected = one.step(action), other.step(action)
        assert_equal(found, expected, f"step {step}")
        ended = found[2] | found[3]
        ends += int(ended.sum())
        if manual and ended.any():
            masks = [{"reset_mask": ended.copy()} for _ in range(2)]
            assert_equal(one.reset(options=masks[0]), other.reset(options=masks[1]), f"reset after step {step}")
    return ends


# Equal to SyncVectorEnv


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("limit", [5, -1, None])
def test_it_equals_the_generic_one_in_every_autoreset_mode(mode, limit):
    options = {**QUICK, "max_episode_steps": limit, "autoreset_mode": mode}
    ends = assert_same_play(native(**options), sync(**options), manual=mode == AutoresetMode.DISABLED)
    assert ends > 0


@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_it_equals_the_generic_one_in_every_kind_of_scene(scene):
    options = {**scene, "max_episode_steps": 9}
    assert assert_same_play(native(3, **options), sync(3, **options)) > 0


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
def test_any_number_of_threads_gives_the_same(threads):
    options = {**QUICK, "max_episode_steps": 6, "autoreset_mode": "SameStep"}
    with_threads, with_one = native(70, threads=threads, **options), native(70, threads=1, **options)
    assert assert_same_play(with_threads, with_one, steps=8) >= 70
    with_threads.close()


def test_worlds_of_a_large_batch_do_what_those_of_a_small_one_do():
    large, small = native(MANY, info="none", **QUICK), native(4, info="none", **QUICK)
    last = np.arange(MANY)[-4:]
    large.reset(seed=range(MANY))
    small.reset(seed=last.tolist())
    for action in actions(MANY, 6):
        seen, reward, *_ = large.step(action)
        expected, expected_reward, *_ = small.step(action[last])
        assert_equal({name: part[last] for name, part in seen.items()}, expected)
        np.testing.assert_array_equal(reward[last], expected_reward)


@settings(max_examples=8, deadline=None)
@given(data=st.data())
def test_any_play_equals_the_generic_one(data):
    """Any mode, limit, soil, kind of scene and action, bold ones too, with resets in between."""
    scene = data.draw(st.sampled_from(SCENES))
    options = {
        **scene,
        "soil": {"repose": data.draw(st.floats(25, 40))},
        "max_episode_steps": data.draw(st.sampled_from([1, 3, 7, -1])),
        "autoreset_mode": data.draw(st.sampled_from(MODES[:2])),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a goal may be too small for flat soil
        one, other = native(2, threads=data.draw(st.sampled_from([1, 2])), **options), sync(2, **options)
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    seed = data.draw(st.sampled_from([None, 4, [7, None]]))
    if seed != 4:
        assert_equal(one.reset(seed=4), other.reset(seed=4))
    options = data.draw(st.sampled_from([None, {"layout_seed": 5}]))
    assert_equal(one.reset(seed=seed, options=options), other.reset(seed=seed, options=options))
    for _ in range(data.draw(st.integers(1, 9))):
        action = rng.normal(scale=1.5, size=(2, 3))
        assert_equal(one.step(action), other.step(action))


@pytest.mark.parametrize(("scenes", "variants"), [(["heap", "uneven"], None), ("heap", "soils")])
def test_worlds_may_have_scenes_and_soils_of_their_own(scenes, variants):
    soils = [{"soil": {"repose": angle, "density": 1000 + angle}} for angle in (28.0, 33.0, 38.0)]
    variants = soils if variants else None
    each = [
        {"scene": scenes if isinstance(scenes, str) else scenes[i % 2], **(soils[i % 3] if variants else {})}
        for i in range(5)
    ]
    single = [lambda own=own: gymnasium.make("DirtPush-v0", reward={"work": 3.0}, **own) for own in each]
    one = native(5, scene=scenes, variants=variants, reward={"work": 3.0})
    assert_same_play(one, SyncVectorEnv(single), steps=10)
    assert [config.soil.density for config in one.get_attr("config")] == [
        env.unwrapped.config.soil.density for env in (make() for make in single)
    ]


# Arguments


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"scene": ["heap", "pad"]}, r"world 1 \(scene pad\) has .*, and world 0 \(scene heap\) has .*SyncVectorEnv"),
        ({"variants": [{}, {"site": {"size": [16, 16]}}]}, r"world 1 .* has rows and columns \(32, 32\), and world 0"),
        ({"variants": [{}, {"site": {"border": "open"}}]}, "world 1 .* has site.border open, and world 0 .* has wall"),
        ({"variants": [{}, {"level": 5}]}, "world 1 .* has obstacles True, and world 0 .* has False"),
        ({"variants": [{}, {"observation": {"size": 8}}]}, "observation.size 8"),
        (
            {"terrain": "voxel"},
            'terrain is "voxel"; allowed in a native batch: "heightfield".*vectorization_mode="sync"',
        ),
        ({"scene": []}, "scene is .*; allowed: a list of 1 to 4"),
        ({"scene": ["heap"] * 5}, "scene is .*; allowed: a list of 1 to 4"),
        ({"variants": [3]}, r"variants\[0\] is 3; allowed"),
        ({"soi": {"repose": 30}}, "soi.*known.*soil"),
        ({"autoreset_mode": "Sometimes"}, "autoreset_mode is 'Sometimes'; allowed: NextStep, SameStep, Disabled"),
        ({"info": "some"}, "info is 'some'; allowed: all, end, none"),
        ({"threads": 0}, "threads is 0; allowed: a whole number from 1 or None"),
        ({"max_episode_steps": 0}, "max_episode_steps is 0; allowed"),
        ({"render_mode": "ansi"}, "render_mode is 'ansi'; allowed"),
    ],
    ids=str,
)
def test_bad_arguments_are_refused_by_name(options, complaint):
    with pytest.raises(ValueError, match=complaint):
        native(4, **options)


def test_it_is_made_by_name_with_its_mode_and_specification():
    env = native(3, level=2, autoreset_mode=AutoresetMode.SAME_STEP)
    assert type(env).__name__ == "DirtPushVectorEnv"
    assert env.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    assert (env.spec.id, env.spec.max_episode_steps) == ("DirtPush-v0", 600)
    other = sync(3, level=2)
    assert (env.action_space, env.observation_space) == (other.action_space, other.observation_space)
    assert env.single_observation_space == other.single_observation_space
    found, expected = native(3, level=2).reset(seed=1)[0], gymnasium.make_vec(env.spec).reset(seed=1)[0]
    assert_equal(found, expected)


def test_the_wrappers_of_gymnasium_take_it():
    env = gymnasium.wrappers.vector.RecordEpisodeStatistics(native(3, max_episode_steps=4, **QUICK))
    env.reset(seed=0)
    *_, infos = [env.step(action)[-1] for action in actions(3, 4)]
    assert infos["episode"]["l"].tolist() == [4, 4, 4]


@pytest.mark.parametrize("seed", [-1, 0.5, "abcd", [1, 2], [1, 2, 3, -4], True])
def test_bad_seeds_are_refused(seed):
    with pytest.raises(ValueError, match=r"seed is .*; allowed: None, an integer >= 0, or a list of 4 of them"):
        native().reset(seed=seed)


@pytest.mark.parametrize("mask", [[True] * 4, np.zeros(4, bool), np.ones(3, bool), np.ones(4)])
def test_bad_masks_are_refused(mask):
    env = native()
    env.reset(seed=0)
    before = env.get_state()
    with pytest.raises(ValueError, match=r"reset_mask is .*; allowed: an array bool\[4\], not all False"):
        env.reset(options={"reset_mask": mask})
    assert env.get_state() == before


def test_a_refused_reset_changes_no_world():
    env = native()
    env.reset(seed=0)
    before = env.get_state()
    options = [None, None, None, {"pose": (-5.0, 0.0, 0.0)}]
    for refused in ({"pose": (-5.0, 0.0, 0.0)}, options, [None], {"sed": 1}):
        with pytest.raises(ValueError, match=r"allowed|known"):
            env.reset(seed=9, options=refused)
        assert env.get_state() == before


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda a: a[:3], r"actions have the shape \(3, 3\); allowed: \(4, 3\)"),
        (lambda a: a[:, :2], r"shape \(4, 2\)"),
        (lambda a: np.where(np.arange(4)[:, None] == 2, np.nan, a), "action of world 2 is .*steering nan"),
        (lambda a: a * np.array([1, np.inf, 1]), "action of world 0 is .*speed inf"),
        (lambda a: None, "actions"),
        (lambda a: "go", "actions are"),
    ],
)
def test_bad_actions_change_no_world(change, complaint):
    env = native()
    env.reset(seed=0)
    before, good = env.get_state(), actions(4, 1)[0]
    with pytest.raises(ValueError, match=complaint):
        env.step(change(good))
    assert env.get_state() == before


def test_actions_may_be_lists_and_lie_anyhow_in_memory():
    plain, odd = native(), native()
    for env in (plain, odd):
        env.reset(seed=0)
    forms = [np.ndarray.tolist, np.asfortranarray, lambda a: np.repeat(a, 2, axis=1)[:, ::2], lambda a: a.astype(">f8")]
    for form, action in zip(forms, actions(4, 4), strict=True):
        assert_equal(odd.step(form(action)), plain.step(action))


def test_nothing_is_stepped_before_a_reset_or_after_the_end():
    env = native(autoreset_mode="Disabled", max_episode_steps=1)
    with pytest.raises(ResetNeeded):
        env.step(actions(4, 1)[0])
    with pytest.raises(ResetNeeded):
        env.reset(options={"reset_mask": np.array([True, False, False, False])})
    env.reset(seed=0)
    env.step(actions(4, 1)[0])
    env.reset(options={"reset_mask": np.array([True, False, True, True])})
    with pytest.raises(ResetNeeded, match=r"worlds 1 are over.*reset_mask"):
        env.step(actions(4, 1)[0])


# Memory, infos, Python


def test_no_memory_is_shared_between_returns():
    env = native(3, observation={"overview": True, "map": True}, level=1)
    returned = [env.reset(seed=0)[0]]
    for action in actions(3, 3):
        observation, reward, ended, cut, infos = env.step(action)
        returned.append({**observation, "reward": reward, "ended": ended, "cut": cut, **flat(infos)})
    arrays = [array for one in returned for array in one.values()]
    for i, one in enumerate(arrays):
        assert not any(np.shares_memory(one, other) for other in arrays[:i])


def flat(infos):
    """The arrays of an info, those of the reward's terms too."""
    return {key: value for name, part in infos.items() for key, value in spread(name, part)}


def spread(name, part):
    return [(f"{name}.{inner}", value) for inner, value in part.items()] if isinstance(part, dict) else [(name, part)]


def test_without_copies_the_next_step_overwrites_observations():
    kept, new = native(3, copy=False), native(3)
    first = [env.reset(seed=0)[0] for env in (kept, new)]
    for action in actions(3, 3):
        second = [env.step(action)[0] for env in (kept, new)]
        assert_equal(*second)
    assert np.shares_memory(first[0]["patch"], second[0]["patch"])
    assert not np.shares_memory(first[1]["patch"], second[1]["patch"])


@pytest.mark.parametrize("mode", MODES[:2])
def test_infos_may_be_left_out(mode):
    options = {**QUICK, "max_episode_steps": 5, "autoreset_mode": mode}
    full, ends, none = (native(info=info, **options) for info in ("all", "end", "none"))
    for env in (full, ends, none):
        env.reset(seed=3)
    for action in actions(4, 12):
        everything, *others = (env.step(action) for env in (full, ends, none))
        for other in others:
            assert_equal(other[:4], everything[:4])
        done, infos = everything[2] | everything[3], everything[4]
        at_end, nothing = others[0][4], others[1][4]
        if mode == AutoresetMode.SAME_STEP:
            finals = {name: value for name, value in infos.items() if "final" in name}
            assert_equal(at_end, finals)
            assert_equal(nothing, {name: value for name, value in finals.items() if "obs" in name})
        else:
            assert nothing == {}
            assert bool(at_end) == done.any()
            if at_end:
                assert at_end["_share_in_goal"].tolist() == done.tolist()
                assert_equal(at_end["share_in_goal"], np.where(done, infos["share_in_goal"], 0.0))


def test_a_step_does_nothing_in_python_for_single_worlds(monkeypatch):
    env = native(40, threads=2)
    env.reset(seed=0)

    def refuse(*_, **__):
        raise AssertionError("a world of its own")

    for name in ("step", "begin", "put", "reset", "episode"):
        monkeypatch.setattr(DirtPushEnv, name, refuse)
    for action in actions(40, 3):
        env.step(action)


# States


def test_states_are_those_of_single_environments():
    env, singles = native(3, level=2), [DirtPushEnv(level=2) for _ in range(3)]
    env.reset(seed=5)
    for world, single in enumerate(singles):
        single.reset(seed=5 + world)
    for action in actions(3, 6):
        env.step(action)
        for world, single in enumerate(singles):
            single.step(action[world])
    states = [single.get_state() for single in singles]
    assert env.get_state() == states
    assert env.get_state([2, 0]) == [states[2], states[0]]
    assert env.get_state(np.array([False, True, False])) == [states[1]]


def test_states_go_back_into_any_world_and_on_from_there():
    env = native(3, **QUICK)
    env.reset(seed=5)
    for action in actions(3, 4):
        env.step(action)
    states, expected = env.get_state(), [env.step(action) for action in actions(3, 16, seed=1)]
    fresh = native(3, **QUICK)
    fresh.set_state(states)
    assert fresh.get_state() == states
    assert_equal(tuple(fresh.step(action) for action in actions(3, 16, seed=1)), tuple(expected))
    fresh.set_state([states[0]], [2])
    assert fresh.get_state([2]) == [states[0]]


def test_a_world_at_its_end_is_reset_after_its_state_has_come_back():
    env, other = (native(2, max_episode_steps=3, **QUICK) for _ in range(2))
    env.reset(seed=5)
    for action in actions(2, 3):
        env.step(action)
    other.set_state(env.get_state())
    assert_equal(other.step(actions(2, 1)[0]), env.step(actions(2, 1)[0]))


def test_a_bad_state_changes_no_world():
    env = native(2)
    env.reset(seed=0)
    before = env.get_state()
    other = DirtPushEnv(soil={"repose": 30})
    other.reset(seed=0)
    for states, indices in (([before[1], b"x"], None), ([before[1], other.get_state()], None), (before, [0])):
        with pytest.raises(ValueError, match="state"):
            env.set_state(states, indices)
        assert env.get_state() == before
    with pytest.raises(ValueError, match=r"indices are \[2\]; allowed: numbers from 0 to 1, or a mask"):
        env.get_state([2])


@pytest.mark.parametrize("copy_of", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_in_mid_episode_go_on_identically(copy_of):
    env = native(40, threads=2, max_episode_steps=6, render_mode="rgb_array", **QUICK)
    env.reset(seed=2)
    for action in actions(40, 4):
        env.step(action)
    env.envs[0].render()
    twin = copy_of(env)
    for action in actions(40, 6, seed=1):
        assert_equal(twin.step(action), env.step(action))
    assert_equal(twin.reset(), env.reset())


def test_a_world_branches_into_copies_that_go_their_own_ways():
    env, single = native(5, level=5), DirtPushEnv(level=5)
    env.reset(seed=1)
    for action in actions(5, 5):
        env.step(action)
    single.set_state(env.get_state([1])[0])
    env.copy_worlds([1, 1, 1], [4, 0, 2])
    states = env.get_state()
    assert states[0] == states[2] == states[4] == states[1] == single.get_state()
    assert states[3] != states[1]
    for action in actions(5, 5, seed=1):
        env.step(action)
        single.step(action[4])
    states = env.get_state()
    assert len(set(states)) == 5
    assert states[4] == single.get_state()
    env.copy_worlds([3, 2], [2, 3])  # the same episode in 2 as in 1, another in 3
    assert env.get_state([2, 3]) == [states[3], states[2]]


def test_one_world_branches_into_many():
    env = native(4)
    env.reset(seed=1)
    env.copy_worlds(2, [0, 1, 3])
    states = env.get_state()
    assert states[0] == states[1] == states[2] == states[3]


def test_copies_that_do_not_match_say_what_is_allowed():
    env = native(4)
    env.reset(seed=0)
    for sources, targets in (([0, 1], [1, 2, 3]), (0, [1, 1])):
        with pytest.raises(ValueError, match="allowed: one source for all targets or as many as targets, each"):
            env.copy_worlds(sources, targets)
    with pytest.raises(ValueError, match=r"sources are \[0.5\]; allowed: numbers from 0 to 3"):
        env.copy_worlds(0.5, [1])


def test_copies_of_other_scenes_are_refused():
    env = native(4, variants=[{}, {"soil": {"repose": 30}}])
    env.reset(seed=0)
    before = env.get_state()
    for sources, targets in (([0], [1]), ([0, 2], [2]), ([0, 0], [2, 2]), ([0], [4])):
        with pytest.raises(ValueError, match="allowed"):
            env.copy_worlds(sources, targets)
        assert env.get_state() == before


def test_reset_options_that_are_not_known_are_refused_with_all_that_are():
    with pytest.raises(ValueError, match="reset option 'foo' is unknown; known: layout_seed, pose, reset_mask"):
        native(2).reset(options={"foo": 1})


# The rest of the interface


def test_every_world_is_within_reach():
    env, other = native(3, render_mode="rgb_array"), sync(3, render_mode="rgb_array")
    for one in (env, other):
        one.reset(seed=4)
        one.step(actions(3, 1)[0])
        one.set_attr("label", ["a", "b", "c"])
        one.set_attr("other", 7)
    assert env.get_attr("label") == ("a", "b", "c")
    assert env.get_attr("other") == (7, 7, 7)
    assert env.np_random_seed == other.np_random_seed == (4, 5, 6)
    assert env.call("get_state") == other.call("get_state")
    assert [generator.random() for generator in env.np_random] == [generator.random() for generator in other.np_random]
    assert_equal(env.render(), other.render())
    env.close()
    env.close()


def test_closing_is_not_the_end_of_copies():
    env = native(64, threads=2)
    env.reset(seed=0)
    env.step(actions(64, 1)[0])
    twin = copy.deepcopy(env)
    env.close()
    twin.step(actions(64, 1)[0])
    twin.close()


def test_the_generic_ways_still_work():
    env = gymnasium.make_vec("DirtPush-v0", 2, "async", **QUICK)
    other = native(2, **QUICK)
    assert_same_play(env, other, steps=4)
    env.close()


def child(env, pipe):
    """Steps a batch that was made in another process."""
    pipe.send([env.step(action)[0]["patch"].tobytes() for action in actions(64, 3)])
    env.close()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_batches_go_on_in_other_processes(method):
    """With threads that have been at work before: a child makes its own."""
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {method} here")
    context = multiprocessing.get_context(method)
    env = native(64, threads=2, level=0)
    env.reset(seed=0)
    env.step(actions(64, 1)[0])
    here, there = context.Pipe()
    process = context.Process(target=child, args=(env, there))
    process.start()
    expected = [env.step(action)[0]["patch"].tobytes() for action in actions(64, 3)]
    assert here.poll(120)
    assert here.recv() == expected
    process.join(60)
    assert process.exitcode == 0
    env.close()
