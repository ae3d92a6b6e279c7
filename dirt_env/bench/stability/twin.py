"""Plain numpy twins with what the library does not let you choose: the rate, rectangular cells, naive rules.

For showing where the stability limit lies and what goes wrong without care; nothing here is used by the simulator.
"""

from math import ceil, log2, sqrt

import numpy as np

from dirt_env.sim.laws import slump_share

POWER = round(
    -log2(1 - slump_share(2.0, 0.0, 1.0, 1.0))
)  # of the library's own law; at twice repose 1 - share is 2^-POWER


def slump(height: np.ndarray, rate_x: float, rate_y: float, slope: float, dx: float = 1.0, dy: float = 1.0):
    """One explicit sweep of `sim.slump`'s scheme, F = a dn share(|grad h|), on cells of dx x dy; a new array."""
    x, y = np.pad(np.diff(height, axis=1), 1), np.pad(np.diff(height, axis=0), 1)
    over_x, over_y = x[1:-1, 1:-1], y[1:-1, 1:-1]
    across_x = (y[1:, 1:-2] + y[1:, 2:-1] + y[:-1, 1:-2] + y[:-1, 2:-1]) / 4
    across_y = (x[1:-2, 1:] + x[2:-1, 1:] + x[1:-2, :-1] + x[2:-1, :-1]) / 4
    flux_x = rate_x * over_x * excess(np.hypot(over_x / dx, across_x / dy), slope)
    flux_y = rate_y * over_y * excess(np.hypot(over_y / dy, across_y / dx), slope)
    return (
        height + np.diff(np.pad(flux_x, ((0, 0), (1, 1))), axis=1) + np.diff(np.pad(flux_y, ((1, 1), (0, 0))), axis=0)
    )


def excess(steepness: np.ndarray, slope: float) -> np.ndarray:
    """Share of a difference that counts as above repose: 1 - (slope / steepness)^POWER, 0 up to repose."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(steepness > slope, 1 - (slope / steepness) ** POWER, 0.0)


def after(height: np.ndarray, sweeps: int, rate_x: float, rate_y: float, slope: float = 0.0, **cells) -> np.ndarray:
    """The ground after so many sweeps, or as soon as it is beyond all bounds."""
    for _ in range(sweeps):
        height = slump(height, rate_x, rate_y, slope, **cells)
        if np.abs(height).max() > 1e12:
            break
    return height


def checkerboard(size: int, amplitude: float) -> np.ndarray:
    """Cells that are `amplitude` m high and low by turns."""
    return amplitude * (2.0 * (np.indices((size, size)).sum(0) % 2) - 1.0)


def rkl1(height: np.ndarray, span: float, stages: int) -> np.ndarray:
    """One super-step of RKL1 without friction, worth `span` of rate 1. Meyer, Balsara, Aslam 2014."""
    weight = 2.0 / (stages**2 + stages)
    before, now = height, slump(height, weight * span, weight * span, 0.0)
    for j in range(2, stages + 1):
        share = (2 * j - 1) / j
        rate = share * weight * span
        moved = slump(now, rate, rate, 0.0) - now
        before, now = now, share * now + (1 - j) / j * before + moved
    return now


def rkl1_stages(span: float) -> int:
    """Fewest stages for which a super-step of that span is stable: (s^2 + s) / 8 >= span."""
    return max(1, ceil((sqrt(1 + 32 * span) - 1) / 2 - 1e-12))


def four_neighbours(height: np.ndarray, threshold: float, rate: float, wrap: bool = True) -> np.ndarray:
    """The naive rule: each cell gives every lower neighbour `rate` of what exceeds the threshold; a new array."""
    ground = height if wrap else np.pad(height, 1, mode="edge")
    change = np.zeros_like(ground)
    for shift, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        part = rate * np.maximum(ground - np.roll(ground, shift, axis) - threshold, 0.0)
        change += np.roll(part, -shift, axis) - part
    changed = ground + change
    return changed if wrap else changed[1:-1, 1:-1]


def rounded_blade(
    height: np.ndarray, x0: float, y0: float, heading: float, half: float, distance: float, stride: float
):
    """A blade that is rounded to cells: at each stride the cells under it give all to those ahead. Lengths in cells."""
    height = height.copy()
    ahead = np.array([np.sin(heading), np.cos(heading)])
    left = np.array([np.cos(heading), -np.sin(heading)])
    for way in np.arange(0.0, distance, stride):
        for u in np.arange(-half, half + 0.5, 1.0):
            place = np.array([y0, x0]) + way * ahead + u * left
            here, there = (tuple(np.round(place + step * ahead).astype(int)) for step in (0.0, 1.0))
            if here != there:
                height[there] += height[here]
                height[here] = 0.0
    return height
