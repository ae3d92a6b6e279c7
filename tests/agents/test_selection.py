"""Evaluation during training has the figures of `dirt-push evaluate` on the same layouts."""

import pytest
from dirt_env.agents.network import load
from dirt_env.agents.selection import Score, Selection

from dirt_env.bench.evaluate.episode import Trial, run_trial
from dirt_env.bench.evaluate.suite import Task
from dirt_env.config import load as load_scene
from dirt_env.split import layouts

from .conftest import smoke

COUNT = 6
SHOVE = {  # a small heap right before a goal, the machine behind it: how much of it arrives is up to its volume
    "site": {"size": [16.0, 16.0]},
    "start": [{"region": {"kind": "circle", "center": [6.0, 8.0], "radius": 1.5}, "volume": [0.5, 3.0]}],
    "goal": [{"region": {"kind": "rectangle", "center": [11.0, 8.0], "size": [6.0, 6.0]}}],
    "machine": {"pose": [3.0, 8.0, 0.0]},
}


def mean_of_trials(path, task):
    records = [run_trial(Trial(str(path), task, seed))["metrics"] for seed in layouts("selection", COUNT)]
    return {name: sum(record[name] for record in records) / COUNT for name in Score._fields[1:]}


def assert_same(score, expected):
    assert {name: getattr(score, name) for name in expected} == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_the_figures_are_those_of_an_evaluation(pusher):
    """Some of the episodes end with success, others with the time."""
    scene = {**SHOVE, "task": {"time": 20.0, "success": 0.4}}
    selection = Selection(smoke(worlds={"set": scene}, stage=[{}], record={"levels": None, "layouts": COUNT}))
    [score] = selection.score(load(pusher, load_scene()))
    assert selection.score(load(pusher, load_scene())) == [score]
    selection.close()
    assert_same(score, mean_of_trials(pusher, Task("shove", None, "heap", {**smoke().worlds.set, **scene})))
    assert 0.0 < score.success < 1.0
    assert 0.1 < score.share_area < score.share_end


def test_every_level_has_its_own_time(pusher):
    selection = Selection(smoke(worlds={"set": {"task": {"time": None}}}, record={"levels": [0, 1], "layouts": COUNT}))
    scores = selection.score(load(pusher, load_scene()))
    selection.close()
    assert [(score.level, score.time_s) for score in scores] == [(0, 240.0), (1, 300.0)]
    assert_same(scores[1], mean_of_trials(pusher, Task("heap", 1, "heap", {"level": 1})))
