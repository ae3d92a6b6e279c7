"""The memory of the last frames: as a list of them would have it, in training, in imitation and in the policy file."""

import numpy as np
import pytest
from dirt_env.agents.frames import Frames
from dirt_env.agents.network import load, read, written
from dirt_env.agents.selection import Selection

from dirt_env.bench.evaluate.episode import Trial, run_trial
from dirt_env.bench.evaluate.suite import Task
from dirt_env.config import load as load_scene
from dirt_env.split import layouts

from .conftest import METADATA, broken_and_gone_on, smoke, weights

COUNT = 3
TWO = {**METADATA, "frames": 2}


def frame(worlds, generator):
    """Something to see."""
    shapes = {"patch": (worlds, 2, 8, 8), "pose": (worlds, 15), "overview": (worlds, 2, 12, 12)}
    return {name: generator.standard_normal(shape).astype(np.float32) for name, shape in shapes.items()}


def of(seen, world):
    return {name: array[world] for name, array in seen.items()}


def stacked(frames):
    """The last COUNT of a world's frames, the first of them in place of those before it."""
    last = ([frames[0]] * COUNT + frames)[-COUNT:]
    return {**frames[-1], **{name: np.concatenate([one[name] for one in last]) for name in ("patch", "pose")}}


def same(seen, expected):
    assert seen.keys() == expected.keys()
    for name, array in seen.items():
        np.testing.assert_array_equal(array, expected[name], err_msg=name)


def test_it_is_a_list_of_frames_for_each_world():
    generator, frames, lists = np.random.default_rng(0), Frames(COUNT), [[], [], [], []]
    for step in range(30):
        seen, begins = frame(4, generator), generator.random(4) < 0.2
        for world, kept in enumerate(lists):
            if step and begins[world]:
                final = of(frame(4, generator), world)
                same(frames.last(final, world), stacked([*kept, final]))
                kept.clear()
            kept.append(of(seen, world))
        found = frames.add(seen, begins)
        for world, kept in enumerate(lists):
            same(of(found, world), stacked(kept))
    frames.forget()
    seen = frame(2, generator)
    same(of(frames.add(seen), 1), stacked([of(seen, 1)]))


def test_one_frame_is_passed_on_as_it_is():
    seen = frame(2, np.random.default_rng(0))
    frames = Frames(1)
    same(frames.add(seen), seen)
    same(frames.last(of(seen, 1), 1), of(seen, 1))
    assert not frames.kept


def remembering(seed=0):
    """Weights of a network that sees two frames."""
    generator = np.random.default_rng(seed)
    arrays = weights(generator)
    arrays["conv0.weight"] = generator.standard_normal((4, 4, 3, 3)).astype(np.float32)
    arrays["hidden0.weight"] = 0.1 * generator.standard_normal((16, 4 * 3 * 3 + 30)).astype(np.float32)
    arrays["action.weight"] *= 0.1
    arrays["pose.mean"], arrays["pose.scale"] = np.zeros(30, np.float32), np.ones(30, np.float32)
    return arrays


def test_a_policy_remembers_until_it_is_reset():
    policy, generator = read(remembering(), TWO), np.random.default_rng(0)
    first, second = frame(5, generator), frame(5, generator)
    fresh = policy.act_all(second)
    policy.reset()
    policy.act_all(first)
    begins = np.array([False, True, False, False, True])
    acted = policy.act_all(second, begins)
    np.testing.assert_array_equal((acted == fresh).all(axis=1), begins)
    with pytest.raises(ValueError, match="1 worlds are seen; allowed: 5, as before, or `reset` first"):
        policy.act(of(first, 0))
    policy.reset()
    np.testing.assert_allclose(policy.act(of(second, 0)), fresh[0], atol=1e-6)


