"""A blade on given lines, without a machine: for experiments whose answer is known."""

import numpy as np

from dirt_env.sim.advance import move_soil, step
from dirt_env.sim.blade import Line
from dirt_env.sim.intrinsics import uncounted
from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.params import Blade, Command, Grid, Machine, Soil
from dirt_env.sim.state import World


@kernel
def line_from(row):
    """The Line of a row of `lines`."""
    return Line(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])


@entry
def drag(world: World, grid: Grid, soil: Soil, lines: np.ndarray) -> int:
    """Move a blade through the soil from line to line, f8[n, 8], fields as in `blade.Line`; returns the sweeps.

    Lines should lie no more than half a cell apart, as those of `advance` do. Two equal ones let soil slump against a
    blade that stands. `world.tally` then holds what was cut, lost and stuck, and the sweeps; its other
    numbers, of a machine, stay as they are.
    """
    world, lines = uncounted(world), uncounted(lines)
    tally, sweeps = world.tally[0], 0
    tally.cut = tally.lost = tally.stuck = 0.0
    for k in range(1, lines.shape[0]):
        tally.sweeps = 0
        old, new = line_from(lines[k - 1]), line_from(lines[k])
        move_soil(
            world.height, world.solid, world.outside, world.buffers, world.links, world.link_levels, world.changed,
            world.pending, grid.cell, soil, world.quantum, world.machine[0], old, new, tally,
        )  # fmt: skip
        sweeps += tally.sweeps
    area = grid.cell**2
    tally.cut, tally.lost, tally.stuck, tally.sweeps = area * tally.cut, area * tally.lost, area * tally.stuck, sweeps
    return sweeps


@entry
def drive_along(
    world: World, grid: Grid, soil: Soil, blade: Blade, machine: Machine, commands: np.ndarray, dt: float
) -> None:
    """As many steps of `advance` as `commands` f8[n, 3] has rows: speed, yaw rate, edge, as in `params.Command`."""
    world = uncounted(world)
    for k in range(commands.shape[0]):
        command = Command(commands[k, 0], commands[k, 1], commands[k, 2])
        step(
            world.height, world.solid, world.outside, world.machine[0], world.tally[0], world.buffers, world.links,
            world.link_levels, world.changed, world.pending, world.quantum, grid, soil, blade, machine, command, dt,
        )  # fmt: skip
