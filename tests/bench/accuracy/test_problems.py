"""Every exact answer by an independent check: the volume that a formula gives, a limit, another way to compute it."""

from heapq import heappop, heappush
from math import cbrt, hypot, pi, sqrt

import numpy as np
import pytest

from dirt_env.bench.accuracy import berms, piles, smooth, tables, trenches
from dirt_env.bench.accuracy.case import SITE, SLOPE, averages, cone_height, site, total
from dirt_env.bench.accuracy.catalogue import PROBLEMS
from dirt_env.sim.diagnostics import steepest
from dirt_env.sim.laws import RATE

COMPUTED = ("trench-spoil", "trench-spoil-at-once")
POURED = ("dump", "dump-on-a-slope", "several-sources", "scattered-dumps")
STILL = [name for name, problem in PROBLEMS.items() if problem.kind == "settle" and name not in COMPUTED]


@pytest.mark.parametrize("name", STILL)
def test_soil_that_settles_keeps_its_volume_and_ends_at_repose(name):
    case = PROBLEMS[name].make(64)
    assert case.exact.sum() == pytest.approx(case.start.sum(), abs=2e-3 * case.scale)
    assert steepest(case.exact, case.grid.cell) <= case.slope * 1.0001
    assert steepest(case.start, case.grid.cell) > 2 * case.slope
    assert case.exact.max() <= case.start.max()


@pytest.mark.parametrize("name", POURED)
def test_what_is_poured_lies_there_in_the_end(name):
    case = PROBLEMS[name].make(64)
    poured = sum(volume for *_, volume in case.pours)
    assert total(case.exact - case.start, case.grid) == pytest.approx(poured, rel=3e-3)
    assert (case.exact >= case.start).all()
    assert steepest(case.exact, case.grid.cell) <= case.slope * 1.04  # kinks between heaps


@pytest.mark.parametrize(("name", "share"), [("column-collapse", 1), ("cone-at-a-wall", 2), ("cone-in-a-corner", 4)])
def test_cones_are_whole_half_and_a_quarter(name, share):
    case = PROBLEMS[name].make(128)
    high = case.exact.max() + SLOPE * case.grid.cell * 0.765  # mean distance from a corner of a square: 0.765 sides
    assert total(case.exact, case.grid) == pytest.approx(pi * high**3 / (3 * SLOPE**2) / share, rel=0.02)
    foot = np.argwhere(case.exact > 0).max(axis=0) * case.grid.cell
    assert (foot < SITE - 2.0).all()


def test_a_plateau_shrinks_to_a_tip_at_the_root_of_three_and_stays_where_the_cylinder_is_flat():
    radius = 6.0
    assert piles.plateau_radius(radius, sqrt(3) * SLOPE * radius) == pytest.approx(0.0, abs=1e-9)
    assert piles.plateau_radius(radius, 1e-6) == pytest.approx(radius, abs=1e-5)
    tall, flat = 4.0, piles.plateau_radius(radius, 4.0)
    shells = np.linspace(0, flat + tall / SLOPE, 200001)
    height = np.clip(tall - SLOPE * (shells - flat), 0, tall)
    assert np.trapezoid(2 * pi * shells * height, shells) == pytest.approx(pi * radius**2 * tall, rel=1e-8)


def test_wedges_have_the_height_of_their_area():
    case = piles.wedge(512)
    assert case.exact.max() == pytest.approx(sqrt(8.0 * SLOPE), abs=SLOPE * case.grid.cell)
    case = berms.wedge_at_a_blade(512)
    assert case.exact.sum() == pytest.approx(case.start.sum(), rel=1e-4)
    assert case.exact.max() == pytest.approx(sqrt(2 * 4.0 * SLOPE), abs=SLOPE * case.grid.cell)
    assert case.exact[:, :256].max() == 0


@pytest.mark.parametrize("make", [berms.berm_at_a_cell, berms.berm_between_cells])
def test_a_berm_holds_what_lay_on_its_way(make):
    case = make(128)
    assert case.exact.sum() == pytest.approx(case.start.sum(), rel=1e-4)
    way = case.lines[-1][0]
    assert (case.exact[0, : int(way / case.grid.cell)] == 0).all()
    assert case.scale * case.grid.cell**2 == pytest.approx(berms.LAYER * way * case.grid.rows * case.grid.cell)
    assert case.lines[0][0] == 0.0
    assert np.diff(case.lines[:, 0]).max() <= 0.5 * case.grid.cell + 1e-12
    assert (berms.berm_between_cells(128).lines[-1][0] / case.grid.cell) % 1 == pytest.approx(0.5)


def test_wide_and_narrow_trenches_meet_where_the_ramps_do():
    deep = 2.0
    wide = deep / SLOPE
    ramps = trenches._trench(64, wide, deep, lambda away: np.clip(SLOPE * (away - wide / 2) - deep / 2, -deep, 0.0))
    notch = trenches._trench(64, wide, deep, lambda away: np.minimum(SLOPE * away - sqrt(wide * deep * SLOPE), 0.0))
    np.testing.assert_allclose(ramps.exact, notch.exact, atol=1e-12)


def test_one_step_of_the_projection_is_a_projection():
    case = trenches.wide_trench(64)  # along a channel it moves soil as far as a slow relaxation does
    height = trenches.projected(case.start, case.grid.cell, iterations=600)
    assert np.abs(height - case.exact).sum() / case.scale < 0.01
    assert height.sum() == pytest.approx(case.start.sum(), abs=1e-9)
    np.testing.assert_allclose(trenches.projected(height, case.grid.cell, iterations=50), height, atol=1e-3)
    ground = np.random.default_rng(0).normal(0.0, 1.0, (12, 13))
    nearest = trenches.projected(ground, 0.5, iterations=2000)
    over_x, over_y = np.diff(nearest, axis=1)[:-1], np.diff(nearest, axis=0)[:, :-1]
    assert np.hypot(over_x, over_y).max() <= SLOPE * 0.5 * 1.001
    for other in (np.full(ground.shape, ground.mean()), 0.5 * (nearest + ground.mean())):  # also nowhere steep
        assert ((other - ground) * (nearest - ground)).sum() >= ((nearest - ground) ** 2).sum() - 1e-6


