"""The surface over the cells (Section III-A): heights, normals, and what lies between the columns' centres."""

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.machine import ground_at
from dirt_env.sim.voxel_state import Voxels


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


def surface_of(voxels: Voxels) -> np.ndarray:
    """The surface f8[rows, cols] m: y = ymin + (j + fill) dy of the topmost cell that is not empty."""
    inner = voxels.fill[1:-1, 1:-1, 1:-1]
    levels = inner.shape[2]
    top = levels - 1 - np.argmax(inner[:, :, ::-1] > 0.0, axis=2)
    fill = np.take_along_axis(inner, top[:, :, None], axis=2)[:, :, 0]
    return np.where(fill > 0.0, voxels.bottom + (top + fill) * voxels.dy, voxels.bottom)


def normals_of(surface: np.ndarray, cell: float) -> np.ndarray:
    """Unit normals f8[rows, cols, 3] (east, north, up) of a surface: the mean of those of the facets around a point.

    A facet joins four neighbouring columns; its normal is the cross product of its diagonals.
    """
    south_west, south_east, north_west, north_east = (
        np.pad(surface, 1, mode="edge")[r : r + surface.shape[0] + 1, c : c + surface.shape[1] + 1]
        for r in (0, 1)
        for c in (0, 1)
    )
    rising, falling = north_east - south_west, north_west - south_east
    facets = np.stack(
        [(falling - rising) * cell, -(rising + falling) * cell, np.full_like(rising, 2 * cell**2)], axis=2
    )
    facets /= np.linalg.norm(facets, axis=2, keepdims=True)
    mean = facets[:-1, :-1] + facets[1:, :-1] + facets[:-1, 1:] + facets[1:, 1:]
    return mean / np.linalg.norm(mean, axis=2, keepdims=True)


@entry
def position_on_surface(surface: np.ndarray, cell: float, x: float, y: float) -> float:
    """GetPositionOnSurface: the surface's height [m] at any point [m], bilinear between the columns' centres."""
    return ground_at(surface, cell, x, y, 0.0, 0.0, 0.0)


def slope_on_surface(surface: np.ndarray, cell: float, x: float, y: float) -> tuple[float, float]:
    """Slopes to the east and to the north at any point [m], from the normals, interpolated likewise."""
    normals = normals_of(np.asarray(surface, np.float64), cell)
    east, north, up = (
        position_on_surface(np.ascontiguousarray(part), cell, x, y) for part in np.moveaxis(normals, 2, 0)
    )
    return -east / up, -north / up
