"""How far soil has to be hauled: the distance from every cell to the nearest cell where it is welcome."""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel

FAR = 1e30


def haul_distance(welcome: np.ndarray, solid: np.ndarray | None, cell: float) -> np.ndarray:
    """Distance [m] to the nearest cell of welcome[rows, cols], round the solid cells: f8[rows, cols].

    Exact (between cell centres) wherever the straight line is free; in the shadow of obstacles a first-order
    solution of the eikonal equation. Cells that no way leads to get the straight distance; with nothing welcome
    anywhere, every distance is one cell.
    """
    if not welcome.any():
        return np.full(welcome.shape, cell)
    distance, row, col = (np.empty(welcome.shape, dtype) for dtype in (np.float64, np.int64, np.int64))
    _straight(welcome, distance, row, col)
    if solid is not None and solid.any():
        _around(solid, distance, row, col)
    return distance * cell


@entry
def _straight(welcome, distance, near_row, near_col):
    """Exact distance [cells] to the nearest welcome cell, and which that is. Felzenszwalb and Huttenlocher 2012."""
    rows, cols = welcome.shape
    row = np.empty((rows, cols), np.int64)
    for c in range(cols):
        _nearest_in_column(welcome[:, c], row[:, c])
    vertex = np.empty(cols, np.int64)
    border = np.empty(cols + 1, np.float64)
    for r in range(rows):
        _nearest_in_row(r, row, vertex, border, near_col[r])
        for c in range(cols):
            k = near_col[r, c]
            near_row[r, c] = row[r, k]
            distance[r, c] = sqrt((c - k) ** 2 + (r - row[r, k]) ** 2)


@kernel
def _nearest_in_column(welcome, nearest):
    """Row of the nearest welcome cell in one column; -1 if there is none."""
    rows = welcome.shape[0]
    last = -1
    for r in range(rows):
        if welcome[r]:
            last = r
        nearest[r] = last
    last = -1
    for r in range(rows - 1, -1, -1):
        if welcome[r]:
            last = r
        if last >= 0 and (nearest[r] < 0 or last - r < r - nearest[r]):
            nearest[r] = last


@kernel
def _nearest_in_row(r, row, vertex, border, nearest):
    """Column whose nearest welcome cell is nearest to each cell of row r: lower envelope of parabolas."""
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


@entry
def _around(solid, distance, near_row, near_col):
    """Replace the distances [cells] whose straight line is blocked by the way round: fast sweeping (Zhao 2005)."""
    rows, cols = distance.shape
    way = np.full((rows + 2, cols + 2), FAR)
    shadow = np.zeros((rows, cols), np.bool_)
    for r in range(rows):
        for c in range(cols):
            if solid[r, c]:
                continue
            shadow[r, c] = not _in_sight(solid, r, c, near_row[r, c], near_col[r, c])
            if not shadow[r, c]:
                way[r + 1, c + 1] = distance[r, c]
    change = FAR
    while change > 1e-9:
        change = 0.0
        for south in (True, False):
            for west in (True, False):
                change = max(change, _sweep(shadow, way, south, west))
    for r in range(rows):
        for c in range(cols):
            if shadow[r, c] and way[r + 1, c + 1] < FAR:
                distance[r, c] = way[r + 1, c + 1]


@kernel
def _in_sight(solid, r, c, to_row, to_col):
    """Whether the straight line between two cell centres meets no solid cell, sampled twice a cell."""
    n = 2 * max(abs(to_row - r), abs(to_col - c))
    for i in range(1, n):
        if solid[int(r + 0.5 + (to_row - r) * i / n), int(c + 0.5 + (to_col - c) * i / n)]:
            return False
    return True


@kernel
def _sweep(shadow, way, south, west):
    """One pass of |grad way| = 1 over the shadowed cells from one corner; the largest change [cells]."""
    rows, cols = shadow.shape
    change = 0.0
    for i in range(rows):
        r = i if south else rows - 1 - i
        for j in range(cols):
            c = j if west else cols - 1 - j
            if not shadow[r, c]:
                continue
            a = min(way[r, c + 1], way[r + 2, c + 1])
            b = min(way[r + 1, c], way[r + 1, c + 2])
            if abs(a - b) >= 1.0:
                new = min(a, b) + 1.0
            else:
                new = 0.5 * (a + b + sqrt(2.0 - (a - b) ** 2))
            if new < way[r + 1, c + 1]:
                change = max(change, way[r + 1, c + 1] - new)
                way[r + 1, c + 1] = new
    return change
