"""The blade cuts, carries, spills and holds: exact answers, exact volume, the same at any speed, yaw and direction."""

from math import hypot, pi, radians, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dirt_env.sim.blade import Line, blade_frame, box_around, held_links, load_ahead, scrape
from dirt_env.sim.diagnostics import volume
from dirt_env.sim.slump import limits
from dirt_env.sim.state import TALLY
from tests import naive
from tests.sim.worlds import FINE, SOIL, line_at, straight, sweep_blade, world_of

K = SOIL.slope
TALL = 100.0  # a blade that nothing goes over


def layer(rows, cols, depth, cell=0.5):
    """(world, grid) of level soil that is at rest."""
    world, grid = world_of(np.full((rows, cols), depth), cell)
    world.pending[:] = 0
    return world, grid


def berm(distance, stride, cell=0.5, soil=FINE, depth=0.1):
    """Ground heights of a channel after a blade as wide as it has pushed a layer, and the exact ones as cell means."""
    world, grid = layer(4, round(32 / cell), depth, cell)
    sweep_blade(world, grid, straight(0.0, 2 * cell, 0.0, distance, stride, width=100.0, height=TALL), soil)
    x = (np.arange(grid.cols * 64) + 0.5) * cell / 64
    pile = depth + np.maximum(sqrt(2 * K * depth * distance) - K * (x - distance), 0)
    exact = np.where(x < distance, 0.0, pile).reshape(grid.cols, 64).mean(1)
    return world, grid, exact


@pytest.mark.parametrize("stride", [0.25, 0.05, 0.17])
def test_a_layer_dozed_in_a_channel_stands_as_the_exact_berm_and_leaves_a_clean_track(stride):
    world, grid, exact = berm(20.0, stride)
    pushed = np.abs(exact - 0.1)[exact > 0.1].sum()
    assert np.abs(world.height[1] - exact).sum() / pushed < 0.005
    assert np.abs(world.height[:, :39]).max() == 0
    assert volume(world.height, grid.cell) == pytest.approx(4 * 64 * 0.1 * 0.25, rel=1e-4)


def test_the_berm_does_not_depend_on_the_speed_and_nothing_leaks():
    fast, _, _ = berm(20.0, 0.25)
    slow, _, _ = berm(20.0, 0.005)
    assert slow.height.sum(dtype=np.float64) == fast.height.sum(dtype=np.float64)
    assert np.abs(fast.height[1] - slow.height[1]).sum() / slow.height[1].sum() < 0.05
    for world in (fast, slow):
        assert np.abs(world.height[:, :39]).max() == 0


def pushed_load(heading, stride=0.25, direction=1):
    """Soil ahead of a 3 m blade after 10 m through a layer of 0.15 m [m3], and the world."""
    world, grid = layer(80, 80, 0.15)
    c = 20.07 - 5.0 * np.array([np.cos(heading), np.sin(heading)]) * direction
    lines = straight(c[0], c[1], heading, 10.0 * direction, stride)
    before = volume(world.height, grid.cell)
    sweep_blade(world, grid, lines)
    assert volume(world.height, grid.cell) == before
    rows, cols = np.mgrid[0:80, 0:80]
    ahead, left = naive.frame(lines[-1], (cols + 0.5) * 0.5, (rows + 0.5) * 0.5)
    front = (ahead * direction > 0) & (np.abs(left) < 1.5)
    return np.maximum(world.height - 0.15, 0)[front].sum() * 0.25, world


def test_the_load_of_a_finite_blade_is_the_same_at_any_yaw_and_speed():
    straight_load, _ = pushed_load(0.0)
    for yaw in (10, 22.5, 30, 45, 60):
        assert pushed_load(radians(yaw))[0] == pytest.approx(straight_load, rel=0.12)
    for stride in (0.1, 0.05):
        assert pushed_load(radians(30), stride)[0] == pytest.approx(pushed_load(radians(30))[0], rel=0.1)


def test_a_quarter_turn_gives_the_turned_result():
    a, b = pushed_load(0.0)[1].height, pushed_load(0.5 * pi)[1].height
    assert np.abs(a - b.T).max() < 0.02


def test_back_blading_pulls_the_soil_the_other_way():
    load, _ = pushed_load(0.0, direction=-1)
    assert load == pytest.approx(pushed_load(0.0)[0], rel=0.02)


