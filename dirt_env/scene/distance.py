"""Exact Euclidean distance of the cells of a mask to the nearest cell that is not in it."""

import numpy as np

from dirt_env.sim.distance import nearest_cells


def distance_inside(mask: np.ndarray, cell: float) -> np.ndarray:
    """Distance from each cell centre in `mask` to the nearest cell centre outside it, m [rows, cols]; 0 outside.

    The map's border is no outside: a mask without any outside has distance inf (a wall holds the soil).
    """
    if not mask.any():
        return np.zeros(mask.shape)
    window = around(mask)
    result = np.zeros(mask.shape)
    result[window] = distance_outside(~mask[window], cell)
    return result


def distance_outside(mask: np.ndarray, cell: float) -> np.ndarray:
    """Distance from each cell centre to the nearest one in `mask`, m [rows, cols]; 0 inside, inf for an empty mask."""
    return cell * nearest_cells(mask)[0] if mask.any() else np.full(mask.shape, np.inf)


def around(mask: np.ndarray) -> tuple[slice, slice]:
    """Bounding box of the mask, grown by one cell where the map goes on."""
    spans = []
    for axis, length in enumerate(mask.shape):
        (hit,) = np.nonzero(mask.any(axis=1 - axis))
        spans.append(slice(max(hit[0] - 1, 0), min(hit[-1] + 2, length)))
    return spans[0], spans[1]
