"""Worlds and blades for the tests of the physics."""

from itertools import pairwise
from math import cos, radians, sin, tan

import numpy as np

from dirt_env.sim.advance import move_soil, settle
from dirt_env.sim.bank import bank_of
from dirt_env.sim.blade import Line, held_links
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.slump import limits, relax
from dirt_env.sim.state import TALLY, make_world
from dirt_env.sim.traction import PULL
from dirt_env.sim.zones import SOILS, Zones

SOIL = Soil()
FINE = Soil(tolerance=1e-3)


def soil_of(repose_deg, **others):
    """Soil with an angle of repose in degrees."""
    return Soil(slope=tan(radians(repose_deg)), **others)


def world_of(height, cell=0.5, **others):
    """(world, grid) with that ground, not settled."""
    height = np.asarray(height, np.float64)
    grid = Grid(*height.shape, cell)
    return make_world(height, grid, **others), grid


def settled(height, cell=0.5, soil=SOIL, **others):
    """(world, grid, sweeps) with that ground after it has slumped."""
    world, grid = world_of(height, cell, **others)
    return world, grid, settle(world, grid, soil)


def zones_of(index, soils, pulls=None):
    """Zones with these soils, and their pulls where traction is computed; soils[0] is the scene's."""
    tables = np.array([tuple(soil) for soil in soils], SOILS)
    forces = None if pulls is None else np.array([tuple(pull) for pull in pulls], PULL)
    return Zones(np.asarray(index, np.int8), tables, forces, np.zeros(len(soils)), np.zeros(len(soils)))


def line_at(x, y, heading, width=3.0, edge=0.0, height=1.0, roll=0.0):
    """A blade with its centre at (x, y)."""
    return Line(x, y, cos(heading), sin(heading), width / 2, edge, roll, height)


def sweep_blade(world, grid, lines, soil=SOIL):
    """Move the blade from line to line through the soil; returns the tally, of heights [m of one cell]."""
    tally, sweeps = np.zeros(1, TALLY)[0], 0
    for old, new in pairwise(lines):
        tally.sweeps = 0
        move_soil(
            world.height, world.solid, world.outside, world.buffers, world.links, world.link_levels, world.changed,
            world.pending, grid.cell, soil, world.quantum, world.machine[0], old, new, tally,
            None, bank_of(world.bank, world.natural, soil.swell),
        )  # fmt: skip
        sweeps += tally.sweeps
    tally.sweeps = sweeps
    return tally


def slump_against(world, grid, soil, blade, zones=None):
    """Let what is pending slump against a blade that stands; returns how many links that closes."""
    threshold, settled_, _ = limits(world.height, world.quantum, grid.cell, soil.slope, soil.tolerance)
    held, _, _ = held_links(world.height, blade, grid.cell, threshold, settled_, world.links, world.link_levels)
    relax(
        world.height, None, None, world.buffers, world.links, world.link_levels, world.changed, world.pending,
        grid.cell, soil, world.quantum, held, soil.max_sweeps, zones, None,
    )  # fmt: skip
    return held


def straight(x0, y0, heading, distance, stride, **blade):
    """Lines along a straight way of `distance` metres in strides of about `stride`."""
    steps = max(round(abs(distance) / stride), 1)
    return [
        line_at(x0 + s * cos(heading), y0 + s * sin(heading), heading, **blade)
        for s in np.linspace(0, distance, steps + 1)
    ]


def cone(side, cell, x, y, volume, slope):
    """A cone of repose as averages of 8 x 8 points a cell, f8[side, side] m: V = pi H^3 / (3 slope^2)."""
    fine = (np.arange(8 * side) + 0.5) * cell / 8
    high = (3 * slope**2 * volume / np.pi) ** (1 / 3)
    points = np.maximum(0.0, high - slope * np.hypot(fine[:, None] - y, fine[None, :] - x))
    return points.reshape(side, 8, side, 8).mean(axis=(1, 3))
