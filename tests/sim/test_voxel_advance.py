"""The agent on the paper's cells: navigate, push, dig; its constraints move soil and lose none."""

from math import cos, pi, sin

import numpy as np
import pytest

from dirt_env.sim.advance import advance, place
from dirt_env.sim.params import Blade, Command, Grid, Machine, Soil
from dirt_env.sim.state import make_world
from dirt_env.sim.voxel_advance import (
    advance_voxels,
    lay_down,
    make_voxel_world,
    place_on_voxels,
    settle_voxels,
    update_world,
)
from dirt_env.sim.voxel_state import GRAIN, HEAP, POINT, TRACKS, Rules, volume
from dirt_env.sim.voxel_surface import position_on_surface

GRID, SOIL, BLADE, MACHINE = Grid(40, 40, 0.5), Soil(), Blade(), Machine()
RULES = Rules(difference=0.7)
PUSH, DIG, NAVIGATE = 0.0, -0.25, 0.75


def heap(x=10.0, y=10.0, high=1.2):
    """Flat ground with a settled heap."""
    c, r = np.meshgrid((np.arange(40) + 0.5) * 0.5, (np.arange(40) + 0.5) * 0.5)
    return np.maximum(0.0, high - 0.6 * np.hypot(c - x, r - y))


def world_with(ground, pose=(5.0, 10.0, 0.0), rules=RULES, **others):
    world = make_voxel_world(ground, GRID, rules, 0.5, 1.0, 2.0, **others)
    settle_voxels(world, rules)
    place_on_voxels(world, GRID, SOIL, BLADE, MACHINE, rules, pose)
    return world


def drive(world, edge, speed=1.0, yaw_rate=0.0, steps=8, rules=RULES, dt=0.5):
    for _ in range(steps):
        advance_voxels(world, GRID, SOIL, BLADE, MACHINE, rules, 60.0, Command(speed, yaw_rate, edge), dt)


def test_the_agents_update_is_that_of_the_paper():
    world = world_with(np.zeros((40, 40)), (5.0, 10.0, 0.5))
    drive(world, NAVIGATE, speed=1.5, steps=2)
    pose = world.machine[0]
    assert pose.x == pytest.approx(5.0 + 1.5 * cos(0.5))
    assert pose.y == pytest.approx(10.0 + 1.5 * sin(0.5))
    assert pose.z == 0.0


def test_the_agents_height_follows_the_surface():
    slope = np.broadcast_to(0.2 * (np.arange(40) + 0.5) * 0.5, (40, 40))
    world = world_with(slope)
    drive(world, NAVIGATE, steps=6)
    pose = world.machine[0]
    assert pose.z == pytest.approx(0.2 * pose.x, abs=1e-6)
    assert pose.pitch == pytest.approx(0.2, abs=1e-6)


def test_at_a_point_the_agents_y_is_that_of_the_surface_there_and_it_stays_upright():
    rules = RULES._replace(footing=POINT)
    world = world_with(heap(), (8.6, 9.9, 0.3), rules)
    pose = world.machine[0]
    for _ in range(4):
        expected, *_slopes = position_on_surface(world.surface, 0.5, pose.x, pose.y)
        assert pose.z == expected > 0.3
        assert pose.pitch == pose.roll == 0.0
        drive(world, NAVIGATE, speed=0.5, steps=1, rules=rules)


@pytest.mark.parametrize(("footing", "lifted"), [(TRACKS, True), (POINT, True), (HEAP, False)])
def test_soil_in_the_air_under_the_agent_lifts_it_unless_it_counts_as_fallen(footing, lifted):
    rules = RULES._replace(footing=footing)
    world = world_with(np.zeros((40, 40)), (10.25, 10.25, 0.0), rules)
    r = c = 21
    world.fill[r, c, 5], world.life[r, c, 4] = 1e-6, 101
    world.active[:] = r, r + 1, c, c + 1
    update_world(world, rules, 1)
    lay_down(world, GRID, SOIL, BLADE, MACHINE, rules)
    assert (world.machine[0].z > 0.05) == lifted


def test_navigating_over_level_ground_alters_nothing():
    world = world_with(np.zeros((40, 40)))
    fill = world.fill.copy()
    drive(world, NAVIGATE, speed=2.0, yaw_rate=0.1)
    np.testing.assert_array_equal(world.fill, fill)
    assert not (world.life > 0).any()
    assert world.tally[0].cut == 0.0