def test_what_stands_over_the_top_goes_over_and_nothing_else_does():
    world, _ = layer(40, 40, 0.0)
    world.height[10:30, 24:28] = 2.0
    tally = np.zeros(1, TALLY)[0]
    _, _, lock = limits(world.height, world.quantum, 0.5, K, 4e-3)
    low = [line_at(x, 10.0, 0.0, width=6.0, height=0.5) for x in (12.2, 12.3)]
    scrape(world.height, None, None, *low, 0.5, lock, tally)
    crossed = world.height[14:26, 24]
    np.testing.assert_allclose(crossed, 1.5)
    assert tally.cut == pytest.approx(12 * 0.5)
    assert (world.height[:, :24] == 0).all()
    assert world.height.sum(dtype=np.float64) == 160.0


def test_a_raised_blade_lets_the_soil_under_it_be():
    world, grid = layer(40, 40, 0.2)
    before = world.height.copy()
    tally = sweep_blade(world, grid, straight(5.0, 10.0, 0.0, 8.0, 0.25, edge=0.2))
    assert tally.cut == 0
    np.testing.assert_array_equal(world.height, before)


def test_soil_flows_under_an_edge_that_is_lifted():
    held, grid = layer(30, 30, 0.0)
    held.height[:, 10:13] = 0.9
    freed = held._replace(height=held.height.copy(), pending=np.array([0, 30, 0, 30]))
    held.pending[:] = (0, 30, 0, 30)
    at = {"width": 40.0, "height": 2.0}
    sweep_blade(held, grid, [line_at(5.0, 7.5, pi, **at)] * 2)
    sweep_blade(freed, grid, [line_at(5.0, 7.5, pi, edge=0.5, **at)] * 2)
    assert held.height[:, :10].max() == 0
    assert freed.height[:, 9].min() > 0.1


def test_a_blade_at_the_wall_keeps_what_cannot_go_and_books_it():
    world, grid = layer(10, 12, 0.3)
    before = world.height.sum(dtype=np.float64)
    tally = sweep_blade(world, grid, straight(0.0, 2.5, 0.0, 5.99, 0.25, width=50.0, height=TALL))
    assert world.height.sum(dtype=np.float64) == before
    assert tally.stuck > 0
    assert world.height[:, -1].min() > 0.3


def test_soil_pushed_over_an_open_border_is_in_the_ledger():
    world, grid = world_of(np.full((10, 12), 0.3), open_border=True)
    world.pending[:] = 0
    before = world.height.sum(dtype=np.float64)
    tally = sweep_blade(world, grid, straight(0.0, 2.5, 0.0, 5.99, 0.25, width=50.0, height=TALL))
    assert tally.lost > 10
    assert world.height.sum(dtype=np.float64) + tally.lost == before


@pytest.mark.parametrize("turns", [1, 2])
def test_turning_on_the_spot_keeps_the_volume_and_comes_to_rest(turns):
    world, grid = layer(30, 30, 0.2)
    before = world.height.sum(dtype=np.float64)
    angles = np.arange(0, turns * 2 * pi, 0.2)
    lines = [line_at(7.5 + 1.5 * np.cos(a), 7.5 + 1.5 * np.sin(a), a) for a in angles]
    sweep_blade(world, grid, lines)
    assert world.height.sum(dtype=np.float64) == before
    still = world.height.copy()
    again = sweep_blade(world, grid, [lines[-1]] * 20)
    np.testing.assert_array_equal(world.height, still)
    assert again.sweeps <= 20


@given(
    x=st.floats(-2, 12), y=st.floats(-2, 12), heading=st.floats(-4, 4), way=st.floats(-6, 6), turn=st.floats(-3, 3),
    edge=st.floats(-50, 1), depth=st.sampled_from([0.0, 0.3, 2.0]),
)  # fmt: skip
def test_no_way_of_a_blade_changes_the_volume_or_makes_a_spike(x, y, heading, way, turn, edge, depth):
    world, grid = layer(20, 20, depth)
    before = world.height.sum(dtype=np.float64)
    steps = np.linspace(0, 1, 30)
    lines = [line_at(x + s * way, y + s * way / 2, heading + s * turn, edge=edge) for s in steps]
    sweep_blade(world, grid, lines)
    assert world.height.sum(dtype=np.float64) == before
    assert world.height.max() <= depth + 12.0
    assert np.isfinite(world.height).all()


