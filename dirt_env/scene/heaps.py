"""Loose soil on the ground: a heap of a volume at repose, a layer at repose along its rim."""

from math import floor, pi

import numpy as np

from dirt_env.scene.distance import around, distance_outside
from dirt_env.sim.params import Grid

FAR = 1e9  # m; stands for no outside at all


def cone_radius(volume: float, slope: float) -> float:
    """Radius of a free cone at repose, m: r = (3 V / (pi k))^(1/3)."""
    return (3 * volume / (pi * slope)) ** (1 / 3) if slope > 0 else np.inf


def heap(
    height: np.ndarray, grid: Grid, source: tuple[float, float], volume: float, slope: float, solid=None
) -> np.ndarray:
    """The ground after `volume` m3 were poured out at `source` (x, y) m: max(h, c - k dist), level c by the volume.

    Exact to rounding on ground no steeper than k, also beside the site's border, which holds the soil back. Solid
    cells, and cells that they hide from the source, take none. Returns a new array [rows, cols].
    """
    reach = 1.25 * cone_radius(volume, slope) + 2 * grid.cell
    while True:
        window = _within(grid, source, reach)
        floor_level = _flooding_level(height[window], grid, window, source, slope, solid)
        level = _level(floor_level, volume / grid.cell**2)
        if not _leaves(level > floor_level, window, height.shape):
            break
        reach *= 2
    result = height.copy()
    result[window] += np.maximum(level - floor_level, 0.0)
    return result


def heap_limit(height: np.ndarray, grid: Grid, source: tuple[float, float], slope: float, region, solid=None) -> float:
    """The largest heap at `source` whose foot stays inside `region` (bool [rows, cols]), m3."""
    window = around(region)
    inside = region[window]
    floor_level = _flooding_level(height[window], grid, window, source, slope, solid)
    level = floor_level[~inside].min(initial=np.inf)
    if not np.isfinite(level):
        return np.inf
    return float(np.maximum(level - floor_level, 0.0).sum() * grid.cell**2)


def layer(region: np.ndarray, grid: Grid, depth: float, slope: float, solid=None) -> np.ndarray:
    """Thickness of a layer of `depth` m over a region, m [rows, cols]: min(depth, k dist to the outside).

    Its rim lies at repose, except along the border of the site and along solid cells, which hold it.
    """
    window = around(region)
    inside = region[window]
    rim = _grown(inside) & ~inside
    if solid is not None:
        rim &= ~solid[window]
    result = np.zeros(region.shape)
    away = np.minimum(distance_outside(rim, grid.cell), FAR)
    result[window] = np.where(inside, np.minimum(depth, slope * away), 0.0)
    return result


def capacity(region: np.ndarray, grid: Grid, slope: float, solid=None) -> float:
    """The most that a region holds at repose on level ground, m3: sum(k dist(to the outside)) cell^2."""
    return float(layer(region, grid, np.inf, slope, solid).sum() * grid.cell**2)


def _grown(mask: np.ndarray) -> np.ndarray:
    """The mask and the eight neighbours of each of its cells."""
    for axis in (0, 1):
        before, after = np.roll(mask, 1, axis), np.roll(mask, -1, axis)
        before[(slice(None),) * axis + (0,)] = False
        after[(slice(None),) * axis + (-1,)] = False
        mask = mask | before | after
    return mask


def _within(grid: Grid, source: tuple[float, float], reach: float) -> tuple[slice, slice]:
    """Cells up to `reach` m from the source, cut to the map."""
    spans = []
    for centre, length in ((source[1], grid.rows), (source[0], grid.cols)):
        first = max(0, floor(max(centre - reach, 0.0) / grid.cell))
        last = min(length, floor(min((centre + reach) / grid.cell, length)) + 1)
        spans.append(slice(first, last))
    return spans[0], spans[1]


def _leaves(filled: np.ndarray, window: tuple[slice, slice], shape: tuple[int, ...]) -> bool:
    """Whether the filled cells reach a side of the window beyond which the map goes on."""
    return any(
        (part.start > 0 and along[0].any()) or (part.stop < length and along[-1].any())
        for part, length, along in zip(window, shape, (filled, filled.T), strict=True)
    )


def _flooding_level(ground, grid: Grid, window, source, slope: float, solid) -> np.ndarray:
    """The source's level at which each cell of the window begins to fill: h + k dist; inf where no soil gets to."""
    y = (np.arange(window[0].start, window[0].stop)[:, None] + 0.5) * grid.cell - source[1]
    x = (np.arange(window[1].start, window[1].stop)[None, :] + 0.5) * grid.cell - source[0]
    result = ground + slope * np.hypot(x, y)
    if solid is not None and solid[window].any():
        result[_hidden(solid, grid, window, source)] = np.inf
    return result


def _hidden(solid: np.ndarray, grid: Grid, window, source: tuple[float, float]) -> np.ndarray:
    """Cells of the window that are solid, or behind a solid cell as seen from the source (a look every half cell)."""
    row = np.arange(window[0].start, window[0].stop)[:, None] + 0.5
    col = np.arange(window[1].start, window[1].stop)[None, :] + 0.5
    row0, col0 = source[1] / grid.cell, source[0] / grid.cell
    hidden = solid[window].copy()
    steps = int(2 * max(np.abs(row - row0).max(), np.abs(col - col0).max())) + 1
    for share in np.linspace(0.0, 1.0, steps + 1)[:-1]:
        at_row = np.minimum((row0 + share * (row - row0)).astype(int), solid.shape[0] - 1)
        at_col = np.minimum((col0 + share * (col - col0)).astype(int), solid.shape[1] - 1)
        hidden |= solid[at_row, at_col]
    return hidden


def _level(floor_level: np.ndarray, wanted: float) -> float:
    """The level c with sum(max(0, c - floor_level)) = wanted [m, summed over cells].

    Newton from above on a convex, piecewise linear function: it ends after finitely many steps.
    """
    level = floor_level.min() + wanted
    if not np.isfinite(level):
        raise ValueError("a heap stands on a solid cell; allowed: a source on open ground")
    while True:
        below = floor_level[floor_level < level]
        if not below.size:
            return float(level)
        following = (wanted + below.sum()) / below.size
        if following >= level:
            return float(level)
        level = following
