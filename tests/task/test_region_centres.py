"""Regions of a mask and their middles: every shape there is on small grids, noise, and what the slow twin finds."""

import numpy as np
import pytest

from dirt_env.task.region_centres import middle_of, region_centres


def regions(mask):
    """Lists of the cells of each region, by walking from cell to cell."""
    rest = {tuple(cell) for cell in np.argwhere(mask).tolist()}
    for first in np.argwhere(mask).tolist():
        if tuple(first) not in rest:
            continue
        found, waiting = [], [tuple(first)]
        rest.remove(tuple(first))
        while waiting:
            r, c = waiting.pop()
            found.append((r, c))
            for near in ((r - 1, c), (r + 1, c), (r, c - 1), (r, c + 1)):
                if near in rest:
                    rest.remove(near)
                    waiting.append(near)
        yield sorted(found)


def middle(cells, cell):
    """Centroid, or the middle of the nearest of the cells where that is none of them."""
    row, col = np.mean(cells, axis=0)
    if (int(row + 0.5), int(col + 0.5)) not in cells:
        row, col = min(cells, key=lambda at: (at[0] - row) ** 2 + (at[1] - col) ** 2)
    return (col + 0.5) * cell, (row + 0.5) * cell


@pytest.mark.parametrize("shape", [(1, 1), (1, 12), (12, 1), (3, 4), (17, 23)])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.6, 0.9, 1.0])
def test_equals_the_slow_twin_on_noise(shape, share):
    """About 0.6 of the cells, regions wind through each other; their first cells say in which order they come."""
    for seed in range(20):
        mask = np.random.default_rng(seed).random(shape) < share
        expected = [middle(cells, 0.5) for cells in regions(mask)]
        assert region_centres(mask, 0.5).tolist() == [list(at) for at in expected]
        if mask.any():
            assert middle_of(mask, 0.5).tolist() == [list(middle([tuple(at) for at in np.argwhere(mask)], 0.5))]


def test_branches_that_meet_late_are_one_region():
    comb = np.zeros((9, 9), bool)
    comb[:, ::2] = comb[8] = True
    assert len(region_centres(comb, 1.0)) == 1
    assert len(region_centres(comb[:8], 1.0)) == 5


def test_a_large_noisy_mask_is_taken_in_one_go():
    """A quarter of a million cells with 20,000 regions; region by region it would take minutes."""
    mask = np.random.default_rng(0).random((512, 512)) < 0.5
    found = region_centres(mask, 1.0)
    assert len(found) > 10000
    assert mask[tuple((found[:, ::-1] - 0.5).round().astype(int).T)].mean() > 0.9
