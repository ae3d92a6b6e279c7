"""Left and right are alike: a world and its mirror image are shown the same, and driven the same but for the side."""

import numpy as np
import pytest
from dirt_env.agents.mirror import SIDED, STEERING, Mirror
from dirt_env.agents.network import load, read, written

from dirt_env.config import load as load_scene
from dirt_env.env import DirtPushEnv
from dirt_env.task.observation import POSE_ENTRIES

from .conftest import METADATA, smoke, weights

HEIGHT = 24.0  # m, of the site
SEEN = {"size": 12, "resolution": 0.75, "overview": True}
GOAL_LEFT = POSE_ENTRIES.index("goal_left") - 15  # of the last frame
MIRRORED = {**METADATA, "mirror": True}


def scene(over):
    """A heap and a goal to the left of a machine; or, turned over, to its right."""

    def at(x, y):
        return [x, HEIGHT - y if over else y]

    return {
        "site": {"size": [30.0, HEIGHT], "cell": 0.5},
        "start": [{"region": {"kind": "circle", "center": at(14.0, 10.0), "radius": 3.0}, "volume": 9.0}],
        "goal": [{"region": {"kind": "circle", "center": at(22.0, 17.0), "radius": 4.0}}],
        "machine": {"pose": [*at(7.0, 8.5), -10.0 if over else 10.0]},
        "observation": SEEN,
    }


def batch(observation):
    return {name: array[None] for name, array in observation.items()}


def test_a_mirror_image_is_shown_as_what_it_is_of():
    """While a machine turns, digs into a heap and tilts; all that has a side changes its sign at some time."""
    here, there = DirtPushEnv(scene=scene(over=False)), DirtPushEnv(scene=scene(over=True))
    seen, image = here.reset(seed=0)[0], there.reset(seed=0)[0]
    mirror, sides = Mirror(on=True), []
    for step in range(40):
        shown = mirror.show({name: np.stack([seen[name], image[name]]) for name in seen})
        as_it_is = int(mirror.turned[0])  # the one of the two that is shown so
        assert mirror.turned[1 - as_it_is] != mirror.turned[as_it_is]
        for name, (one, other) in shown.items():
            np.testing.assert_allclose(one, other, atol=2e-3, err_msg=name)
            np.testing.assert_array_equal(shown[name][as_it_is], (seen, image)[as_it_is][name])
        asked = np.array([0.6 * np.sin(0.3 * step), 0.8, -0.1])
        driven = mirror.steer(np.stack([asked, asked]))
        np.testing.assert_array_equal(driven[as_it_is], asked)
        np.testing.assert_array_equal(driven[1 - as_it_is], asked * [-1.0, 1.0, 1.0])
        np.testing.assert_array_equal(mirror.steer(driven), [asked, asked])
        sides.append(seen["pose"])
        seen, image = here.step(driven[0])[0], there.step(driven[1])[0]
    largest = np.abs(np.array(sides)).max(axis=0)
    assert all(largest[POSE_ENTRIES.index(name)] > 0.05 for name in SIDED)


def test_without_a_mirror_everything_is_passed_on_as_it_is():
    generator, mirror = np.random.default_rng(0), Mirror(on=False)
    seen = {"patch": generator.random((3, 2, 4, 4)), "pose": -generator.random((3, 15))}
    actions = generator.random((3, 3))
    for name, array in seen.items():
        assert mirror.show(seen)[name] is array
        np.testing.assert_array_equal(
            mirror.show_last({name: array[0] for name, array in seen.items()})[name], array[0]
        )
    assert mirror.steer(actions) is actions


