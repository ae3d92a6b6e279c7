"""A blade on given lines, and many steps in one call: the same as one by one."""

import numpy as np

from dirt_env.sim.advance import advance, place
from dirt_env.sim.drag import drag, drive_along
from dirt_env.sim.params import Blade, Command, Machine
from tests.sim.worlds import SOIL, straight, sweep_blade, world_of


def test_dragging_along_lines_is_dragging_from_line_to_line():
    ground = np.full((20, 40), 0.2)
    (one, grid), (other, _) = world_of(ground), world_of(ground)
    lines = straight(3.0, 5.0, 0.1, 8.0, 0.25)
    sweeps, expected = drag(one, grid, SOIL, np.array(lines)), sweep_blade(other, grid, lines)
    assert sweeps == one.tally[0].sweeps == expected.sweeps > 0
    assert one.tally[0].cut == expected.cut * grid.cell**2 > 0.0
    np.testing.assert_array_equal(one.height, other.height)
    assert one.height.max() > 0.5


def test_driving_along_commands_is_one_step_after_the_other():
    ground = np.random.default_rng(0).normal(0.0, 0.1, (40, 40))
    commands = np.random.default_rng(1).uniform((-1, -0.5, -0.2), (1, 0.5, 0.2), (40, 3))
    worlds = []
    for _ in range(2):
        world, grid = world_of(ground)
        place(world, grid, SOIL, Blade(), Machine(), 10.0, 10.0, 0.3)
        worlds.append(world)
    drive_along(worlds[0], grid, SOIL, Blade(), Machine(), commands, 0.3)
    for command in commands:
        advance(worlds[1], grid, SOIL, Blade(), Machine(), Command(*command), 0.3)
    np.testing.assert_array_equal(worlds[0].height, worlds[1].height)
    assert worlds[0].machine[0] == worlds[1].machine[0]
    assert np.abs(worlds[0].height - ground).max() > 0.05
