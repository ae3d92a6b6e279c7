"""The cutting edge: which height over the tracks holds it at a height over the datum, on the ground that will be there."""

from math import cos, sin
from typing import NamedTuple

import numpy as np

from .parameters import Parameters
from .site import Site

STATIONS = 5  # along the tracks; three across
LEAST = 0.25  # m; how much of the way ahead is looked at in any case


class Strip(NamedTuple):
    """What the blade crosses next: cells (rows, cols), metres left of its middle, and their target heights [m]."""

    rows: np.ndarray
    cols: np.ndarray
    left: np.ndarray
    target: np.ndarray


def strip_ahead(site: Site, way: float) -> Strip:
    """Cells that the blade crosses on its next `way` metres straight on."""
    cell, blade, pose = site.grid.cell, site.blade, site.pose
    reach = max(way, LEAST)
    east, north = cos(pose["heading"]), sin(pose["heading"])
    x, y = site.blade_at()
    span = reach + 0.5 * blade.width
    r0, c0 = site.cell_at(x - span, y - span)
    r1, c1 = site.cell_at(x + span, y + span)
    window = slice(r0, r1 + 1), slice(c0, c1 + 1)
    dx, dy = site.x[window] - x, site.y[window] - y
    ahead, left = dx * east + dy * north, dy * east - dx * north
    rows, cols = np.nonzero((ahead > -0.5 * cell) & (ahead <= reach) & (np.abs(left) <= 0.5 * blade.width))
    left = left[rows, cols]
    rows, cols = rows + r0, cols + c0
    return Strip(rows, cols, left, site.target[rows, cols])


def edge_for(site: Site, numbers: Parameters, way: float, rise: float, before: np.ndarray) -> float:
    """Height over the tracks [m] that puts the edge over the target of the strip ahead after a share of `way` m.

    It goes `rise` m over the target, but not over the soil to move that was there `before` (m, [row, col]).
    """
    strip = strip_ahead(site, way)
    if not len(strip.rows):
        return site.pose["edge"]
    level = float(np.quantile(strip.target, numbers.bite)) + numbers.grade
    level += min(rise, float(before[strip.rows, strip.cols].max()))
    z, pitch, roll = _plane(site, strip, level, numbers.look * way)
    return level - roll * float(strip.left.mean()) - z - pitch * site.blade.reach


def _plane(site: Site, strip: Strip, level: float, way: float) -> tuple[float, float, float]:
    """Height [m] and slopes of the ground under the tracks `way` m on, where the blade has cut the strip to `level`."""
    ground = site.height.copy()
    ground[strip.rows, strip.cols] = np.minimum(ground[strip.rows, strip.cols], level)
    pose, machine = site.pose, site.machine
    east, north = cos(pose["heading"]), sin(pose["heading"])
    s, u = (part.ravel() for part in np.meshgrid(
        machine.length * np.linspace(-0.5, 0.5, STATIONS), machine.width * np.linspace(-0.5, 0.5, 3)
    ))  # fmt: skip
    x, y = pose["x"] + (s + way) * east - u * north, pose["y"] + (s + way) * north + u * east
    h = _bilinear(ground, x / site.grid.cell - 0.5, y / site.grid.cell - 0.5)
    return float(h.mean()), float((s * h).sum() / (s * s).sum()), float((u * h).sum() / (u * u).sum())


def _bilinear(ground: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Heights between cell centres."""
    rows, cols = ground.shape
    column, row = np.clip(column, 0.0, cols - 1.001), np.clip(row, 0.0, rows - 1.001)
    c, r = column.astype(int), row.astype(int)
    fx, fy = column - c, row - r
    south = (1 - fx) * ground[r, c] + fx * ground[r, c + 1]
    north = (1 - fx) * ground[r + 1, c] + fx * ground[r + 1, c + 1]
    return (1 - fy) * south + fy * north
