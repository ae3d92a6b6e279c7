"""Problems of soil against a blade across a channel, whose heap is known in closed form."""

from math import sqrt

import numpy as np

from dirt_env.bench.accuracy.case import SITE, SLOPE, Case, averages, site
from dirt_env.sim.blade import Line

LAYER = 0.3  # m
WAY = 10.0  # m
TALL = 8.0  # m, of a blade that nothing goes over
STRIDE = 0.5  # cells


def line(x: float, y: float, grid, width: float = 4 * SITE, edge: float = 0.0, height: float = TALL) -> Line:
    """A blade that faces east; by default it closes the whole channel."""
    return Line(x, y, 1.0, 0.0, 0.5 * width, edge, 0.0, height)


def eastward(begin: float, end: float, grid, **blade) -> np.ndarray:
    """Lines of a blade that moves east [m], half a cell at a time at most: f8[n, 8]."""
    pieces = max(int(np.ceil((end - begin) / (STRIDE * grid.cell) - 1e-9)), 1)
    y = 0.5 * grid.rows * grid.cell
    return np.array([line(x, y, grid, **blade) for x in np.linspace(begin, end, pieces + 1)])


def _berm(cells: int, cells_more: float) -> Case:
    grid = site(cells, rows=4)
    way = WAY + cells_more * grid.cell
    high = sqrt(2 * SLOPE * LAYER * way)
    start = np.full((grid.rows, cells), LAYER)
    exact = averages(lambda x, y: np.where(x < way, 0.0, LAYER + np.maximum(high - SLOPE * (x - way), 0.0)), grid)
    return Case(grid, start, exact, LAYER * way / grid.cell * grid.rows, lines=eastward(0.0, way, grid))


def berm_at_a_cell(cells: int) -> Case:
    """A layer t pushed by D, to a border of cells: a berm p = sqrt(2 k t D) above the layer, nothing behind."""
    return _berm(cells, 0.0)


def berm_between_cells(cells: int) -> Case:
    """The same half a cell farther on."""
    return _berm(cells, 0.5)


def wedge_at_a_blade(cells: int) -> Case:
    """A strip of soil of 4 m2 slumps against a blade that stands: p = sqrt(2 A k)."""
    grid = site(cells, rows=4)
    start = averages(lambda x, y: np.where((x > MIDDLE) & (x < MIDDLE + 1.0), 4.0, 0.0), grid)
    high = sqrt(2 * 4.0 * SLOPE)
    exact = averages(lambda x, y: np.where(x > MIDDLE, np.maximum(high - SLOPE * (x - MIDDLE), 0.0), 0.0), grid)
    standing = np.array([line(MIDDLE, 0.5 * grid.rows * grid.cell, grid)] * 2)
    return Case(grid, start, exact, float(exact.sum()), lines=standing)


MIDDLE = SITE / 2
