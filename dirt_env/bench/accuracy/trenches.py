"""Problems of trenches with vertical walls, alone and with their spoil beside them."""

from functools import lru_cache
from math import sqrt

import numpy as np

from dirt_env.bench.accuracy.case import SITE, SLOPE, Case, averages, coarsened, moved, site
from dirt_env.bench.accuracy.worlds import world_of
from dirt_env.sim.advance import settle
from dirt_env.sim.params import Soil

MIDDLE = SITE / 2
FINEST = 256  # cells along the site of the references that are computed
FINE_TOLERANCE = 1e-5  # share of repose, of the slow reference
ITERATIONS = 3000  # of the projection


def _trench(cells: int, wide: float, deep: float, shape) -> Case:
    grid = site(cells, rows=4)
    start = averages(lambda x, y: np.where(np.abs(x - MIDDLE) < wide / 2, -deep, 0.0), grid)
    exact = averages(lambda x, y: shape(np.abs(x - MIDDLE)), grid)
    return Case(grid, start, exact, moved(start, exact))


def wide_trench(cells: int) -> Case:
    """A trench of width w = 8 m and depth d = 2 m, w > d / k: ramps of the slope of repose, centred on its walls."""
    wide, deep = 8.0, 2.0
    return _trench(cells, wide, deep, lambda away: np.clip(SLOPE * (away - wide / 2) - deep / 2, -deep, 0.0))


def narrow_trench(cells: int) -> Case:
    """A trench of width w = 2 m and depth d = 4 m, w < d / k: a V of depth sqrt(w d k)."""
    wide, deep = 2.0, 4.0
    depth = sqrt(wide * deep * SLOPE)
    return _trench(cells, wide, deep, lambda away: np.minimum(SLOPE * away - depth, 0.0))


def trench_and_spoil(cells: int) -> np.ndarray:
    """A trench of 20 m x 8 m, 4 m deep, and a metre beside it what was dug out, 6 m wide: f8[cells, cells] m."""
    deep, trench_wide, spoil_wide = 4.0, 8.0, 6.0

    def ground(x, y):
        along = np.abs(y - MIDDLE) < 10.0
        trench = along & (np.abs(x - 9.0) < trench_wide / 2)
        spoil = along & (np.abs(x - 17.0) < spoil_wide / 2)
        return np.where(trench, -deep, np.where(spoil, deep * trench_wide / spoil_wide, 0.0))

    return averages(ground, site(cells))


@lru_cache(maxsize=1)
def slowly_relaxed() -> np.ndarray:
    """It after a slow relaxation: explicit sweeps in float64 on the finest grid, to within 1e-5 of repose."""
    grid, soil = site(FINEST), Soil(slope=SLOPE, tolerance=FINE_TOLERANCE)
    world = world_of(trench_and_spoil(FINEST), grid, np.float64)
    settle(world, grid, soil, "explicit")
    return world.height


def projected(height: np.ndarray, cell: float, slope: float = SLOPE, iterations: int = ITERATIONS) -> np.ndarray:
    """The ground nearest to `height` (in L2, same volume) that is nowhere steeper than `slope`; float64, independent of
    `dirt_env.sim`.

    One backward Euler step of Prigozhin's model, from its dual: h = h0 - div y where y minimises
    |h0 - div y|^2 / 2 + T |y|. Forward differences, fast proximal gradient steps of 1/8 that restart when they climb.
    """
    threshold = slope * cell
    y = np.zeros((2, *height.shape))
    ahead, speed = y.copy(), 1.0
    for _ in range(iterations):
        gradient = np.zeros_like(y)
        settled = height + _divergence(ahead)
        gradient[0, :, :-1] = np.diff(settled, axis=1)
        gradient[1, :-1] = np.diff(settled, axis=0)
        trial = ahead + gradient / 8
        length = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
        new = trial * np.maximum(0.0, 1.0 - threshold / 8 / np.maximum(length, 1e-300))
        if np.vdot(ahead - new, new - y) > 0:
            speed = 1.0
        following = 0.5 * (1 + sqrt(1 + 4 * speed**2))
        ahead = new + (speed - 1) / following * (new - y)
        y, speed = new, following
    return height + _divergence(y)


def _divergence(y: np.ndarray) -> np.ndarray:
    """div y by backward differences; nothing crosses the border."""
    result = y[0] + y[1]
    result[:, 1:] -= y[0][:, :-1]
    result[1:] -= y[1][:-1]
    return result


@lru_cache(maxsize=1)
def projected_at_once() -> np.ndarray:
    """It after a single projection on what repose allows, on the finest grid.

    The mean of the projections of the ground and of its mirror images: forward differences lean to one side.
    """
    ground, cell = trench_and_spoil(FINEST), site(FINEST).cell
    mean = 0.5 * (projected(ground, cell) + projected(ground[:, ::-1], cell)[:, ::-1])
    return 0.5 * (mean + mean[::-1])  # it is the same from the north


def _trench_with_spoil(cells: int, reference: np.ndarray) -> Case:
    start, exact = trench_and_spoil(cells), coarsened(reference, cells)
    return Case(site(cells), start, exact, moved(start, exact))


def trench_slow(cells: int) -> Case:
    """Trench and spoil, held against the slow relaxation."""
    return _trench_with_spoil(cells, slowly_relaxed())


def trench_at_once(cells: int) -> Case:
    """Trench and spoil, held against the projection."""
    return _trench_with_spoil(cells, projected_at_once())