@pytest.mark.slow
def test_both_references_of_the_trench_keep_the_volume_and_differ():
    slow, once = trenches.trench_slow(64), trenches.trench_at_once(64)
    for case in (slow, once):
        assert case.exact.sum() == pytest.approx(case.start.sum(), abs=1e-6)
        assert steepest(case.exact, case.grid.cell) < SLOPE * 1.01
        np.testing.assert_allclose(case.exact, case.exact[::-1], atol=0.02)
    assert 0.05 < np.abs(slow.exact - once.exact).sum() / slow.scale < 0.2


def test_the_way_out_of_an_empty_table_is_straight():
    x, y = np.meshgrid(np.linspace(0.3, 31.7, 23), np.linspace(0.3, 31.7, 17))
    nearest = np.minimum.reduce([x, SITE - x, y, SITE - y])
    np.testing.assert_allclose(tables.way_out(x, y, 0.25, ()), nearest + 0.25)


def test_the_way_out_round_obstacles_is_the_shortest_on_a_fine_graph():
    """Dijkstra over knight's and camel's moves on points half a metre apart: longer by at most 1.4 %."""
    n, step = 65, 0.5
    moves = [(a, b) for a in range(-3, 4) for b in range(-3, 4) if (a, b) != (0, 0) and np.gcd(a, b) == 1]
    inside = np.zeros((n, n), bool)
    for west, south, east, north in tables.OBSTACLES:
        x, y = np.arange(n) * step, np.arange(n)[:, None] * step
        inside |= (x > west) & (x < east) & (y > south) & (y < north)
    away = np.full((n, n), np.inf)
    away[[0, -1]] = away[:, [0, -1]] = 0.0
    queue = [(0.0, r, c) for r, c in np.argwhere(away == 0)]
    while queue:
        so_far, r, c = heappop(queue)
        for a, b in moves:
            i, j = r + a, c + b
            if not (0 <= i < n and 0 <= j < n) or inside[i, j] or so_far > away[r, c]:
                continue
            length = so_far + step * hypot(a, b)
            if length < away[i, j] - 1e-12 and not any(
                tables.crosses(box, c * step, r * step, j * step, i * step) for box in tables.OBSTACLES
            ):
                away[i, j] = length
                heappush(queue, (length, i, j))
    y, x = np.mgrid[0:n, 0:n] * step
    exact = tables.way_out(x, y, 0.0)
    free = ~inside
    assert (away[free] >= exact[free] - 1e-9).all()
    assert (away[free] <= 1.014 * exact[free] + 1e-9).all()
    assert (exact > tables.way_out(x, y, 0.0, ()) + 1.0).sum() > 100  # obstacles matter


def test_sources_far_apart_grow_as_cones_on_their_own():
    alone = cone_height(20.0)
    heights = piles.source_heights(256, ((8.0, 8.0, 1.0), (24.0, 24.0, 1.0)), 40.0, 100)
    np.testing.assert_allclose(heights, alone, rtol=2e-3)
    twins = piles.source_heights(256, ((15.0, 16.0, 1.0), (17.0, 16.0, 1.0)), 40.0, 100)
    assert twins[0] == pytest.approx(twins[1], rel=1e-3)
    assert alone < twins[0] < cbrt(2) * alone  # they share ground, and are less than one heap


def test_bisection_pours_the_cone():
    grid = site(128)
    height = piles.poured(np.zeros((128, 128)), grid, [(16.0, 16.0, 100.0)])
    exact = averages(piles.cone(16.0, 16.0, cone_height(100.0)), grid)
    assert np.abs(height - exact).sum() / exact.sum() < 2e-3
    assert total(height, grid) == pytest.approx(100.0, rel=1e-9)


def test_a_wave_decays_as_repeated_averages_do():
    case = smooth.linear_mode(32)
    height = case.start.copy()
    for _ in range(case.sweeps):
        padded = np.pad(height, 1, mode="edge")
        around = padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]
        height = height + RATE * (around - 4 * height)
    np.testing.assert_allclose(height, case.exact, atol=1e-13)
    assert 1e-3 < np.abs(case.exact).max() < 0.5


def test_the_flux_of_a_smooth_ground_has_the_divergence_that_small_differences_give():
    cells, step = 32, 1e-4
    case = smooth.manufactured(cells)

    def ground(x, y):
        return 2 * x + 0.2 * np.sin(2 * pi * x) * np.cos(2 * pi * y)

    def flux(x, y):
        h_x = (ground(x + step, y) - ground(x - step, y)) / (2 * step)
        h_y = (ground(x, y + step) - ground(x, y - step)) / (2 * step)
        share = smooth._share(np.hypot(h_x, h_y), case.slope)
        return share * h_x, share * h_y

    x, y = np.meshgrid((np.arange(cells) + 0.5) / cells, (np.arange(cells) + 0.5) / cells)
    divergence = (flux(x + step, y)[0] - flux(x - step, y)[0] + flux(x, y + step)[1] - flux(x, y - step)[1]) / (
        2 * step
    )
    added = (case.exact - case.start) / (RATE * case.grid.cell**2)
    np.testing.assert_allclose(added, divergence, atol=1e-3 * np.abs(added).max())
    np.testing.assert_allclose(case.start, ground(x, y), atol=1e-15)
