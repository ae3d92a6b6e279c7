"""Means and ratios of learned policies, against what follows by hand."""

import numpy as np
import pytest
from dirt_env.agents.contrast import matrix, mean, ratio


def test_a_policy_over_itself_is_one_whatever_is_drawn():
    runs = np.random.default_rng(0).uniform(1.0, 2.0, (1, 12))
    assert ratio(runs, runs) == (1.0, 1.0, 1.0)
    found = ratio(1.5 * runs, runs)
    assert (found.value, found.low, found.high) == pytest.approx((1.5, 1.5, 1.5))


def test_there_is_no_ratio_to_nothing():
    assert ratio(np.ones((1, 3)), np.array([[0.0, 0.0, 0.0]])) is None


def test_the_interval_is_that_of_seeds_where_layouts_are_all_alike():
    runs = np.repeat([[1.0], [2.0], [3.0]], 8, axis=1)  # three seeds: of 27 draws one has mean 1, three have 4/3
    found = mean(runs)
    assert found.value == 2.0
    assert (found.low, found.high) == pytest.approx((1.0, 3.0), abs=0.34)
    assert found.low < 1.5
    assert found.high > 2.5


def test_the_interval_of_a_mean_has_the_width_that_theory_gives():
    runs = np.random.default_rng(1).normal(5.0, 1.0, (1, 400))
    found = mean(runs)
    assert found.high - found.low == pytest.approx(2 * 1.96 * runs.std() / 20, rel=0.1)


def test_runs_are_found_by_policy_level_and_layout():
    records = {
        (policy, "heap", level, layout): {"metrics": {"score": ord(policy) + 10 * level + layout}}
        for policy in "ab"
        for level in (0, 1)
        for layout in (5, 6)
    }
    assert matrix(records, ["b", "a"], 1, [6, 5], "score").tolist() == [[114, 113], [113, 112]]