def test_selection_plays_it_as_an_evaluation_does(tmp_path):
    """Twice, as in a run: the second time nothing is left of the first."""
    path = tmp_path / "two.npz"
    path.write_bytes(written(remembering(), TWO))
    selection = Selection(smoke(record={"levels": [0], "layouts": 3}))
    policy = load(path, load_scene())
    [score], [again] = selection.score(policy), selection.score(policy)
    selection.close()
    task = Task("heap", 0, "heap", {"level": 0, **smoke().worlds.set}, steps=40)
    records = [run_trial(Trial(str(path), task, seed))["metrics"] for seed in layouts("selection", 3)]
    assert score == again
    assert score.share_area == pytest.approx(np.mean([record["share_area"] for record in records]), abs=1e-6)
    assert score.volume_distance_m4_per_min == pytest.approx(
        np.mean([record["volume_distance_m4_per_min"] for record in records]), abs=1e-4
    )


@pytest.mark.usefixtures("stable_baselines3")
class TestTraining:
    """With stable-baselines3."""

    def test_the_worlds_show_the_last_frames_and_those_of_an_ended_episode(self):
        from dirt_env.agents.course import Course

        worlds = {"count": 4, "frames": COUNT, "steps": 7, "set": {"observation": {"overview": True}}}
        settings = smoke(worlds=worlds, ppo={"batch_size": 64})
        course, plain = (Course(one) for one in (settings, smoke(**seeing_one(settings))))
        seen, one = course.reset(), plain.reset()
        assert {name: space.shape for name, space in course.observation_space.items()} == {
            name: array.shape[1:] for name, array in seen.items()
        }
        lists = [[of(one, world)] for world in range(4)]
        for actions in np.random.default_rng(0).uniform(-1, 1, (20, 4, 3)).astype(np.float32):
            seen, rewards, done, infos = course.step(actions)
            one, expected, ended, plain_infos = plain.step(actions)
            np.testing.assert_array_equal(rewards, expected)
            np.testing.assert_array_equal(done, ended)
            for world, kept in enumerate(lists):
                if done[world]:
                    final = plain_infos[world]["terminal_observation"]
                    same(infos[world]["terminal_observation"], stacked([*kept, final]))
                    kept.clear()
                kept.append(of(one, world))
                same(of(seen, world), stacked(kept))
        other = Course(settings)
        other.set_state(course.state())
        actions = np.ones((4, 3), np.float32)
        same(other.step(actions)[0], course.step(actions)[0])
        for env in (course, plain, other):
            env.close()

    def test_a_teacher_shows_what_the_network_sees(self):
        from dirt_env.agents.demonstrations import demonstrate

        teacher = {"policy": "adaptive_push", "worlds": 3, "steps": 180, "noise": 0.0, "critic_steps": 300}
        settings = [smoke(teacher=teacher, worlds={"count": 16, "frames": frames}) for frames in (COUNT, 1)]
        shown, plain = ([step.observations for _, step in demonstrate(one)] for one in settings)
        lists = [[], [], []]
        for step, (seen, one) in enumerate(zip(shown, plain, strict=True)):
            for world, kept in enumerate(lists):
                if step == 40:  # the episodes of the smoke settings end with their time
                    kept.clear()
                kept.append(of(one, world))
                same(of(seen, world), stacked(kept))

    @pytest.mark.slow
    def test_a_run_goes_on_to_the_same_bits(self, tmp_path):
        settings = smoke(steps=1024, worlds={"frames": 2}, stage=[{"levels": [0]}], record={"save_every": 512})
        broken_and_gone_on(settings, tmp_path, broken_at=768, saved_at=512)
        assert load(tmp_path / "broken" / "policy.npz", load_scene()).metadata["frames"] == 2


def seeing_one(settings):
    """What changes the smoke settings into these, but for the number of frames."""
    worlds = settings.worlds
    kept = {"count": worlds.count, "steps": worlds.steps, "set": dict(worlds.set)}
    return {"worlds": kept, "ppo": {"batch_size": settings.ppo.batch_size}}
