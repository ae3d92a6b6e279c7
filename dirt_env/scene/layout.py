"""What one episode starts from (`Layout`), and what a layout has to suit (`Setting`)."""

from math import hypot
from typing import NamedTuple

import numpy as np

from dirt_env.sim.params import Blade, Grid, Machine


class Layout(NamedTuple):
    """The start of one episode. All arrays are [row, col] with row 0 at the southern edge, and belong to the caller."""

    height: np.ndarray  # f8 [rows, cols] ground with the heaps on it, m over the datum
    target: np.ndarray  # f8 [rows, cols] ground to be left: outside the goal no soil above it; or the design surface
    start: np.ndarray  # bool [rows, cols] where the soil is to be taken from
    goal: np.ndarray  # bool [rows, cols] where the soil is to go
    design: np.ndarray | None  # bool [rows, cols] where the design surface is asked for; None without a design
    solid: np.ndarray | None  # bool [rows, cols] obstacles and walled-off cells; None without any
    pose: tuple[float, float, float]  # machine's x m, y m, heading rad
    datum: float  # elevation of height 0, m
    soil: float  # what is to be moved: soil above the target outside the goal, m3
    ground: np.ndarray  # f8 [rows, cols] ground without the heaps, m over the datum: what is undisturbed
    zone: np.ndarray | None = None  # i1 [rows, cols] which soil lies where, 0 the scene's own; None where all is that


class Setting(NamedTuple):
    """What a layout has to suit: the raster, the soil's slope at repose (a tangent), the machine and its blade."""

    grid: Grid
    slope: float
    blade: Blade
    machine: Machine

    @property
    def size(self) -> tuple[float, float]:
        """Extent of the site to the east and to the north, m."""
        return self.grid.cols * self.grid.cell, self.grid.rows * self.grid.cell

    @property
    def tracks_radius(self) -> float:
        """Circle about the pivot that holds the tracks, m."""
        return hypot(self.machine.length, self.machine.width) / 2

    @property
    def radius(self) -> float:
        """Circle about the pivot that holds the tracks and the blade, m."""
        return max(self.tracks_radius, hypot(self.blade.reach, self.blade.width / 2))


def centres(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of the cell centres: x [1, cols] and y [rows, 1], m."""
    x = (np.arange(grid.cols) + 0.5) * grid.cell
    y = (np.arange(grid.rows) + 0.5) * grid.cell
    return x[None, :], y[:, None]


def soil_above(height: np.ndarray, target: np.ndarray, goal: np.ndarray, cell: float) -> float:
    """Volume of the soil above the target outside the goal, m3: what there is to move."""
    return float(np.where(goal, 0.0, np.maximum(height - target, 0.0)).sum() * cell**2)