@pytest.mark.parametrize("frames", [1, 2])
def test_a_policy_steers_the_other_way_in_a_mirror_image(frames, tmp_path):
    """To the last bit, and in a batch as alone; with frames it is the last one that says where the goal lies."""
    generator = np.random.default_rng(0)
    arrays = weights(generator)
    arrays["conv0.weight"] = generator.standard_normal((4, 2 * frames, 3, 3)).astype(np.float32)
    arrays["hidden0.weight"] = 0.1 * generator.standard_normal((16, 4 * 3 * 3 + 15 * frames)).astype(np.float32)
    arrays["action.weight"] *= 0.1
    arrays["pose.mean"], arrays["pose.scale"] = np.zeros(15 * frames, np.float32), np.ones(15 * frames, np.float32)
    path = tmp_path / "it.npz"
    path.write_bytes(written(arrays, {**MIRRORED, "frames": frames}))
    policy, plain = load(path, load_scene()), read(arrays, {**METADATA, "frames": frames})
    signs = np.where(np.isin(POSE_ENTRIES, SIDED), -1.0, 1.0).astype(np.float32)
    for _ in range(frames):
        seen = {
            "patch": generator.standard_normal((8, 2, 8, 8)).astype(np.float32),
            "pose": generator.standard_normal((8, 15)).astype(np.float32),
        }
        image = {"patch": seen["patch"][..., ::-1], "pose": seen["pose"] * signs}
        both = {name: np.concatenate([seen[name], image[name]]) for name in seen}
        acted, without = policy.act_all(both), plain.act_all(both)
    right = both["pose"][:, GOAL_LEFT] < 0
    np.testing.assert_array_equal(acted[:8] * [-1.0, 1.0, 1.0], acted[8:])
    np.testing.assert_array_equal(acted[~right], without[~right])
    assert np.abs(acted[right] - without[right]).max(axis=1).min() > 1e-3
    assert 0 < right[:8].sum() < 8


@pytest.mark.usefixtures("stable_baselines3")
class TestTraining:
    """With stable-baselines3."""

    @pytest.mark.parametrize("frames", [1, 3])
    def test_the_worlds_are_shown_turned_over_and_driven_so(self, frames):
        """Beside the same worlds as they are, which are driven by actions turned over by hand."""
        from dirt_env.agents.course import Course

        worlds = {"count": 8, "frames": frames, "steps": 9, "set": {"observation": {"overview": True}}}
        course, plain = (Course(smoke(worlds={**worlds, "mirror": on}, ppo={"batch_size": 64})) for on in (True, False))
        shown, seen, mirror, turned = course.reset(), plain.reset(), Mirror(on=True), 0
        for actions in np.random.default_rng(0).uniform(-1, 1, (25, 8, 3)).astype(np.float32):
            for name, array in mirror.show(seen).items():
                np.testing.assert_array_equal(shown[name], array, err_msg=name)
            right = seen["pose"][:, GOAL_LEFT] < 0
            np.testing.assert_array_equal(mirror.turned, right)
            assert (shown["pose"][:, GOAL_LEFT] >= 0).all()
            done_by_hand = actions.copy()
            done_by_hand[right, STEERING] *= -1
            shown, rewards, done, infos = course.step(actions)
            seen, expected, ended, plain_infos = plain.step(done_by_hand)
            np.testing.assert_array_equal(rewards, expected)
            np.testing.assert_array_equal(done, ended)
            for world in np.flatnonzero(done):
                final = batch(plain_infos[world]["terminal_observation"])
                for name, array in Mirror(on=True).show(final).items():
                    np.testing.assert_array_equal(infos[world]["terminal_observation"][name], array[0], err_msg=name)
                turned += final["pose"][0, GOAL_LEFT] < 0
        assert turned > 0
        other = Course(course.settings)
        other.set_state(course.state())
        actions = np.ones((8, 3), np.float32)
        gone_on = other.step(actions)[0]
        for name, array in course.step(actions)[0].items():
            np.testing.assert_array_equal(gone_on[name], array, err_msg=name)
        for env in (course, plain, other):
            env.close()

    def test_a_teacher_shows_what_the_network_sees(self):
        from dirt_env.agents.demonstrations import demonstrate

        teacher = {"policy": "adaptive_push", "worlds": 6, "steps": 120, "noise": 0.0, "critic_steps": 300}
        settings = [smoke(teacher=teacher, worlds={"count": 16, "mirror": on}) for on in (True, False)]
        mirror, turned = Mirror(on=True), 0
        for (_, shown), (_, plain) in zip(*map(demonstrate, settings), strict=True):
            for name, array in mirror.show(plain.observations).items():
                np.testing.assert_array_equal(shown.observations[name], array, err_msg=name)
            np.testing.assert_array_equal(shown.actions, mirror.steer(plain.actions))
            turned += np.abs(plain.actions[mirror.turned, STEERING]).sum()
        assert turned > 0
