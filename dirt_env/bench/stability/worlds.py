"""Grounds, blades and machines for the cases: the physics without an environment around it."""

from itertools import pairwise
from math import cos, radians, sin, tan

import numpy as np

from dirt_env.sim.advance import advance, move_soil, place, settle
from dirt_env.sim.bank import loosened
from dirt_env.sim.blade import Line
from dirt_env.sim.diagnostics import steepest
from dirt_env.sim.params import Blade, Command, Grid, Machine, Soil
from dirt_env.sim.slump import limits, settle_window
from dirt_env.sim.state import TALLY, World, make_world

CELL = 0.5
SOIL = Soil()
SLOPE = SOIL.slope
BLADE, MACHINE = Blade(), Machine()
ROUNDED = 8  # quanta by which a face may be too steep whose flow, a share of that, rounds to nothing


def soil_of(repose: float, **others: float) -> Soil:
    """Soil with an angle of repose in degrees."""
    return Soil(slope=tan(radians(repose)), **others)


def world_of(height: np.ndarray, cell: float = CELL, **others) -> tuple[World, Grid]:
    """A world with that ground [m], not settled."""
    height = np.asarray(height, np.float64)
    grid = Grid(*height.shape, cell)
    return make_world(height, grid, **others), grid


def settled(height: np.ndarray, cell: float = CELL, soil: Soil = SOIL, **others) -> tuple[World, Grid, int]:
    """A world with that ground after it has slumped, and the sweeps it took."""
    world, grid = world_of(height, cell, **others)
    return world, grid, settle(world, grid, soil)


def at_rest(rows: int, cols: int, depth: float, cell: float = CELL, **others) -> tuple[World, Grid]:
    """A world of level soil."""
    world, grid = world_of(np.full((rows, cols), depth), cell, **others)
    world.pending[:] = 0
    return world, grid


def one_sweep(world: World, grid: Grid, soil: Soil = SOIL) -> None:
    """A single sweep of what is pending."""
    settle_window(world, grid, soil._replace(max_sweeps=1))


def total(world: World) -> float:
    """Sum of all heights [m]; exact."""
    return float(world.height.sum(dtype=np.float64))


def grown(world: World, soil: Soil) -> float:
    """What the ground has gained as undisturbed soil loosened, from its maps alone [m of one cell]; exact."""
    if world.bank is None:
        return 0.0
    lock = world.height.dtype.type(limits(world.height, world.quantum, CELL, soil.slope, soil.tolerance)[2])
    return sum(float(loosened(depth, soil.swell, lock)) for depth in (world.natural - world.bank).ravel())


def over_repose(world: World, grid: Grid, soil: Soil = SOIL) -> float:
    """The steepest slope over that of repose."""
    return steepest(world.height, grid.cell) / soil.slope


def rests(world: World, grid: Grid, soil: Soil = SOIL) -> bool:
    """Whether no face is steeper than what counts as settled, or by so little that its flow rounds to nothing."""
    slack = max(soil.tolerance * max(soil.slope, 0.01), ROUNDED * world.quantum / grid.cell)
    return steepest(world.height, grid.cell) <= (soil.slope + slack) * (1 + 1e-5)


def rough(rows: int, cols: int, size: float, seed: int = 0) -> np.ndarray:
    """Noise [m], the same each time."""
    return np.random.default_rng(seed).normal(0.0, size, (rows, cols))


def tower(rows: int, cols: int, height: float) -> np.ndarray:
    """Flat ground with one high column in its middle [m]."""
    ground = np.zeros((rows, cols))
    ground[rows // 2, cols // 2] = height
    return ground


def line_at(x, y, heading, width=3.0, edge=0.0, height=1.0, roll=0.0) -> Line:
    """A blade with its centre at (x, y) [m]."""
    return Line(x, y, cos(heading), sin(heading), width / 2, edge, roll, height)


def straight(x, y, heading, distance, stride, **blade) -> list[Line]:
    """Places of a blade along a straight way of `distance` m, in strides of about `stride` m."""
    steps = max(round(abs(distance) / stride), 1)
    ways = np.linspace(0, distance, steps + 1)
    return [line_at(x + s * cos(heading), y + s * sin(heading), heading, **blade) for s in ways]


def sweep_blade(world: World, grid: Grid, lines: list[Line], soil: Soil = SOIL) -> np.record:
    """Move a blade from place to place through the soil; returns the TALLY, of heights [m of one cell]."""
    tally, sweeps = np.zeros(1, TALLY)[0], 0
    for old, new in pairwise(lines):
        tally.sweeps = 0
        move_soil(
            world.height, world.solid, world.outside, world.buffers, world.links, world.link_levels, world.changed,
            world.pending, grid.cell, soil, world.quantum, world.machine[0], old, new, tally,
        )  # fmt: skip
        sweeps += tally.sweeps
    tally.sweeps = sweeps
    return tally


class Driven:
    """A machine on a ground, driven by commands; adds up what its steps did."""

    def __init__(self, ground, x, y, heading=0.0, soil=SOIL, blade=BLADE, machine=MACHINE, cell=CELL, **others):
        self.world, self.grid, _ = settled(ground, cell, soil, **others)
        self.soil, self.blade, self.machine = soil, blade, machine
        place(self.world, self.grid, soil, blade, machine, x, y, heading)
        self.lost = self.stuck = 0.0
        self.sweeps = self.most_sweeps = 0

    @property
    def pose(self):
        """The machine's record."""
        return self.world.machine[0]

    def go(self, speed=0.0, yaw_rate=0.0, edge=0.0, dt=0.5, steps=1):
        """So many control steps under one command; returns itself."""
        command, tally = Command(float(speed), float(yaw_rate), float(edge)), self.world.tally[0]
        for _ in range(steps):
            advance(self.world, self.grid, self.soil, self.blade, self.machine, command, dt)
            self.lost += tally.lost
            self.stuck += tally.stuck
            self.sweeps += int(tally.sweeps)
            self.most_sweeps = max(self.most_sweeps, int(tally.sweeps))
        return self

    def set_down(self, x, y, heading):
        """Put the machine elsewhere."""
        place(self.world, self.grid, self.soil, self.blade, self.machine, x, y, heading)
