"""Distances to the nearest of a set of cells, against trying them all."""

import numpy as np
import pytest

from dirt_env.sim.distance import nearest_cells


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (17, 23)])
@pytest.mark.parametrize("share", [0.02, 0.3, 1.0])
def test_the_nearest_cell_is_marked_and_as_near_as_any(shape, share):
    marked = np.random.default_rng(3).random(shape) < share
    marked[-1, 0] = True
    distance, row, col = nearest_cells(marked)
    assert marked[row, col].all()
    at = np.indices(shape)
    squared = ((at[:, :, :, None] - np.argwhere(marked).T[:, None, None]) ** 2).sum(axis=0).min(axis=-1)
    assert np.array_equal((at[0] - row) ** 2 + (at[1] - col) ** 2, squared)
    assert np.array_equal(distance, np.sqrt(squared))
