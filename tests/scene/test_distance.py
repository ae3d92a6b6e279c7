"""Exact distances to the rim of a mask."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from dirt_env.scene.distance import distance_inside, distance_outside


def naive(mask: np.ndarray, cell: float) -> np.ndarray:
    """Distance to every False cell, one by one."""
    outside = np.argwhere(~mask)
    result = np.zeros(mask.shape)
    for row, col in np.argwhere(mask):
        away = np.hypot(*(outside - (row, col)).T) if len(outside) else np.array([np.inf])
        result[row, col] = cell * away.min()
    return result


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**32 - 1), st.sampled_from([0.2, 0.6, 0.95]))
def test_equals_the_obvious_way(rows, cols, seed, share):
    mask = np.random.default_rng(seed).random((rows, cols)) < share
    np.testing.assert_allclose(distance_inside(mask, 0.5), naive(mask, 0.5), rtol=1e-14)
    np.testing.assert_allclose(distance_outside(~mask, 0.5), naive(mask, 0.5), rtol=1e-14)


def test_border_is_no_outside():
    assert np.isinf(distance_inside(np.ones((3, 4), dtype=bool), 1.0)).all()
    assert not distance_inside(np.zeros((3, 4), dtype=bool), 1.0).any()
