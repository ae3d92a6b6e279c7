"""Reward terms: a potential's fall, and what it took."""

from itertools import pairwise
from math import log

import pytest

from dirt_env.sim.params import Soil
from dirt_env.task.goal import Remaining
from dirt_env.task.reward import GRAVITY, TERMS, reward_terms, scale_of

SOIL = Soil(density=1500.0, friction=0.5)
START = Remaining(potential=80.0, misplaced=8.0, moved=0.0, stray=0.0, grade_error=0.0)
SCALE = scale_of(START, SOIL, volume=8.0, period=0.5, time=100.0)


def terms_of(before, after, work=0.0, lost=0.0, finished=False, scale=SCALE):
    """The terms of a step from one state of the job to another, by name."""
    return dict(zip(TERMS, reward_terms(before, after, work, lost, finished, scale), strict=True))


def test_a_whole_job_is_worth_one():
    done = START._replace(potential=0.0)
    assert terms_of(START, done, finished=True)["work"] == 1.0


def test_going_and_coming_back_is_worth_nothing():
    there = START._replace(potential=33.0)
    forth, back = (terms_of(a, b) for a, b in ((START, there), (there, START)))
    assert forth["work"] + back["work"] == 0.0


def test_the_tail_of_a_job_counts_more_by_its_logarithm():
    shares = (1.0, 0.4, 0.1, 0.0)
    states = [START._replace(potential=share * START.potential, misplaced=share * START.misplaced) for share in shares]
    parts = [terms_of(a, b)["log_work"] for a, b in pairwise(states)]
    assert sum(parts) == pytest.approx(1.0)
    assert parts[0] == pytest.approx(log(1.05 / 0.45) / log(21.0))
    assert parts[2] == pytest.approx(log(3.0) / log(21.0))
    assert terms_of(states[1], states[0])["log_work"] == -parts[0]


def test_soil_that_only_reaches_the_rim_is_not_there_yet_by_its_logarithm():
    rim, inside = START._replace(potential=0.0), START._replace(potential=0.0, misplaced=0.0)
    assert terms_of(rim, inside)["work"] == 0.0
    share = 3.0 * START.misplaced / (START.potential + 3.0 * START.misplaced)
    assert terms_of(rim, inside)["log_work"] == pytest.approx(log((share + 0.05) / 0.05) / log(21.0))


def test_terms_have_their_scales():
    ideal = SOIL.density * GRAVITY * SOIL.friction * START.potential
    terms = terms_of(START, START, work=ideal, lost=2.0)
    nothing = dict.fromkeys(TERMS, 0.0)
    assert terms == nothing | {"energy": -1.0, "time": pytest.approx(-1 / 200), "spill": -0.25}
    assert terms_of(START, START, finished=True)["success"] == 1.0


def test_nothing_to_do_divides_by_nothing():
    nothing = Remaining(0.0, 0.0, 0.0, 0.0, 0.0)
    scale = scale_of(nothing, SOIL, 0.0, 0.5, 100.0)
    assert terms_of(nothing, nothing, scale=scale)["work"] == 0.0
