"""A full blade pushed straight over level ground: what one cell of travel costs, at any yaw."""

from math import cos, radians, sin
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from dirt_env.bench.speed.bare import BareWorlds
from dirt_env.bench.speed.drives import CELL, scene
from dirt_env.bench.speed.measure import CHUNKS, CartPole, Effort, timed
from dirt_env.config import load
from dirt_env.sim.advance import advance, place
from dirt_env.sim.params import Command

DEPTH = 0.15  # m that are cut
RUN_UP, TIMED = 24, 20  # control steps of one cell each: the blade fills up, then the clock runs
BEFORE = 12.03  # m from the middle at which it begins; it ends as far beyond
LEAST = 64  # cells along the side, or the way is too short


class Push(NamedTuple):
    """A push on size x size cells at a yaw [degrees], with the tolerance of the soil."""

    size: int
    yaw: float
    tolerance: float


FULL = (
    *(Push(81, yaw, tolerance) for tolerance in (1e-3, 4e-3) for yaw in (0.0, 15.0, 30.0, 45.0)),
    Push(161, 0.0, 4e-3),
    Push(321, 0.0, 4e-3),
)
FEW = tuple(Push(81, yaw, 1e-3) for yaw in (0.0, 30.0))


def measure_push(push: Push, effort: Effort, cartpole: CartPole) -> dict[str, Any]:
    """The row of a push, of the case `world`; `us_per_cell` is processor time, the median of the repeats."""
    config = load(**scene(push.size, soil={"tolerance": push.tolerance}))
    bare = BareWorlds(config, 1)
    bare.begin([0])
    world, middle = bare.worlds.episode(0).world, 0.5 * push.size * CELL
    world.height[:] = round(DEPTH / world.quantum) * world.quantum
    world.pending[:] = 0
    yaw = radians(push.yaw)
    fixed = config.grid, config.soil, config.blade, config.machine
    place(world, *fixed, middle - BEFORE * cos(yaw), middle - BEFORE * sin(yaw), yaw)
    period = config.task.period
    _commands(world, fixed, RUN_UP, period)
    start = bare.keep()
    commands, load_m3 = _commands(world, fixed, TIMED, period), float(world.machine[0].load)
    walls, cpus, poles = [], [], []
    while len(walls) < CHUNKS or sum(walls) < 0.2 * effort.row:
        bare.restore(start)
        wall, cpu = timed(lambda: bare.drive(commands))
        walls.append(wall)
        cpus.append(cpu)
        if len(poles) < CHUNKS:
            poles.append(cartpole.chunk(effort.cartpole))
    rate, cpu, pole = TIMED / median(walls), median(cpus) / TIMED, median(poles)
    cut, sweeps = (bare.done / TIMED).tolist()
    return {
        "case": "world",
        "rows": push.size,
        "cols": push.size,
        "num_envs": 1,
        "threads": 1,
        "drive": "full_load",
        "observation": False,
        "yaw": push.yaw,
        "tolerance": push.tolerance,
        "steps_per_s": rate,
        "cartpole_ratio": rate / pole,
        "sim_s_per_cpu_s": period / cpu,
        "m3_per_cpu_s": cut / cpu,
        "us_per_step": 1e6 / rate,
        "cpu_us_per_step": 1e6 * cpu,
        "us_per_cell": 1e6 * cpu,
        "m3_per_step": cut,
        "sweeps_per_cell": sweeps,
        "load_m3": load_m3,
        "cartpole_steps_per_s": pole,
        "chunks": len(walls),
    }


def _commands(world: Any, fixed: tuple, steps: int, period: float) -> np.ndarray:
    """Drive on by so many steps of one cell, the edge held at the foot of the cut; returns the commands f8[n, 1, 3]."""
    grid, _, blade, _ = fixed
    commands = np.empty((steps, 1, 3))
    for command in commands[:, 0]:
        pose = world.machine[0]
        command[:] = grid.cell / period, 0.0, -pose.z - pose.pitch * blade.reach
        advance(world, *fixed, Command(*command.tolist()), period)
    return commands