def test_a_crossed_cell_gives_what_stands_between_edge_and_top_to_the_cells_ahead():
    world, _ = layer(9, 9, 0.0)
    world.height[4, 4] = 0.75
    old, new = line_at(2.2, 2.25, 0.0, edge=0.25), line_at(2.3, 2.25, 0.0, edge=0.25)
    tally = np.zeros(1, TALLY)[0]
    _, _, lock = limits(world.height, world.quantum, 0.5, K, 4e-3)
    scrape(world.height, None, None, old, new, 0.5, lock, tally)
    # Put down 0.75 cells ahead, bilinear between cell 4, which is behind the blade by now, and cell 5: all of it in 5.
    assert world.height[4, 4] == 0.25
    assert world.height[4, 5] == 0.5
    assert tally.cut == 0.5


def test_soil_does_not_go_through_the_corner_between_two_solid_cells():
    at = line_at(2.2, 2.2, 0.25 * pi), line_at(2.3, 2.3, 0.25 * pi)
    for solid_cells, goes in (([(4, 5), (5, 4)], False), ([(4, 5)], True), ([(5, 5)], True)):
        world, _ = layer(9, 9, 0.0)
        world.height[4, 4] = 0.75
        solid = np.zeros((9, 9), bool)
        solid[tuple(np.transpose(solid_cells))] = True
        _, _, lock = limits(world.height, world.quantum, 0.5, K, 4e-3)
        scrape(world.height, solid, None, *at, 0.5, lock, tally := np.zeros(1, TALLY)[0])
        assert (world.height[4, 4] == 0.0) == goes
        assert (tally.stuck == 0.0) == goes
        assert not world.height[solid].any()
        assert world.height.sum(dtype=np.float64) == 0.75


@pytest.mark.parametrize("heading", np.linspace(-3.0, 3.0, 7))
def test_the_box_around_a_blade_holds_every_link_it_crosses(heading):
    blade = line_at(5.3, 4.9, heading)
    r0, r1, c0, c1 = box_around(blade, 0.5)
    links = list(naive.blocked_links((20, 20), 0.5, blade))
    assert len(links) > 4
    for along_x, r, c, _, _ in links:
        assert r0 <= r < r1
        assert c0 <= c < c1
        assert along_x in (0, 1)


def closed_links(blade, n, ground=0.0):
    """(along x, row, column) of the links of a map of n x n cells of 0.5 m that the kernel closes."""
    world, _ = layer(n, n, ground)
    count, _, _ = held_links(world.height, blade, 0.5, 0.3, 0.3, world.links, world.link_levels)
    return sorted((along_x, r, c) for r, c, along_x in world.links[:count].tolist())


@pytest.mark.parametrize("eighth", range(-4, 5))
def test_a_blade_on_centres_and_borders_of_cells_closes_what_it_crosses(eighth):
    for x in np.arange(3.0, 4.6, 0.125):
        for y in (3.0, 3.125, 3.25, 3.75, 4.1):
            for width in (3.0, 2.0):
                blade = line_at(x, y, 0.25 * pi * eighth, width=width, edge=-0.1)
                assert closed_links(blade, 16) == sorted(link[:3] for link in naive.blocked_links((16, 16), 0.5, blade))


def test_a_blade_that_hangs_above_both_cells_of_a_link_does_not_close_it():
    at = 4.0, 4.0, 0.3
    crossed = closed_links(line_at(*at, edge=-0.01), 16)
    assert len(crossed) > 6
    assert closed_links(line_at(*at, edge=0.01), 16) == []
    assert closed_links(line_at(*at, edge=0.29), 16, ground=0.3) == crossed
    world, _ = layer(16, 16, 0.0)
    world.height[:, 8:] = 0.5  # a step of the ground, which the blade stands along
    blade = line_at(4.1, 4.0, 0.0, edge=0.45, roll=0.1)
    held, _, _ = held_links(world.height, blade, 0.5, 0.3, 0.3, world.links, world.link_levels)
    twin = naive.held_links(world.height, 0.5, blade)
    assert sorted(world.links[:held, [2, 0, 1]].tolist()) == sorted(list(link[:3]) for link in twin)
    assert 0 < held < len(list(naive.blocked_links((16, 16), 0.5, blade)))


