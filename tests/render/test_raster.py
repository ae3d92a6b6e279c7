"""Resampling, distances and coverage of the own little drawing library."""

import numpy as np
import pytest

from dirt_env.render.raster import Resampling, box_distance, coverage, segment_distance


@pytest.mark.parametrize(("out", "source"), [(640, 64), (90, 64), (64, 64), (30, 64), (7, 300), (5, 1)])
def test_resampling_keeps_constants(out, source):
    line = np.full((source, 2), 3.5, np.float32)
    assert Resampling(out, source).rows(line) == pytest.approx(np.full((out, 2), 3.5), rel=1e-6)


@pytest.mark.parametrize(("out", "source"), [(640, 64), (96, 64), (40, 200)])
def test_resampling_keeps_straight_lines_away_from_the_ends(out, source):
    line = np.arange(source, dtype=np.float32)[None]
    exact = (np.arange(out) + 0.5) * source / out - 0.5
    inside = slice(out // 8, -out // 8)
    assert Resampling(out, source).cols(line)[0][inside] == pytest.approx(exact[inside], abs=1e-3)


def test_resampling_backwards_is_mirrored_and_a_part_is_a_part():
    values = np.random.default_rng(1).random((20, 3)).astype(np.float32)
    whole = Resampling(50, 20, apron=1).rows(values)
    back = Resampling(50, 20, apron=1, backwards=True)
    assert np.array_equal(back.rows(values), whole[::-1])
    assert np.array_equal(back.rows(values, slice(10, 17)), whole[::-1][10:17])


def test_distances():
    along, across = np.array([0.0, 2.0, 5.0]), np.array([0.0, 0.0, 5.0])
    assert box_distance(along, across, (0, 0), (2, 1), 0) == pytest.approx([-1, 0, 5])
    assert segment_distance(along, across, (0, 0), (2, 0)) == pytest.approx([0, 0, np.hypot(3, 5)])
    assert coverage(np.array([-3.0, 0.0, 3.0])) == pytest.approx([1, 0.5, 0])
