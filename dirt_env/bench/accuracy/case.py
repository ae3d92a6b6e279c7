"""A problem at one resolution: where it starts, and the exact or named answer it should end at."""

from collections.abc import Callable
from math import pi, radians, tan
from typing import NamedTuple

import numpy as np

from dirt_env.sim.params import Grid

SITE = 32.0  # m, side of every site
SLOPE = tan(radians(35.0))
PARTS = 8  # samples along each side of a cell for its average
STRIP = 32  # rows of cells averaged at once


class Case(NamedTuple):
    """Initial state and answer; heights f8[rows, cols] m.

    `exact` are cell averages. `scale` [m of one cell] is what the L1 error is divided by: the soil of a pile, or what
    is moved in a scene. `slope` is the tangent of repose. `solid` bool[rows, cols]: no soil enters. `outside` [m]:
    level of the ground beyond an open border; None is a wall. `pours`: (x, y, volume) [m, m, m3], poured one after the
    other, through a spout of radius `spout` m; each in `rounds` equal portions by a method whose soil falls faster than
    it slumps. `lines` f8[n, 8]: a blade, see `sim.drag`. `centre` (x, y, level) [m]: where a
    pile should be round, and the height at which that is measured. `seen` bool[rows, cols]: cells that count (None:
    all). `sweeps`: do that many, and no more.
    """

    grid: Grid
    start: np.ndarray
    exact: np.ndarray
    scale: float
    slope: float = SLOPE
    solid: np.ndarray | None = None
    outside: float | None = None
    pours: tuple[tuple[float, float, float], ...] = ()
    spout: float = 1.0
    rounds: int = 1
    lines: np.ndarray | None = None
    centre: tuple[float, float, float] | None = None
    seen: np.ndarray | None = None
    sweeps: int | None = None


class Problem(NamedTuple):
    """`make(cells)` returns the Case with that many cells along the site.

    `kind` says what a method has to do: "settle", "drain" (settle, over an open border), "pour once", "pour", "drag"
    (a blade), or so many explicit steps of any rule ("sweep") or of this one ("flux"). `truth`
    names the reference. `cells`: resolutions at which the answer is to be had; `long` is the largest for methods that
    sweep the ground explicitly.
    """

    name: str
    title: str
    kind: str
    truth: str
    make: Callable[[int], Case]
    cells: tuple[int, ...] = (32, 64, 128, 256, 512, 1024)
    long: int = 256


def site(cells: int, rows: int | None = None) -> Grid:
    """The raster of a site with `cells` columns; square unless `rows` says otherwise."""
    return Grid(rows or cells, cells, SITE / cells)


def averages(formula: Callable, grid: Grid) -> np.ndarray:
    """Cell averages f8[rows, cols] of `formula(x, y)` [m], from 8 x 8 samples in each cell."""
    result = np.empty((grid.rows, grid.cols))
    x = (np.arange(grid.cols * PARTS) + 0.5)[None, :] * grid.cell / PARTS
    for first in range(0, grid.rows, STRIP):
        last = min(first + STRIP, grid.rows)
        y = (np.arange(first * PARTS, last * PARTS) + 0.5)[:, None] * grid.cell / PARTS
        fine = np.broadcast_to(formula(x, y), (y.size, x.size))
        result[first:last] = fine.reshape(last - first, PARTS, grid.cols, PARTS).mean(axis=(1, 3))
    return result


def coarsened(height: np.ndarray, cells: int) -> np.ndarray:
    """Averages of a finer map [n, m] over cells of which there are `cells` in a row; n and m are multiples."""
    part = height.shape[1] // cells
    return height.reshape(height.shape[0] // part, part, cells, part).mean(axis=(1, 3))


def total(height: np.ndarray, grid: Grid) -> float:
    """Volume over the datum [m3]."""
    return float(height.sum()) * grid.cell**2


def moved(start: np.ndarray, exact: np.ndarray) -> float:
    """Soil that lies elsewhere in the end [m of one cell]: half the sum of all changes of height."""
    return float(np.abs(exact - start).sum()) / 2


def cone_height(volume: float, slope: float = SLOPE) -> float:
    """Height of a free cone [m]: V = pi H^3 / (3 k^2)."""
    return (3 * slope**2 * volume / pi) ** (1 / 3)
