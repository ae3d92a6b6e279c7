"""The rules of comparison: equal to a plain twin, settled, symmetric; borders, solid cells and sinks."""

import numpy as np
import pytest

from dirt_env.sim.laws import RATE
from dirt_env.sim.neighbour_rules import relax_by_neighbours, work_shape

CELL, K = 0.5, 0.7


def relax(height, eight, tolerance=1e-3, most=10**6, solid=None, sink=None, box=None):
    """(sweeps, gone) of relaxing `height` in place."""
    box = np.array(box or (0, height.shape[0], 0, height.shape[1]))
    work = np.zeros(work_shape(height), height.dtype)
    return relax_by_neighbours(height, solid, sink, CELL, K, tolerance, eight, most, box, work)


def plain(height, eight, sweeps, tolerance=1e-3, solid=None):
    """The same, cell by cell."""
    ways = [((0, 1), 1.0), ((1, 0), 1.0)] + [((1, 1), 2**0.5), ((1, -1), 2**0.5)] * eight
    rates = (RATE * 2 / 3, RATE / 3) if eight else (RATE, 0.0)
    h = height.copy()
    for _ in range(sweeps):
        change = np.zeros_like(h)
        for (up, over), length in ways:
            for r in range(h.shape[0] - up):
                for c in range(max(-over, 0), h.shape[1] - max(over, 0)):
                    there = r + up, c + over
                    if solid is not None and (solid[r, c] or solid[there]):
                        continue
                    drop = h[there] - h[r, c]
                    if abs(drop) <= K * CELL * length * (1 + tolerance):
                        continue
                    flow = rates[length > 1] * np.sign(drop) * (abs(drop) - K * CELL * length)
                    change[r, c] += flow
                    change[there] -= flow
        h += change
    return h


def rough(shape=(14, 11)):
    ground = np.random.default_rng(0).normal(0.0, 0.4, shape)
    ground[5:8, 4:7] += 4.0
    return ground


@pytest.mark.parametrize("eight", [False, True])
@pytest.mark.parametrize("posts", [False, True])
def test_it_equals_the_plain_twin(eight, posts):
    solid = np.zeros((14, 11), bool) if posts else None
    if posts:
        solid[6, 8] = solid[10:12, 2:4] = True
    height = rough()
    assert relax(height, eight, most=40, solid=solid)[0] == 40
    np.testing.assert_allclose(height, plain(rough(), eight, 40, solid=solid), atol=1e-12)
    assert np.abs(height - rough()).max() > 1.0


@pytest.mark.parametrize("eight", [False, True])
def test_a_spike_within_a_small_box_settles_as_on_the_whole_map(eight):
    whole = np.zeros((41, 43))
    whole[20, 21] = 30.0
    part = whole.copy()
    sweeps, _ = relax(whole, eight)
    relax(part, eight, box=(20, 21, 21, 22))
    np.testing.assert_allclose(part, whole, atol=1e-12)
    assert sweeps > 50
    assert whole.sum() == pytest.approx(30.0, rel=1e-12)
    drops = [np.abs(np.diff(whole, axis=0)).max(), np.abs(np.diff(whole, axis=1)).max()]
    assert max(drops) <= K * CELL * 1.001 + 1e-12
    diagonal = np.abs(whole[1:, 1:] - whole[:-1, :-1]).max()
    assert (diagonal <= 2**0.5 * K * CELL * 1.001 + 1e-12) == eight  # four neighbours do not look there
    np.testing.assert_allclose(whole, whole[::-1], atol=1e-12)
    np.testing.assert_allclose(whole, whole[:, ::-1], atol=1e-12)


def test_no_cell_gives_more_than_it_has():
    for eight in (False, True):
        height = np.zeros((9, 9))
        height[4, 4] = 100.0
        relax(height, eight, most=1)
        assert height.min() >= 0
        assert 0 < height[4, 4] < 10


@pytest.mark.parametrize("eight", [False, True])
def test_a_sink_takes_what_comes_and_gives_nothing_back(eight):
    height = np.full((12, 12), 5.0)
    sink = np.ones((12, 12), bool)
    sink[1:-1, 1:-1] = False
    height[sink] = 0.0
    before = height.sum()
    _, gone = relax(height, eight, sink=sink)
    assert (height[sink] == 0).all()
    assert gone > 0.3 * before
    assert height.sum() + gone == pytest.approx(before, rel=1e-12)
    assert height[1:-1, 1].max() <= K * CELL * 1.001
