"""A small site to draw, with everything on it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from dirt_env.render.track import POSE_FIELDS
from dirt_env.sim.params import Blade, Machine

POSE = np.dtype([(name, "f8") for name in POSE_FIELDS])
ROWS, COLS, CELL = 24, 40, 0.5


class Site(NamedTuple):
    """Masks bool[24, 40], grounds f8[24, 40] and a machine: what the drawing parts are given."""

    cell: float
    start: np.ndarray
    goal: np.ndarray
    solid: np.ndarray
    target: np.ndarray
    height: np.ndarray
    blade: Blade
    machine: Machine


@pytest.fixture
def site() -> Site:
    y, x = (np.indices((ROWS, COLS)) + 0.5) * CELL
    start = np.hypot(x - 5, y - 6) < 3
    goal = (np.abs(x - 15) < 2.5) & (np.abs(y - 8) < 2.5)
    solid = (np.abs(x - 10) < 0.5) & (y < 3)
    height = np.maximum(0, 1.5 - 0.7 * np.hypot(x - 5, y - 6))
    return Site(CELL, start, goal, solid, np.zeros((ROWS, COLS)), height, Blade(), Machine())


@pytest.fixture
def make_pose() -> Callable[..., np.void]:
    def make(**values: float) -> np.void:
        pose = np.zeros(1, POSE)
        for name, value in values.items():
            pose[name] = value
        return pose[0]

    return make
