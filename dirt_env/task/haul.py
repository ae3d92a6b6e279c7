"""How far soil has to be hauled: the distance from every cell to the nearest cell where it is welcome."""

from math import sqrt

import numpy as np

from dirt_env.sim.distance import FAR, nearest_cells
from dirt_env.sim.jit import entry, kernel


def haul_distance(welcome: np.ndarray, solid: np.ndarray | None, cell: float) -> np.ndarray:
    """Distance [m] to the nearest cell of welcome[rows, cols], round the solid cells: f8[rows, cols].

    Exact (between cell centres) wherever the straight line is free; in the shadow of obstacles a first-order
    solution of the eikonal equation. Cells that no way leads to get the straight distance; with nothing welcome
    anywhere, every distance is one cell.
    """
    if not welcome.any():
        return np.full(welcome.shape, cell)
    distance, row, col = nearest_cells(welcome)
    if solid is not None and solid.any():
        _around(np.ascontiguousarray(solid), distance, row, col)
    return distance * cell


@entry
def _around(solid, distance, near_row, near_col):
    """Replace the distances [cells] whose straight line is blocked by the way round: fast sweeping (Zhao 2005)."""
    rows, cols = distance.shape
    way = np.full((rows + 2, cols + 2), FAR)
    shadow = np.zeros((rows, cols), np.bool_)
    box = np.array([rows, 0, cols, 0])  # of the shadow
    _cast_shadows(solid, distance, near_row, near_col, shadow, way, box)
    change = FAR
    while change > 1e-9:
        change = 0.0
        for south in (True, False):
            for west in (True, False):
                change = max(change, _sweep(shadow, way, box, south, west))
    for r in range(box[0], box[1]):
        for c in range(box[2], box[3]):
            if shadow[r, c] and way[r + 1, c + 1] < FAR:
                distance[r, c] = way[r + 1, c + 1]


@kernel
def _cast_shadows(solid, distance, near_row, near_col, shadow, way, box):
    """Mark the cells that do not see the cell nearest to them; the others' ways are their distances."""
    count = _count_solid(solid)
    for r in range(solid.shape[0]):
        for c in range(solid.shape[1]):
            if solid[r, c]:
                continue
            to_row, to_col = near_row[r, c], near_col[r, c]
            r0, r1 = min(r, to_row), max(r, to_row) + 1
            c0, c1 = min(c, to_col), max(c, to_col) + 1
            near = count[r1, c1] - count[r0, c1] - count[r1, c0] + count[r0, c0]
            if near > 0 and not _in_sight(solid, r, c, to_row, to_col):
                shadow[r, c] = True
                box[0], box[1] = min(box[0], r), max(box[1], r + 1)
                box[2], box[3] = min(box[2], c), max(box[3], c + 1)
            else:
                way[r + 1, c + 1] = distance[r, c]


@kernel
def _count_solid(solid):
    """Number of solid cells south and west of each corner of the grid, i4[rows + 1, cols + 1]."""
    rows, cols = solid.shape
    count = np.zeros((rows + 1, cols + 1), np.int32)
    for r in range(rows):
        in_row = 0
        for c in range(cols):
            in_row += solid[r, c]
            count[r + 1, c + 1] = count[r, c + 1] + in_row
    return count


@kernel
def _in_sight(solid, r, c, to_row, to_col):
    """Whether the straight line between two cell centres meets no solid cell, sampled twice a cell."""
    n = 2 * max(abs(to_row - r), abs(to_col - c))
    for i in range(1, n):
        if solid[int(r + 0.5 + (to_row - r) * i / n), int(c + 0.5 + (to_col - c) * i / n)]:
            return False
    return True


@kernel
def _sweep(shadow, way, box, south, west):
    """One pass of |grad way| = 1 over the shadowed cells from one corner; the largest change [cells]."""
    r0, r1, c0, c1 = box[0], box[1], box[2], box[3]
    change = 0.0
    for i in range(r1 - r0):
        r = r0 + i if south else r1 - 1 - i
        for j in range(c1 - c0):
            c = c0 + j if west else c1 - 1 - j
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