def test_pushing_carries_the_heap_along_and_leaves_the_ground_at_grade():
    world = world_with(heap(high=0.8))
    before = world.height.sum()
    drive(world, PUSH, speed=0.0, steps=4)
    drive(world, PUSH, steps=12)
    c = (np.arange(40) + 0.5) * 0.5
    x = (world.height.sum(axis=0) * c).sum() / world.height.sum()
    assert x > 12.5
    assert np.abs(world.height[17:23, 12:20]).max() < 0.02
    assert world.height.sum() == pytest.approx(before, rel=1e-6)
    assert world.machine[0].load > 0.5


def test_digging_lowers_the_ground_and_adds_to_what_is_pushed():
    pushed, dug = world_with(heap(high=0.8)), world_with(heap(high=0.8))
    for world, edge in ((pushed, PUSH), (dug, DIG)):
        drive(world, edge, speed=0.0, steps=4)
        drive(world, edge, steps=4)
    assert dug.height[18:22, 12:15].max() < -0.1
    assert dug.machine[0].load > pushed.machine[0].load + 0.3


def test_back_blading_takes_soil_back():
    world = world_with(heap(x=9.0), (5.0, 10.0, 0.0))
    drive(world, NAVIGATE, speed=2.0, steps=8)  # over the heap
    drive(world, PUSH, speed=0.0, steps=2)
    c = (np.arange(40) + 0.5) * 0.5
    before = (world.height.sum(axis=0) * c).sum() / world.height.sum()
    drive(world, PUSH, speed=-1.0, steps=6)
    assert (world.height.sum(axis=0) * c).sum() / world.height.sum() < before


def test_the_blades_cells_are_kept_free_of_fill():
    world = world_with(heap())
    drive(world, PUSH, steps=8)
    edge_level = 3  # the ground's surface is the boundary between levels 2 and 3 (1 m of soil, levels of 0.5 m)
    held = world.life[:, :, edge_level] == RULES.life + 1 - 2
    assert (world.life > 0).sum() >= 12
    assert world.fill[:, :, edge_level][held].sum() < 1e-6


def test_mirrored_pushes_give_mirrored_soil():
    left, right = world_with(heap()), world_with(heap())
    for yaw, world in ((0.15, left), (-0.15, right)):
        drive(world, PUSH, yaw_rate=yaw, steps=8)
    np.testing.assert_allclose(left.height, right.height[::-1], atol=1e-5)


@pytest.mark.parametrize("grain", [0.0, GRAIN])
def test_volume_in_cells_and_transit_is_kept_over_1e5_updates_with_a_moving_blade(grain):
    rules = RULES._replace(grain=grain)
    world = world_with(heap(high=2.0), rules=rules)
    before = volume(world.voxels, 0.5)
    updates = 0
    rng = np.random.default_rng(0)
    command = np.array([1.0, 0.0, -0.1])
    while updates < 100_000:
        command = np.clip(0.9 * command + rng.normal(0, [0.5, 0.15, 0.1]), [-2, -0.6, -0.25], [2, 0.6, 0.1])
        advance_voxels(world, GRID, SOIL, BLADE, MACHINE, rules, 400.0, Command(*command), 0.5)
        updates += 200
    after = volume(world.voxels, 0.5)
    assert world.machine[0].load > 0.0 or world.tally[0].cut >= 0.0
    assert np.abs(world.height - heap(high=2.0)).max() > 0.3, "a lot has been moved"
    assert after == (before if grain else pytest.approx(before, rel=1e-12))


def test_soil_at_a_wall_is_stuck_and_not_lost():
    ground = np.zeros((40, 40))
    ground[15:25, 36:] = 0.9
    world = world_with(ground, (12.0, 10.0, 0.0))
    before = volume(world.voxels, 0.5)
    stuck = 0.0
    for _ in range(20):
        drive(world, PUSH, speed=2.0, steps=1)
        stuck += world.tally[0].stuck
    assert volume(world.voxels, 0.5) == pytest.approx(before, rel=1e-13)
    assert world.machine[0].x < 19.0


