"""The arrays of one world: the ground, the machine's record, the tally of one control step, the work space."""

from math import ceil, floor, log2
from typing import NamedTuple

import numpy as np

from dirt_env.sim.lanes import LANES
from dirt_env.sim.params import Grid

# The machine: pivot [m], heading [rad, counter-clockwise from +x], ground under the pivot [m], slopes of the plane of
# the tracks along and to the left of the heading [-], edge height over that plane [m], actual speed [m/s] and yaw
# rate [rad/s], the soil ahead of the blade [m3], and a number for the links that the blade closed last (0 none, -1 not
# known; see `blade.held_links`).
POSE = np.dtype(
    (
        np.record,
        [
            (name, "f8")
            for name in ("x", "y", "heading", "z", "pitch", "roll", "edge", "speed", "yaw_rate", "load", "closed")
        ],
    )
)

# What one control step did: distance driven [m], work on the soil [J], soil moved by the blade, lost over an open
# border, left behind for want of room [m3], share of the step in which something solid held the machine; what it took
# in all [J]; mean force on the blade [N] and slip of the tracks where traction is computed, else 0; sweeps.
TALLY = np.dtype(
    (
        np.record,
        [(name, "f8") for name in ("distance", "work", "cut", "lost", "stuck", "blocked", "energy", "draft", "slip")]
        + [("sweeps", "i8")],
    )
)

# The ground may pile up or be dug four times as far as it reaches at the start and this much more, with exact volume.
GROWTH = 8.0  # m
GROWTH_CELLS = 2000.0  # and no more cells than this, start included
MANTISSA = 24  # bits of a float32 significand: heights are multiples of a quantum below 2**24 of them
BUFFERS = 8  # rows of the packed window, named in `window`
WORK_SPACE = ("buffers", "links", "link_levels")  # fields of a World that hold nothing between two steps


class World(NamedTuple):
    """One world; every array is updated in place.

    `height` f4[rows, cols] m over the local datum, in C order, multiples of `quantum`; `solid` bool[rows, cols] or
    None; `outside` f4[rows, cols], the ground beyond an open border (its rim counts), or None for a wall;
    `machine` POSE[1]; `tally` TALLY[1]; `changed` i8[4], the rows and columns [r0, r1) x [c0, c1) touched since a
    reader last emptied it; `pending` i8[4], the window that has yet to settle; then the `work_space`. `bank` and
    `natural` f4[rows, cols] m: the surface of the undisturbed soil now and at the start (see `bank`), or None where
    all soil is loose.
    """

    height: np.ndarray
    solid: np.ndarray | None
    outside: np.ndarray | None
    machine: np.ndarray
    tally: np.ndarray
    changed: np.ndarray
    pending: np.ndarray
    quantum: float
    buffers: np.ndarray
    links: np.ndarray
    link_levels: np.ndarray
    bank: np.ndarray | None = None
    natural: np.ndarray | None = None


def quantum_for(cell: float, relief: float) -> float:
    """Power of two [m] of which all heights are multiples: about cell / 2**17, or 2**22 of it reach `relief` [m].

    Raises ValueError where that is so coarse (cell / 1024) that slopes would no longer be true.
    """
    fine = 2.0 ** (floor(log2(cell)) - 17)
    reach = max(relief, min(relief + GROWTH, GROWTH_CELLS * cell))
    quantum = max(fine, 2.0 ** (ceil(log2(reach)) - MANTISSA + 2))
    if quantum > cell / 1024:
        raise ValueError(
            f"ground heights reach {relief:g} m from the datum; "
            f"allowed with cells of {cell:g} m: {cell / 1024 * 2 ** (MANTISSA - 3):g} m"
        )
    return quantum


def make_world(
    height: np.ndarray, grid: Grid, solid: np.ndarray | None = None, open_border: bool = False, dtype: type = np.float32
) -> World:
    """World with the ground `height` [rows, cols] m, rounded so that volumes stay exact; the machine is not placed yet.

    Raises ValueError for heights that are not finite, do not have the grid's shape or exceed the exact range.
    """
    height = np.asarray(height, np.float64)
    if height.shape != (grid.rows, grid.cols):
        raise ValueError(f"height has shape {height.shape}; allowed: {(grid.rows, grid.cols)}")
    if not np.isfinite(height).all():
        raise ValueError(
            f"height has {np.count_nonzero(~np.isfinite(height))} cells that are not finite; allowed: none"
        )
    quantum = quantum_for(grid.cell, float(np.abs(height).max()))
    ground = np.ascontiguousarray(np.round(height / quantum) * quantum, dtype)
    solid = np.ascontiguousarray(solid, np.bool_) if solid is not None and np.any(solid) else None
    machine = np.zeros(1, POSE)
    machine[0].edge = np.inf  # in nobody's way until it is placed
    return World(
        height=ground,
        solid=solid,
        outside=ground.copy() if open_border else None,
        machine=machine,
        tally=np.zeros(1, TALLY),
        changed=np.array([0, grid.rows, 0, grid.cols]),
        pending=np.array([0, grid.rows, 0, grid.cols]),
        quantum=quantum,
        **work_space(ground),
    )


def work_space(height: np.ndarray) -> dict[str, np.ndarray]:
    """The WORK_SPACE of a World whose ground has that shape and type."""
    rows, cols = height.shape
    crossings = rows + cols + 8  # of the blade: rows + cols at most, and the place after the last
    return {
        "buffers": np.zeros((BUFFERS, (rows + 5) * (cols + 4) + LANES), height.dtype),
        "links": np.zeros((2 * crossings, 3), np.int64),  # on the map, and in the window
        "link_levels": np.zeros((2 * crossings, 2), height.dtype),
    }
