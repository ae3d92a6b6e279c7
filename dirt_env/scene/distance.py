"""Exact Euclidean distance of the cells of a mask to the nearest cell that is not in it."""

import numpy as np


def distance_inside(mask: np.ndarray, cell: float) -> np.ndarray:
    """Distance from each cell centre in `mask` to the nearest cell centre outside it, m [rows, cols]; 0 outside.

    The map's border is no outside: a mask without any outside has distance inf (a wall holds the soil).
    """
    if not mask.any():
        return np.zeros(mask.shape)
    window = around(mask)
    result = np.zeros(mask.shape)
    result[window] = cell * np.sqrt(_squared(mask[window]))
    return result


def distance_outside(mask: np.ndarray, cell: float) -> np.ndarray:
    """Distance from each cell centre to the nearest one in `mask`, m [rows, cols]; 0 inside, inf for an empty mask."""
    return cell * np.sqrt(_squared(~mask))


def around(mask: np.ndarray) -> tuple[slice, slice]:
    """Bounding box of the mask, grown by one cell where the map goes on."""
    spans = []
    for axis, length in enumerate(mask.shape):
        (hit,) = np.nonzero(mask.any(axis=1 - axis))
        spans.append(slice(max(hit[0] - 1, 0), min(hit[-1] + 2, length)))
    return spans[0], spans[1]


def _squared(mask: np.ndarray) -> np.ndarray:
    """Squared distance to the nearest False cell, in cells: down the columns first, then the parabolas along a row."""
    rows, cols = mask.shape
    down = np.full((rows, cols), np.inf)
    count = np.full(cols, np.inf)
    for row in range(rows):
        count = np.where(mask[row], count + 1, 0.0)
        down[row] = count
    count = np.full(cols, np.inf)
    for row in range(rows - 1, -1, -1):
        count = np.where(mask[row], count + 1, 0.0)
        down[row] = np.minimum(down[row], count)
    down **= 2
    result = down.copy()
    for shift in range(1, cols):
        np.minimum(result[:, shift:], down[:, :-shift] + shift**2, out=result[:, shift:])
        np.minimum(result[:, :-shift], down[:, shift:] + shift**2, out=result[:, :-shift])
    return result