@pytest.mark.parametrize("heading", [0.0, 0.25 * pi])
def test_no_soil_is_pushed_through_a_wall_of_single_cells(heading):
    row, col = np.indices((40, 40))
    way = col if heading == 0.0 else (row + col) / 2
    solid = way == 24 if heading == 0.0 else row + col == 44
    ground = np.where(way < 24 if heading == 0.0 else row + col < 44, 0.25, 0.0)
    world = world_with(ground, (5.0, 10.0 if heading == 0.0 else 5.0, heading), solid=solid)
    beyond = np.pad(way > 24 if heading == 0.0 else row + col > 44, 1)
    before = world.fill[beyond].sum()
    drive(world, DIG, speed=0.0, steps=2)
    drive(world, DIG, speed=2.0, steps=12)
    assert world.tally[0].blocked == 1.0
    assert world.fill[beyond].sum() + world.incoming[beyond].sum() == before


def test_soil_over_an_open_border_is_booked_as_lost():
    ground = np.zeros((40, 40))
    ground[17:23, 36:38] = 0.9
    world = world_with(ground, (14.0, 10.0, 0.0), open_border=True)
    before, lost = volume(world.voxels, 0.5), 0.0
    for _ in range(16):
        drive(world, PUSH, speed=1.0, steps=1)
        lost += world.tally[0].lost
    assert lost > 0.5
    assert volume(world.voxels, 0.5) == pytest.approx(before - lost, abs=1e-9)


def test_soil_pushed_over_an_open_border_is_gone_as_on_the_height_field_and_dams_nothing():
    ground = np.zeros((40, 40))
    ground[17:23, 36:39] = 0.9
    world = world_with(ground, (14.0, 10.0, 0.0), open_border=True)
    floor = 20.0 * 20.0 * 1.0
    before = volume(world.voxels, 0.5) - floor
    field = make_world(ground, GRID, None, open_border=True)
    place(field, GRID, SOIL, BLADE, MACHINE, 14.0, 10.0, 0.0)
    lost = dict.fromkeys(("cells", "field"), 0.0)
    for speed in (*[0.0] * 3, *[1.0] * 14):
        drive(world, PUSH, speed=speed, steps=1)
        advance(field, GRID, SOIL, BLADE, MACHINE, Command(speed, 0.0, PUSH), 0.5)
        lost["cells"] += world.tally[0].lost
        lost["field"] += field.tally[0].lost
        assert world.tally[0].stuck == 0.0
    assert world.machine[0].x + BLADE.reach > 20.0, "the blade is beyond the border"
    assert not world.incoming[:, -1].any()
    assert lost["cells"] > 0.75 * before
    assert lost["cells"] > lost["field"], "where it piled up beyond the border, less was lost"
    assert volume(world.voxels, 0.5) - floor == pytest.approx(before - lost["cells"], abs=1e-9)


@pytest.mark.parametrize("heading", [0.0, 0.4, pi / 4, 2.0])
def test_no_soil_passes_through_the_blade(heading):
    x, y = 10.0 - 3.0 * cos(heading), 10.0 - 3.0 * sin(heading)
    rules = RULES._replace(footing=HEAP)  # a few grains on the blade's constraints, a metre up, lift no track
    world = world_with(heap(high=0.8), (x - cos(heading), y - sin(heading), heading), rules)
    drive(world, PUSH, speed=0.0, steps=4, rules=rules)
    drive(world, PUSH, steps=8, rules=rules)
    pose = world.machine[0]
    c, r = np.meshgrid((np.arange(40) + 0.5) * 0.5, (np.arange(40) + 0.5) * 0.5)
    ahead = (c - pose.x) * cos(heading) + (r - pose.y) * sin(heading)
    left = (r - pose.y) * cos(heading) - (c - pose.x) * sin(heading)
    behind = (ahead < BLADE.reach - 0.75) & (ahead > -1.0) & (abs(left) < 1.2)
    assert world.height[behind].sum() < 0.02 * world.height.sum()


def test_a_ground_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="all finite"):
        make_voxel_world(np.full((40, 40), np.nan), GRID, RULES, 0.5, 1.0, 2.0)


def test_soil_on_a_constraint_shows_in_the_surface_and_counts_as_fallen_in_the_height():
    world = world_with(np.zeros((40, 40)))
    world.fill[11, 11, 5], world.life[11, 11, 4] = 0.5, 101
    world.active[:] = 11, 12, 11, 12
    update_world(world, RULES, 1)
    assert world.surface[10, 10] == -1.0 + 4.5 * 0.5
    assert world.height[10, 10] == 0.25
