"""Problems of heaps: columns that collapse, and soil that is poured out."""

from math import pi, sqrt

import numpy as np

from dirt_env.bench.accuracy.case import SITE, SLOPE, Case, averages, cone_height, site, total

MIDDLE = SITE / 2
SCATTERED = 100  # dumps
REACH = 8.0  # m, of one dump
ROUNDS = 32  # portions in which each of several sources pours
SOURCES = ((11.0, 13.0, 3.0), (20.0, 14.0, 2.0), (16.5, 21.0, 1.0))  # x m, y m, rate
POURED = 150.0  # m3, of all sources together


def column(x0: float, y0: float, radius: float, tall: float):
    """A cylinder of soil, as a formula of (x, y)."""
    return lambda x, y: np.where(np.hypot(x - x0, y - y0) < radius, tall, 0.0)


def cone(x0: float, y0: float, high: float, slope: float = SLOPE):
    """h = max(0, H - k dist), as a formula of (x, y)."""
    return lambda x, y: np.maximum(high - slope * np.hypot(x - x0, y - y0), 0.0)


def _collapse(cells: int, x0: float, y0: float, share: int, radius: float, tall: float) -> Case:
    """A tall cylinder, of which 1 / `share` stands on the site, becomes that share of a cone."""
    grid = site(cells)
    start = averages(column(x0, y0, radius, tall), grid)
    high = cone_height(share * total(start, grid))
    exact = averages(cone(x0, y0, high), grid)
    centre = (x0, y0, high / 2) if share == 1 else None
    return Case(grid, start, exact, float(exact.sum()), centre=centre)


def column_collapse(cells: int) -> Case:
    """A cylinder of 4 m radius, 28 m high (more than sqrt(3) k R): a cone, V = pi H^3 / (3 k^2), 25 m across."""
    return _collapse(cells, MIDDLE, MIDDLE, 1, 4.0, 28.0)


def cone_at_a_wall(cells: int) -> Case:
    """Half of it, at the border: half a cone."""
    return _collapse(cells, 0.0, MIDDLE, 2, 4.0, 28.0)


def cone_in_a_corner(cells: int) -> Case:
    """A quarter of it, in a corner: a quarter of a cone."""
    return _collapse(cells, 0.0, 0.0, 4, 4.0, 28.0)


def plateau_radius(radius: float, tall: float, slope: float = SLOPE) -> float:
    """Radius a [m] of the plateau that a collapsed cylinder keeps, from the volume of the frustum of foot a + H / k."""
    wide = tall / slope
    return (-3 * wide + sqrt(36 * radius**2 - 3 * wide**2)) / 6


def frustum(cells: int) -> Case:
    """A cylinder of 6 m radius, 4 m high (at most sqrt(3) k R): a frustum."""
    grid, tall = site(cells), 4.0
    start = averages(column(MIDDLE, MIDDLE, 6.0, tall), grid)
    flat = plateau_radius(sqrt(total(start, grid) / (pi * tall)), tall)

    def shape(x, y):
        return np.clip(tall - SLOPE * (np.hypot(x - MIDDLE, y - MIDDLE) - flat), 0.0, tall)

    exact = averages(shape, grid)
    return Case(grid, start, exact, float(exact.sum()), centre=(MIDDLE, MIDDLE, tall / 2))


def wedge(cells: int) -> Case:
    """A strip of soil across a channel, 2 m wide and 4 m high: a wedge, H = sqrt(A k)."""
    grid = site(cells, rows=4)
    start = averages(lambda x, y: np.where(np.abs(x - MIDDLE) < 1.0, 4.0, 0.0), grid)
    high = sqrt(total(start, grid) / (grid.rows * grid.cell) * SLOPE)
    exact = averages(lambda x, y: np.maximum(high - SLOPE * np.abs(x - MIDDLE), 0.0), grid)
    return Case(grid, start, exact, float(exact.sum()))


def dump(cells: int) -> Case:
    """1407 m3 poured out at one point of level ground: the same cone."""
    grid, volume = site(cells), 448.0 * pi
    high = cone_height(volume)
    exact = averages(cone(MIDDLE, MIDDLE, high), grid)
    pours = ((MIDDLE, MIDDLE, volume),)
    centre = (MIDDLE, MIDDLE, high / 2)
    return Case(grid, np.zeros(exact.shape), exact, volume / grid.cell**2, pours=pours, spout=4.0, centre=centre)


