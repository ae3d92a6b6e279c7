"""How far a result is from the answer."""

from math import pi

import numpy as np

from dirt_env.bench.accuracy.case import Case
from dirt_env.bench.accuracy.methods import Trial, exact_sum
from dirt_env.sim.diagnostics import steepest

RAYS = 360


def relative_l1(height: np.ndarray, case: Case) -> float:
    """Sum of |height - exact| over the cells that count, divided by the case's scale."""
    return float(np.abs(height - case.exact)[_seen(case)].sum()) / case.scale


def largest(height: np.ndarray, case: Case) -> float:
    """Largest |height - exact| over how far the answer departs from the datum."""
    exact = case.exact[_seen(case)]
    return float(np.abs(height[_seen(case)] - exact).max() / np.abs(exact).max())


def roundness(height: np.ndarray, case: Case) -> float | None:
    """Smallest over largest radius of a pile's contour, along 360 rays, heights bilinear between the cells' centres."""
    if case.centre is None:
        return None
    x0, y0, level = case.centre
    angles = np.arange(RAYS) * 2 * pi / RAYS
    cell = case.grid.cell
    away = np.arange(0.0, 0.5 * min(height.shape) * cell, 0.02 * cell)
    along = _bilinear(
        height, (x0 + away[:, None] * np.cos(angles)) / cell - 0.5, (y0 + away[:, None] * np.sin(angles)) / cell - 0.5
    )
    first = np.argmax(along < level, axis=0)
    if (first == 0).any():  # all lower, or all higher
        return 0.0
    rays = np.arange(RAYS)
    high, low = along[first - 1, rays], along[first, rays]
    radius = away[first - 1] + (away[1] - away[0]) * (high - level) / (high - low)
    return float(radius.min() / radius.max())


def volume_error(trial: Trial, height: np.ndarray, case: Case) -> float:
    """Soil that appeared, over the case's scale: the sums are exact, so that 0 means equal to the last bit."""
    return (exact_sum(height) + trial.gone() - trial.given) / case.scale


def errors(trial: Trial, case: Case) -> dict[str, float | None]:
    """All of them, and the largest slope over that of repose, by the name of the column."""
    height = trial.height()
    slope = steepest(height, case.grid.cell) / case.slope if case.slope > 0 and case.solid is None else None
    return {
        "rel_l1": relative_l1(height, case),
        "linf": largest(height, case),
        "roundness": roundness(height, case),
        "slope": slope,
        "volume_error": volume_error(trial, height, case),
    }


def _seen(case: Case) -> np.ndarray:
    return np.ones(case.exact.shape, bool) if case.seen is None else case.seen


def _bilinear(height: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    c, r = np.clip(column, 0, height.shape[1] - 1.001), np.clip(row, 0, height.shape[0] - 1.001)
    i, j = r.astype(int), c.astype(int)
    fy, fx = r - i, c - j
    below = (1 - fx) * height[i, j] + fx * height[i, j + 1]
    above = (1 - fx) * height[i + 1, j] + fx * height[i + 1, j + 1]
    return (1 - fy) * below + fy * above
