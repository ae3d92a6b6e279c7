"""Rollouts: who is told what, and what is summed up."""

import json

import pytest

from dirt_env.cli import main
from dirt_env.config import load
from dirt_env.env import DirtPushEnv
from dirt_env.rollout import mean, play
from dirt_env.run import idle_figures

HALF_A_JOB = {"is_success": False, "success": 0.0, "time_s": 10.0, "volume_moved_m3": 1.0, "loose_moved_m3": 1.25}


class Listener:
    """Stands still and keeps the seeds that it is given."""

    sees = "nothing"

    def __init__(self):
        """Nothing heard yet."""
        self.seeds = []

    def reset(self, seed=None):
        self.seeds.append(seed)

    def act(self, observation):
        return [0.0, 0.0, 0.0]


def test_the_policy_gets_the_seed_of_the_episode():
    env, policy = DirtPushEnv(), Listener()
    summaries = [play(env, policy, seed, 1) for seed in (7, 12)]
    assert policy.seeds == [7, 12]
    assert [summary["seed"] for summary in summaries] == [7, 12]


def test_an_episode_says_whether_it_was_done():
    summary = play(DirtPushEnv(), Listener(), 7, 1)
    assert (summary["is_success"], summary["success"], summary["steps"]) == (False, 0.0, 1)


def test_the_mean_has_the_share_that_was_done():
    volumes = {"volume_moved_m3": 3.0, "loose_moved_m3": 3.75}
    done = {**HALF_A_JOB, "is_success": True, "success": 1.0, "time_s": 30.0, **volumes}
    figures = mean([{"seed": 1, **HALF_A_JOB}, {"seed": 2, **done}])
    rates = {"m3_per_h": pytest.approx(360.0), "loose_m3_per_h": pytest.approx(450.0)}
    assert figures == {"success": 0.5, "time_s": 20.0, "volume_moved_m3": 2.0, "loose_moved_m3": 2.5, **rates}


def test_the_replay_leaves_out_what_says_nothing_in_a_scene():
    assert idle_figures(load("heap")) == ("time_s", "grade_error_m", "energy_kj", "slip", "loose_moved_m3")
    assert idle_figures(load("pad", traction={}, soil={"swell": 0.25})) == ("time_s",)


class Breaks:
    """Stands still in its first episodes, `good` of them, and fails in the next one."""

    sees = "nothing"

    def __init__(self, good):
        """No episode yet."""
        self.left = good + 1

    def reset(self, seed=None):
        self.left -= 1

    def act(self, observation):
        return [0.0, 0.0, 0.0] if self.left else nothing  # noqa: F821  that is the failure


def breaks_late(config):
    return Breaks(2)


def breaks_at_once(config):
    return Breaks(0)


def test_what_was_finished_before_a_policy_failed_is_kept(tmp_path, capsys):
    arguments = ["run", "--policy", f"{__name__}:breaks_late", "--steps", "3", "--episodes", "4", "--seed", "7"]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert "breaks_late failed on layout 9: NameError: name 'nothing' is not defined (test_run.py, line" in said.err
    assert said.err.endswith("; after 2 of 4 episodes\n")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [episode["seed"] for episode in summary["episodes"]] == [7, 8]
    assert "NameError" in summary["failure"]
    assert (tmp_path / "out" / "replay.html").is_file()


def test_a_policy_that_fails_at_once_leaves_nothing_behind(tmp_path, capsys):
    arguments = ["run", "--policy", f"{__name__}:breaks_at_once", "--out", str(tmp_path / "out")]
    assert main(arguments) == 2
    assert "before the first episode was finished: nothing written" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