def dump_on_a_slope(cells: int) -> Case:
    """100 m3 poured out on a plane of slope s: h = max(h0, c - k dist), V = pi H^3 / (3 k^2 (1 - s^2/k^2)^1.5)."""
    grid, volume, steep, x0 = site(cells), 100.0, 0.4, 18.0
    high = cone_height(volume * (1 - (steep / SLOPE) ** 2) ** 1.5)
    ground = averages(lambda x, y: steep * x + 0 * y, grid)
    peak = steep * x0 + high
    exact = averages(
        lambda x, y: np.maximum(steep * x, peak - SLOPE * np.hypot(x - x0, y - MIDDLE)),
        grid,
    )
    return Case(grid, ground, exact, volume / grid.cell**2, pours=((x0, MIDDLE, volume),), spout=0.5, rounds=32)


def poured(ground: np.ndarray, grid, pours) -> np.ndarray:
    """h = max(h0, c - k dist) for each of `pours` in turn, at the cells' centres; c by bisection on the volume.

    A pile reaches no farther than `REACH` m.
    """
    height = ground.copy()
    x, y = (np.arange(grid.cols) + 0.5) * grid.cell, (np.arange(grid.rows) + 0.5) * grid.cell
    for x0, y0, volume in pours:
        part = np.ix_(np.abs(y - y0) < REACH, np.abs(x - x0) < REACH)
        away = SLOPE * np.hypot(x[None, :] - x0, y[:, None] - y0)[part]
        low, high = float((height[part] + away).min()), float((height[part] + away).min()) + volume / grid.cell**2
        for _ in range(60):
            level = 0.5 * (low + high)
            added = np.maximum(level - away - height[part], 0.0).sum() * grid.cell**2
            low, high = (level, high) if added < volume else (low, level)
        height[part] = np.maximum(height[part], level - away)
    return height


def scattered_dumps(cells: int) -> Case:
    """100 dumps of 0.5 to 4 m3 one after the other: the same by bisection, on cells of a quarter of the size."""
    generator = np.random.default_rng(0)
    places = generator.uniform(4.0, SITE - 4.0, (SCATTERED, 2))
    sizes = generator.uniform(0.5, 4.0, SCATTERED)
    pours = tuple((float(x), float(y), float(size)) for (x, y), size in zip(places, sizes, strict=True))
    grid, fine = site(cells), site(4 * cells)
    exact = poured(np.zeros((fine.rows, fine.cols)), fine, pours).reshape(cells, 4, cells, 4).mean(axis=(1, 3))
    return Case(grid, np.zeros(exact.shape), exact, float(exact.sum()), pours=pours, spout=0.5, rounds=8)


def source_heights(cells: int, sources=SOURCES, volume: float = POURED, steps: int = 200) -> np.ndarray:
    """Heights H_i [m] of several sources: dH_i/dt = f_i / area_i, where area_i is what cone i covers.

    Aronsson, Evans and Wu, *Fast/slow diffusion and growing sandpiles*, 1996. Midpoint rule in H^3, in which a lone
    cone grows evenly; areas by counting points of a square of `cells` x `cells`.
    """
    x = (np.arange(cells) + 0.5) * SITE / cells
    away = np.stack([SLOPE * np.hypot(x[None, :] - x0, x[:, None] - y0) for x0, y0, _ in sources])
    rates = np.array([rate for *_, rate in sources])
    flows = rates / rates.sum() * volume

    def growth(cubes: np.ndarray) -> np.ndarray:
        heights = np.cbrt(cubes)
        surface = heights[:, None, None] - away
        owner = surface.argmax(axis=0)
        covered = surface.max(axis=0) > 0
        areas = np.array([(covered & (owner == i)).sum() for i in range(len(rates))]) * (SITE / cells) ** 2
        return 3 * heights**2 * flows / areas

    cubes = (cone_height(1.0) ** 3) * flows / 50.0  # the first fiftieth of the time: they have not met yet
    for _ in range(steps):
        step = (1.0 - 1.0 / 50.0) / steps
        cubes = cubes + step * growth(cubes + 0.5 * step * growth(cubes))
    return np.cbrt(cubes)


def several_sources(cells: int) -> Case:
    """Three sources that pour at 3 : 2 : 1 and meet: h = max(H_i - k d_i), dH_i/dt = f_i / area_i."""
    grid = site(cells)
    heights = source_heights(256)
    formulas = [cone(x0, y0, high) for (x0, y0, _), high in zip(SOURCES, heights, strict=True)]
    exact = averages(lambda x, y: np.maximum.reduce([formula(x, y) for formula in formulas]), grid)
    share = POURED / ROUNDS / sum(rate for *_, rate in SOURCES)
    pours = tuple((x0, y0, share * rate) for _ in range(ROUNDS) for x0, y0, rate in SOURCES)
    return Case(grid, np.zeros(exact.shape), exact, float(exact.sum()), pours=pours, spout=0.5)