def test_a_blade_along_the_cells_closes_nothing_beyond_its_ends():
    world, _ = layer(128, 128, 0.0)
    for quarter in range(-2, 3):
        for turn in (0.0, 1e-16, -1e-12, 1e-9, -1e-7, 1e-6):
            for ulps in range(-3, 4):
                at = 16.25 + ulps * np.spacing(16.25)  # on a centre, or nearly so
                blade = line_at(at, at, 0.5 * pi * quarter + turn, edge=-0.1)
                held, _, _ = held_links(world.height, blade, 0.5, 0.3, 0.3, world.links, world.link_levels)
                r, c, along_x = world.links[:held].T
                ahead_r, ahead_c = r + 0.5 * (1 - along_x), c + 0.5 * along_x  # the middle of each link
                assert np.hypot((ahead_r + 0.5) * 0.5 - at, (ahead_c + 0.5) * 0.5 - at).max() < 1.5 + 0.5
                assert 6 <= held <= 16


def test_lists_of_closed_links_are_told_apart_by_their_numbers():
    world, _ = layer(24, 24, 0.0)
    rng, seen = np.random.default_rng(3), {}
    for _ in range(3000):
        blade = line_at(*rng.uniform(2.0, 10.0, 2), rng.uniform(-3.0, 3.0), edge=-0.1)
        held, key, passes = held_links(world.height, blade, 0.5, 0.3, 0.3, world.links, world.link_levels)
        assert seen.setdefault(key, world.links[:held].tolist()) == world.links[:held].tolist()
        assert key > 0
        assert not passes
    assert len(seen) > 1000
    up = line_at(5.0, 5.0, 0.0, edge=0.1)
    assert held_links(world.height, up, 0.5, 0.3, 0.3, world.links, world.link_levels)[:2] == (0, 0)


def test_soil_that_would_pass_over_the_top_or_under_the_edge_is_noticed():
    world, _ = layer(16, 16, 0.0)
    world.height[:, 8:] = 2.0
    for height, edge, passes in ((3.0, -0.1, False), (1.0, -0.1, True), (3.0, 0.5, True), (3.0, 0.2, False)):
        blade = line_at(4.1, 4.0, 0.0, edge=edge, height=height)
        assert held_links(world.height, blade, 0.5, 0.3, 0.31, world.links, world.link_levels)[2] == passes


def test_a_blade_on_centres_of_cells_carries_the_same_in_all_directions():
    highest = []
    for ahead_x, ahead_y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
        world, grid = layer(40, 40, 0.3)
        ways = np.arange(-4.0, 4.01, 0.25)
        lines = [Line(10.25 + s * ahead_x, 10.25 + s * ahead_y, ahead_x, ahead_y, 1.5, 0.0, 0.0, 2.0) for s in ways]
        sweep_blade(world, grid, lines)
        highest.append(world.height.max())
    assert highest == [pytest.approx(highest[0], rel=1e-6)] * 4
    assert highest[0] > 1.0


def test_the_blade_frame_measures_ahead_and_to_the_left():
    blade = line_at(2.0, 3.0, 0.5 * pi)
    assert blade_frame(blade, 2.0, 5.0) == pytest.approx((2.0, 0.0))
    assert blade_frame(blade, 1.0, 3.0) == pytest.approx((0.0, 1.0))
    assert hypot(*blade_frame(blade, 5.0, 7.0)) == pytest.approx(5.0)


def test_the_load_is_the_soil_ahead_above_edge_and_tracks():
    world, _ = layer(40, 40, 0.1)
    world.height[18:22, 22:24] = 0.6
    blade = line_at(10.9, 10.0, 0.0)
    assert load_ahead(world.height, None, blade, 0.5, K, 0.1, 1) == (pytest.approx(8 * 0.5 * 0.25), True)
    assert load_ahead(world.height, None, blade._replace(edge=0.4), 0.5, K, 0.1, 1)[0] == pytest.approx(8 * 0.2 * 0.25)
    assert load_ahead(world.height, None, blade._replace(x=10.3), 0.5, K, 0.1, 1) == (pytest.approx(0.5), False)
    assert load_ahead(world.height, None, blade, 0.5, K, 0.1, -1) == (0, False)
    behind = blade._replace(x=12.1)
    assert load_ahead(world.height, None, behind, 0.5, K, 0.1, -1) == (pytest.approx(1.0), True)
