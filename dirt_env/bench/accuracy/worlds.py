"""Worlds of the default terrain in either precision."""

import numpy as np

from dirt_env.sim.params import Grid
from dirt_env.sim.state import World, make_world

DIGITS = 29  # bits by which a float64 significand is longer


def world_of(
    height: np.ndarray, grid: Grid, dtype: type = np.float32, solid=None, outside: float | None = None
) -> World:
    """World with that ground [m]; in float64 its quantum is finer by as many bits as the type is longer.

    `outside` [m]: level of the ground beyond an open border; None is a wall.
    """
    world = make_world(height, grid, solid=solid, open_border=outside is not None, dtype=dtype)
    if outside is not None:
        world.outside[:] = outside
    if dtype != np.float64:
        return world
    quantum = world.quantum * 2.0**-DIGITS
    world.height[:] = np.round(np.asarray(height, np.float64) / quantum) * quantum
    return world._replace(quantum=quantum)
