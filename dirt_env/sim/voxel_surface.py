"""The surface over the cells (Section III-A): heights, normals, and what lies between the columns' centres."""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.machine import ground_at


@kernel
def top_of(column, bottom, dy):
    """y = ymin + (j + fill) dy of the topmost cell j of a column that is not empty [m]; ymin if all are."""
    for m in range(column.size - 2, 0, -1):
        if column[m] > 0.0:
            return bottom + (m - 1 + column[m]) * dy
    return bottom


@kernel
def stack_of(column, coming, bottom, dy):
    """Height of a column's soil put on a heap, fill and fill in transit [m]: the surface, unless soil is in the air."""
    total = 0.0
    for m in range(1, column.size - 1):
        total += column[m] + coming[m]
    return bottom + total * dy


@kernel
def lay_surface(fill, incoming, solid, bottom, dy, box, surface, height):
    """Write `surface` and `height` f4[rows, cols] m over the columns of `box`; solid ones stay as they are."""
    for r in range(box[0], box[1]):
        for c in range(box[2], box[3]):
            if solid is None or not solid[r - 1, c - 1]:
                surface[r - 1, c - 1] = top_of(fill[r, c], bottom, dy)
                height[r - 1, c - 1] = stack_of(fill[r, c], incoming[r, c], bottom, dy)


@kernel
def facet_normal(surface, cell, r, c):
    """Unit normal (east, north, up) of the facet north-east of column (r, c): the cross product of its diagonals.

    Beyond the map's rim the surface goes on level.
    """
    rows, cols = surface.shape
    south, north = min(max(r, 0), rows - 1), min(max(r + 1, 0), rows - 1)
    west, east = min(max(c, 0), cols - 1), min(max(c + 1, 0), cols - 1)
    rising = float(surface[north, east]) - float(surface[south, west])
    falling = float(surface[north, west]) - float(surface[south, east])
    x, y, up = (falling - rising) * cell, -(rising + falling) * cell, 2.0 * cell**2
    length = sqrt(x * x + y * y + up * up)
    return x / length, y / length, up / length


@kernel
def normal_at(surface, cell, r, c):
    """Unit normal (east, north, up) of the surface at column (r, c): the mean of those of the four facets around it."""
    x = y = up = 0.0
    for i in range(4):
        fx, fy, fz = facet_normal(surface, cell, r - i // 2, c - i % 2)
        x, y, up = x + fx, y + fy, up + fz
    length = sqrt(x * x + y * y + up * up)
    return x / length, y / length, up / length


@kernel
def slope_at(surface, cell, x, y):
    """Slopes to the east and to the north at any point [m], from the normals of the columns around, bilinear."""
    rows, cols = surface.shape
    column, row = min(max(x / cell - 0.5, 0.0), cols - 1.0), min(max(y / cell - 0.5, 0.0), rows - 1.0)
    c, r = int(column), int(row)
    fx, fy = column - c, row - r
    east = north = up = 0.0
    for i in range(4):
        weight = (fy if i // 2 else 1.0 - fy) * (fx if i % 2 else 1.0 - fx)
        if weight > 0.0:
            nx, ny, nz = normal_at(surface, cell, r + i // 2, c + i % 2)
            east, north, up = east + weight * nx, north + weight * ny, up + weight * nz
    return -east / up, -north / up


@entry
def normals_of(surface: np.ndarray, cell: float) -> np.ndarray:
    """Unit normals f8[rows, cols, 3] (east, north, up) of a surface [rows, cols] m."""
    rows, cols = surface.shape
    normals = np.empty((rows, cols, 3))
    for r in range(rows):
        for c in range(cols):
            normals[r, c, 0], normals[r, c, 1], normals[r, c, 2] = normal_at(surface, cell, r, c)
    return normals


@kernel
def height_at(surface, cell, x, y):
    """The surface's height [m] at any point [m], bilinear between the columns' centres."""
    return ground_at(surface, cell, x, y)


@entry
def position_on_surface(surface: np.ndarray, cell: float, x: float, y: float) -> tuple[float, float, float]:
    """GetPositionOnSurface: height [m], and slopes to the east and to the north, at any point [m]."""
    east, north = slope_at(surface, cell, x, y)
    return height_at(surface, cell, x, y), east, north
