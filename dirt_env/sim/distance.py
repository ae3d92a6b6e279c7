"""Exact Euclidean distance of all cells of a grid to the nearest one of a set."""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel

FAR = 1e30


def nearest_cells(marked: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance [cells] from each cell to the nearest cell of marked[rows, cols], and that one's row and column.

    f8, i8 and i8[rows, cols]; at least one cell has to be marked.
    """
    distance, row, col = (np.empty(marked.shape, kind) for kind in (np.float64, np.int64, np.int64))
    find_nearest(np.ascontiguousarray(marked), distance, row, col)
    return distance, row, col


@entry
def find_nearest(marked, distance, near_row, near_col):
    """Fill the three arrays of `nearest_cells`. Felzenszwalb and Huttenlocher 2012."""
    rows, cols = marked.shape
    row = np.empty((rows, cols), np.int64)
    _search_columns(marked, row)
    vertex = np.empty(cols, np.int64)
    border = np.empty(cols + 1, np.float64)
    for r in range(rows):
        _search_row(r, row, vertex, border, near_col[r])
        for c in range(cols):
            k = near_col[r, c]
            near_row[r, c] = row[r, k]
            distance[r, c] = sqrt((c - k) ** 2 + (r - row[r, k]) ** 2)


@kernel
def _search_columns(marked, nearest):
    """Row of the nearest marked cell in the same column, to nearest[rows, cols]; -1 if there is none."""
    rows, cols = marked.shape
    for r in range(rows):
        for c in range(cols):
            nearest[r, c] = r if marked[r, c] else nearest[r - 1, c] if r > 0 else -1
    for r in range(rows - 2, -1, -1):
        for c in range(cols):
            above = nearest[r + 1, c]
            if above > r and (nearest[r, c] < 0 or above - r < r - nearest[r, c]):
                nearest[r, c] = above


@kernel
def _search_row(r, row, vertex, border, nearest):
    """Column whose nearest marked cell is nearest to each cell of row r: lower envelope of parabolas."""
    cols = nearest.shape[0]
    k = -1
    for c in range(cols):
        if row[r, c] < 0:
            continue
        height = (r - row[r, c]) ** 2 + c * c
        cross = -FAR
        while k >= 0:
            v = vertex[k]
            cross = (height - (r - row[r, v]) ** 2 - v * v) / (2.0 * (c - v))
            if cross > border[k]:
                break
            k -= 1
            cross = -FAR
        k += 1
        vertex[k] = c
        border[k] = cross
        border[k + 1] = FAR
    k = 0
    for c in range(cols):
        while border[k + 1] < c:
            k += 1
        nearest[c] = vertex[k]
