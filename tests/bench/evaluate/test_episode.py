"""What is measured in an episode, against episodes whose figures are known."""

import sys

import numpy as np
import pytest

from dirt_env.bench.evaluate.episode import INTERVALS, METRICS, PolicyFailureError, Trial, run_trial
from dirt_env.bench.evaluate.suite import Task
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy
from dirt_env.rollout import play

EASY = Task("heap", 0, "heap", {"level": 0})


@pytest.fixture(scope="module")
def pushed():
    return run_trial(Trial("adaptive_push", EASY, 3))


def test_doing_nothing_scores_nothing():
    record = run_trial(Trial("idle", EASY, 3))
    metrics = record["metrics"]
    assert list(metrics) == list(METRICS)
    assert (metrics["score"], metrics["share_end"], metrics["success"], metrics["distance_m"]) == (0.0, 0.0, 0.0, 0.0)
    assert metrics["time_to_90_s"] == metrics["time_s"] == record["seconds"] == 240.0
    assert metrics["energy_kj_per_m3"] is None
    assert metrics["grade_error_m"] is None
    assert record["curve"] == [0.0] * (INTERVALS + 1)


def test_a_pushed_heap_has_the_figures_of_the_same_episode_played_alone(pushed):
    env = DirtPushEnv(level=0, observation={"map": True})
    shares, potentials = [], []

    def watch(env, info):
        shares.append(info["share_in_goal"])
        potentials.append(env.episode.remaining.potential)

    summary = play(env, load_policy("adaptive_push", env.config), 3, env.config.steps, watch)
    metrics, curve = pushed["metrics"], np.array([*shares, *[shares[-1]] * (481 - len(shares))])
    assert metrics["share_end"] == summary["share_in_goal"] >= 0.95
    assert metrics["share_area"] == curve[1:].mean()
    assert metrics["time_to_90_s"] == 0.5 * np.argmax(curve >= 0.9) < metrics["time_s"] == summary["time_s"]
    fall = (potentials[0] - potentials[-1]) / (summary["time_s"] / 60)
    assert metrics["volume_distance_m4_per_min"] == pytest.approx(fall, rel=1e-12)
    assert metrics["energy_kj_per_m3"] == summary["energy_kj"] / summary["volume_moved_m3"]
    assert pushed["curve"] == curve[::8].tolist()


def test_the_ideal_machine_scores_one(monkeypatch):
    """Everything in the goal after potential / (rated load x top speed), linearly: the definition, played back."""
    env = DirtPushEnv(level=0)
    env.reset(seed=3)
    start = env.episode.start
    seconds = start.potential / (2.4 * 2.0)
    times = iter(np.arange(0, 1000) * 0.5)

    def told(info):
        return {**info, "share_in_goal": 0.95 * min(1.0, next(times) / seconds)}

    def ideal(env, policy, seed, steps, watch):
        return play(env, policy, seed, steps, lambda env, info: watch(env, told(info)))

    monkeypatch.setattr("dirt_env.bench.evaluate.episode.play", ideal)
    assert run_trial(Trial("idle", EASY, 3))["metrics"]["score"] == pytest.approx(1.0, abs=0.02)


def test_a_graded_pad_is_judged_by_its_error():
    task = Task("pad", None, "pad", {}, 20)
    metrics = run_trial(Trial("idle", task, 3))["metrics"]
    assert metrics["score"] == 0.0
    assert metrics["grade_error_m"] > 0.06


def test_the_same_trial_gives_the_same_record_after_others(pushed):
    run_trial(Trial("random", EASY, 4))
    assert run_trial(Trial("adaptive_push", EASY, 3)) == pushed


def test_an_error_in_a_policy_says_which_and_where(tmp_path, monkeypatch):
    (tmp_path / "breaks.py").write_text(
        "class Late:\n"
        "    sees = 'nothing'\n"
        "    def __init__(self, config): self.left = 3\n"
        "    def reset(self, seed=None): pass\n"
        "    def act(self, observation):\n"
        "        self.left -= 1\n"
        "        return [0, 0, 1 / self.left]\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    with pytest.raises(PolicyFailureError, match=r"breaks:Late failed in heap 0, layout 5: ZeroDivisionError.*line 7"):
        run_trial(Trial("breaks:Late", EASY, 5))
