"""Problems without an avalanche's end: a wave that decays, and the flux of a smooth ground."""

from math import pi, sin

import numpy as np

from dirt_env.bench.accuracy.case import Case, site
from dirt_env.sim.laws import RATE, slump_share
from dirt_env.sim.params import Grid

WAVES = (2, 3)  # half waves along x and y
SWEEPS = 200


def linear_mode(cells: int) -> Case:
    """Without friction (T = 0) a cosine decays by (1 - 4 a (sin^2(kx dx/2) + sin^2(ky dx/2)))^N."""
    grid = site(cells)
    mid = np.arange(cells) + 0.5
    across, up = (np.cos(pi * count * mid / cells) for count in WAVES)
    start = up[:, None] * across[None, :]
    decay = 1 - 4 * RATE * sum(sin(0.5 * pi * count / cells) ** 2 for count in WAVES)
    exact = start * decay**SWEEPS
    return Case(grid, start, exact, float(np.abs(exact).sum()), slope=0.0, sweeps=SWEEPS)


STEP = 1e-5  # of a slope, for the derivative of a law


def _share(steep: np.ndarray, slope: float) -> np.ndarray:
    return np.vectorize(slump_share, otypes=[float])(steep, 0.0, slope, slope)


def manufactured(cells: int) -> Case:
    """h = 2x + 0.2 sin 2 pi x cos 2 pi y on the unit square, k = 0.5.

    One sweep adds a dx^2 div(p(|grad h|) grad h), where p is the share of a difference that moves, `laws.slump_share`.
    The scale is what it adds; the two outermost cells are not counted.
    """
    grid, k, wave = Grid(cells, cells, 1.0 / cells), 0.5, 2 * pi
    x, y = (np.arange(cells)[None, :] + 0.5) / cells, (np.arange(cells)[:, None] + 0.5) / cells
    size = 0.2
    start = 2 * x + size * np.sin(wave * x) * np.cos(wave * y)
    h_x = 2 + size * wave * np.cos(wave * x) * np.cos(wave * y)
    h_y = -size * wave * np.sin(wave * x) * np.sin(wave * y)
    h_xx = h_yy = -size * wave**2 * np.sin(wave * x) * np.cos(wave * y)
    h_xy = -size * wave**2 * np.cos(wave * x) * np.sin(wave * y)
    steep = np.hypot(h_x, h_y)
    share, growth = _share(steep, k), (_share(steep + STEP, k) - _share(steep - STEP, k)) / (2 * STEP)
    along = h_x * (h_xx * h_x + h_xy * h_y) + h_y * (h_xy * h_x + h_yy * h_y)
    divergence = share * (h_xx + h_yy) + growth * along / steep
    added = RATE * grid.cell**2 * divergence
    seen = np.zeros(start.shape, bool)
    seen[2:-2, 2:-2] = True
    return Case(grid, start, start + added, float(np.abs(added[seen]).sum()), slope=k, seen=seen, sweeps=1)
