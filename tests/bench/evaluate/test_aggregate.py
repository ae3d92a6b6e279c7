"""Statistics of evaluations: cases worked out by hand, the reference library, and how the intervals behave."""

import numpy as np
import pytest

from dirt_env.bench.evaluate.aggregate import (
    band,
    interquartile_mean,
    iqm,
    iqm_of_all,
    paired_improvement,
    probability_of_improvement,
    profile,
    resampled,
)

# Ten runs of four tasks each, and what rliable 1.2.0 (numpy 2.4.6, scipy 1.17.1, arch 7.2.0) says of them:
# metrics.aggregate_iqm, metrics.probability_of_improvement, library.get_interval_estimates (50,000 resamples) and
# library.create_performance_profile (20,000).
X = np.array(
    [
        [0.623, 0.903, 0.73, 0.686],
        [0.811, 0.85, 0.724, 0.687],
        [0.707, 0.74, 0.635, 0.834],
        [0.764, 0.651, 0.678, 0.664],
        [0.483, 0.616, 0.545, 0.916],
        [0.71, 0.882, 0.622, 0.596],
        [0.893, 0.415, 0.698, 0.652],
        [0.92, 0.797, 0.898, 0.422],
        [0.921, 0.902, 0.749, 0.852],
        [0.522, 0.429, 0.697, 0.878],
    ]
)
Y = np.array(
    [
        [0.75, 0.867, 0.569, 0.841],
        [0.827, 0.575, 0.666, 0.765],
        [0.654, 0.761, 0.866, 0.722],
        [0.796, 0.645, 0.62, 0.605],
        [0.747, 0.503, 0.703, 0.711],
        [0.782, 0.593, 0.705, 0.498],
        [0.451, 0.755, 0.593, 0.47],
        [0.686, 0.585, 0.383, 0.687],
        [0.484, 0.61, 0.491, 0.731],
        [0.536, 0.327, 0.802, 0.931],
    ]
)
RLIABLE_IQM = {"x": (0.7232, 0.67415, 0.7783), "y": (0.66715, 0.61345, 0.71345)}
RLIABLE_IMPROVEMENT = 0.61375
RLIABLE_PROFILE = {0.4: (1.0, 1.0, 1.0), 0.6: (0.825, 0.7, 0.925), 0.8: (0.325, 0.2, 0.475)}


def test_the_interquartile_mean_leaves_out_a_quarter_at_either_end():
    assert iqm(np.array([100.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -100.0])) == (2 + 3 + 4 + 5) / 4
    assert iqm(np.array([1.0, 2.0, 6.0])) == 3.0  # a quarter of three, rounded down, is none
    assert iqm(np.array([7.0])) == 7.0
    assert iqm(np.array([[0.0, 1.0, 2.0, 9.0], [4.0, 4.0, 8.0, 0.0]])).tolist() == [1.5, 4.0]


@pytest.mark.parametrize(("name", "runs"), [("x", X), ("y", Y)])
def test_iqm_and_interval_are_those_of_rliable(name, runs):
    value, low, high = interquartile_mean(list(runs.T))
    assert value == pytest.approx(RLIABLE_IQM[name][0], abs=1e-12)
    assert (low, high) == pytest.approx(RLIABLE_IQM[name][1:], abs=0.006)  # 2,000 resamples against 50,000


def test_the_probability_of_improvement_is_that_of_rliable():
    assert probability_of_improvement(list(X.T), list(Y.T)) == pytest.approx(RLIABLE_IMPROVEMENT, abs=1e-12)


def test_the_performance_profile_is_that_of_rliable():
    share, low, high = profile(list(X.T), np.array(list(RLIABLE_PROFILE)))
    for found, expected in zip(zip(share, low, high, strict=True), RLIABLE_PROFILE.values(), strict=True):
        assert found == pytest.approx(expected, abs=0.026)


def test_improvement_over_all_pairs_by_hand():
    # Task 1: 3 beats 1 and 2, 1 ties with 1 and loses to 2: 2.5 of 4. Task 2: 1 of 1. Their mean.
    assert probability_of_improvement([[3, 1], [5]], [[1, 2], [4]]) == (2.5 / 4 + 1) / 2


def test_paired_improvement_looks_at_the_same_layout_only():
    worse, better = [np.array([1.0, 5.0, 9.0])], [np.array([1.5, 5.5, 9.5])]
    assert probability_of_improvement(better, worse) == 6 / 9
    assert paired_improvement(better, worse) == (1.0, 1.0, 1.0)
    assert paired_improvement(worse, better) == (0.0, 0.0, 0.0)
    assert paired_improvement(worse, worse) == (0.5, 0.5, 0.5)
    with pytest.raises(ValueError, match="different numbers of runs"):
        paired_improvement(worse, [np.array([1.0])])


def test_runs_are_drawn_within_their_task_and_the_same_ones_for_every_policy():
    drawn = resampled([np.array([1.0, 2.0]), np.array([10.0, 20.0, 30.0])])
    assert set(np.unique(drawn[0])) == {1.0, 2.0}
    assert set(np.unique(drawn[1])) == {10.0, 20.0, 30.0}
    again = resampled([np.array([5.0, 6.0]), np.array([0.0, 0.0, 0.0])])
    assert (again[0] - 4.0 == drawn[0]).all()


def test_tasks_that_differ_do_not_widen_the_interval():
    """What stratified means: between tasks nothing is drawn."""
    assert interquartile_mean([np.full(5, 0.1), np.full(5, 0.9)]) == pytest.approx((0.5, 0.5, 0.5))


def test_the_interval_covers_what_it_should():
    """Of 200 samples of 20 from a normal distribution some 95 % of the intervals hold its centre."""
    generator = np.random.default_rng(5)
    found = [interquartile_mean([generator.normal(3.0, 1.0, 20)]) for _ in range(200)]
    assert 0.88 <= np.mean([low <= 3.0 <= high for _, low, high in found]) <= 0.99


def test_a_curve_has_its_mean_and_band_at_every_moment():
    curves = np.array([[0.0, 1.0], [0.0, 2.0], [0.0, 3.0], [0.0, 10.0]])
    mean, low, high = band([curves])
    assert mean.tolist() == [0.0, 2.5]
    assert (low[0], high[0]) == (0.0, 0.0)
    assert (low[1], high[1]) == interquartile_mean([curves[:, 1]])[1:]


def test_no_runs_are_refused():
    with pytest.raises(ValueError, match=r"tasks have \[2, 0\] runs"):
        interquartile_mean([np.ones(2), np.ones(0)])
    assert iqm_of_all([np.ones(2)]) == 1.0
