"""Every method keeps the volume and nears the answers it should; errors measure what they say."""

import numpy as np
import pytest

from dirt_env.bench.accuracy import errors
from dirt_env.bench.accuracy.case import SITE, Case, moved, site
from dirt_env.bench.accuracy.catalogue import PROBLEMS
from dirt_env.bench.accuracy.methods import METHODS, Settings, Trial, exact_sum
from dirt_env.bench.accuracy.pouring import portions

# A problem of each kind that a method can do, and the error at 32 cells of those that look at the gradient's length.
PICKED = {
    "column-collapse": 0.02,
    "table": 0.02,
    "dump": 0.02,
    "several-sources": 0.06,
    "berm": 0.003,
    "linear-mode": 0.01,  # of a wave that has all but decayed, in single precision
    "manufactured": 0.02,
}
ROUGH = {"paper": 0.4, "neighbours-4": 0.3, "neighbours-8": 0.1}


@pytest.fixture(scope="module")
def cases():
    return {name: PROBLEMS[name].make(32) for name in PICKED}


def ran(name, case, **settings):
    trial = METHODS[name].prepare(case, Settings(**settings))
    return trial, trial.run()


@pytest.mark.slow
@pytest.mark.parametrize("problem", PICKED)
def test_each_method_keeps_the_volume_and_nears_the_answer(cases, problem):
    case = cases[problem]
    for name, method in METHODS.items():
        if PROBLEMS[problem].kind not in method.kinds:
            continue
        tolerance = None if case.sweeps else 1e-3
        trial, _ = ran(name, case, tolerance=tolerance)
        found = errors.errors(trial, case)
        exact = 0.0 if name not in ("neighbours-4", "neighbours-8") else 2e-5
        assert abs(found["volume_error"]) <= exact, name
        assert found["rel_l1"] < ROUGH.get(name, PICKED[problem]), name
        assert found["rel_l1"] > 0


def test_a_rule_of_neighbours_is_no_more_true_when_it_is_run_longer(cases):
    case = cases["column-collapse"]
    four, _ = ran("neighbours-4", case, tolerance=1e-4)
    eight, _ = ran("neighbours-8", case, tolerance=1e-4)
    assert errors.relative_l1(four.height(), case) > 0.15
    assert 0.03 < errors.relative_l1(eight.height(), case) < 0.1
    assert errors.roundness(four.height(), case) < 0.85


def test_settings_are_listened_to(cases):
    case = cases["column-collapse"]
    for name in ("explicit", "neighbours-4"):
        loose, few = ran(name, case, tolerance=1e-1)
        tight, many = ran(name, case, tolerance=1e-3)
        assert few < many
        assert errors.relative_l1(tight.height(), case) < errors.relative_l1(loose.height(), case)
        capped, sweeps = ran(name, case, cap=16)
        assert sweeps == 16
        assert errors.relative_l1(capped.height(), case) > errors.relative_l1(loose.height(), case)
    fine, _ = ran("neighbours-4", case, precision="f8")
    coarse, _ = ran("neighbours-4", case, precision="f4")
    assert 0 < np.abs(fine.height() - coarse.height()).max() < 0.02


def test_soil_is_poured_in_equal_portions_that_hold_the_volume():
    grid = site(64)
    case = Case(grid, np.zeros((64, 64)), np.zeros((64, 64)), 1.0, pours=((16.1, 9.3, 5.0),), spout=0.8, rounds=4)
    for quantum in (None, 2.0**-18):
        given = portions(case, quantum)
        assert len(given) == 4
        rows, cols, amounts = given[0]
        assert amounts.sum() * grid.cell**2 == pytest.approx(1.25, abs=1e-5)
        y, x = np.average(np.mgrid[rows, cols].reshape(2, -1) + 0.5, axis=1, weights=amounts.ravel()) * grid.cell
        assert (x, y) == pytest.approx((16.1, 9.3), abs=0.03)
        if quantum:
            assert (amounts / quantum == np.round(amounts / quantum)).all()


def heap_of(shape, centre=(16.0, 16.0, 2.0)):
    """A case whose answer is h = 4 - shape(x, y)."""
    grid = site(64)
    x, y = np.meshgrid(*[(np.arange(64) + 0.5) * grid.cell - SITE / 2] * 2)
    height = 4.0 - shape(x, y)
    return Case(grid, np.zeros((64, 64)), height, 100.0, centre=centre), height


def test_a_cone_is_round_and_a_pyramid_is_not():
    case, cone = heap_of(np.hypot)
    assert errors.roundness(cone, case) > 0.99
    case, pyramid = heap_of(lambda x, y: np.maximum(np.abs(x), np.abs(y)))
    assert errors.roundness(pyramid, case) == pytest.approx(0.5**0.5, abs=0.05)
    assert errors.roundness(np.zeros((64, 64)), case) == 0.0


def test_errors_are_relative_to_what_they_say():
    case, height = heap_of(np.hypot)
    seen = np.zeros((64, 64), bool)
    seen[:10] = True
    off = height.copy()
    off[3, 4] += 5.0
    off[40, 40] -= 1.0
    assert errors.relative_l1(off, case) == pytest.approx(0.06)
    assert errors.relative_l1(off, case._replace(seen=seen)) == pytest.approx(0.05)
    assert errors.largest(off, case) == pytest.approx(5.0 / np.abs(height).max())
    trial = Trial(lambda: 0, lambda: off, exact_sum(height), lambda: 1.0)
    assert errors.volume_error(trial, off, case) == pytest.approx(0.05)
    assert moved(height, off) == pytest.approx(3.0)


def test_sums_are_exact_where_a_plain_sum_is_not():
    heights = np.array([1e16, 1.0, -1e16, 1.0])
    assert exact_sum(heights) == 2.0
    assert heights.sum() != 2.0
