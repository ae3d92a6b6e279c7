"""Rules that compare a cell with its neighbours one by one: what most simulators of loose ground do, for comparison.

Where the difference to a neighbour exceeds repose, a share of the excess flows there (thermal erosion; Musgrave, Kolb
and Mace 1989). With four neighbours piles come out as pyramids, with eight as octagons, however finely the grid is cut:
nothing here is the default. Written as fluxes, so that volume is kept to rounding, and swept over the box of cells
that can move only, so that times compare with `slump`.
"""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.laws import RATE
from dirt_env.sim.window import clear, widen

EAST, NORTH, NORTH_EAST, NORTH_WEST, ROOM = range(5)  # rows of the work space: fluxes, and 1 for cells that take soil
PATIENCE = 6  # sweeps between two looks whether a smaller box would do


@kernel
def flows(here, there, rate, threshold, settled, flow):
    """Soil that comes to each cell of a row from its neighbour: `rate` of what exceeds `threshold` [m]."""
    nothing = rate - rate
    for c in range(here.size):
        drop = there[c] - here[c]
        excess = max(abs(drop) - threshold, nothing)
        amount = rate * (excess if abs(drop) > settled else nothing)
        flow[c] = amount if drop > nothing else -amount


@kernel
def close(flow, room, other):
    """No flow where one of both cells takes no soil."""
    for c in range(flow.size):
        flow[c] *= room[c] * other[c]


@kernel
def gather(height, work, eight, box):
    """h -= div F over the cells of `box`. Fluxes lie one row and column on, so that the first has a zero before it."""
    r0, r1, c0, c1 = box
    for r in range(r0, r1):
        here = height[r, c0:c1]
        east, north, below = work[EAST, r + 1], work[NORTH, r + 1], work[NORTH, r]
        for c in range(c1 - c0):
            k = c + c0 + 1
            here[c] += (east[k] - east[k - 1]) + (north[k] - below[k])
        if eight:
            rising, falling = work[NORTH_EAST, r + 1], work[NORTH_WEST, r + 1]
            rising_below, falling_below = work[NORTH_EAST, r], work[NORTH_WEST, r]
            for c in range(c1 - c0):
                k = c + c0 + 1
                here[c] += (rising[k] - rising_below[k - 1]) + (falling[k - 1] - falling_below[k])


@kernel
def sweep_neighbours(height, solid, work, rates, thresholds, settled, eight, box):
    """One explicit step of the cells of `box`.

    `rates`, `thresholds`, `settled`: along the axes and along the diagonals.
    """
    rows, cols = height.shape
    r0, r1, c0, c1 = box
    last = min(c1, cols - 1)
    for r in range(r0, r1):
        here, room = height[r], work[ROOM, r]
        east = work[EAST, r + 1, c0 + 1 : last + 1]
        flows(here[c0:last], here[c0 + 1 : last + 1], rates[0], thresholds[0], settled[0], east)
        if solid is not None:
            close(east, room[c0:last], room[c0 + 1 : last + 1])
        if r + 1 >= rows:
            continue
        above, room_above = height[r + 1], work[ROOM, r + 1]
        north = work[NORTH, r + 1, c0 + 1 : c1 + 1]
        flows(here[c0:c1], above[c0:c1], rates[0], thresholds[0], settled[0], north)
        if solid is not None:
            close(north, room[c0:c1], room_above[c0:c1])
        if eight:
            rising, falling = work[NORTH_EAST, r + 1, c0 + 1 : last + 1], work[NORTH_WEST, r + 1, c0 + 1 : last + 1]
            flows(here[c0:last], above[c0 + 1 : last + 1], rates[1], thresholds[1], settled[1], rising)
            flows(here[c0 + 1 : last + 1], above[c0:last], rates[1], thresholds[1], settled[1], falling)
            if solid is not None:
                close(rising, room[c0:last], room_above[c0 + 1 : last + 1])
                close(falling, room[c0 + 1 : last + 1], room_above[c0:last])
    gather(height, work, eight, box)


@kernel
def moving_cells(work, eight, box, active):
    """Write the box of the cells whose links carried soil into `active`; empty if there are none."""
    clear(active)
    for r in range(box[0], box[1]):
        for k in range(4 if eight else 2):
            flow = work[k, r + 1]
            first, last = box[2], box[3] - 1
            while first <= last and flow[first + 1] == 0:
                first += 1
            while last >= first and flow[last + 1] == 0:
                last -= 1
            if first <= last:
                widen(active, r, r + 1 + (k != EAST), first, last + 1 + (k != NORTH))


@kernel
def restore(height, sink, level, box):
    """Cells of `sink` go back to their `level`; returns what is taken away [m of one cell]."""
    gone = 0.0
    for r in range(box[0], box[1]):
        for c in range(box[2], box[3]):
            if sink[r, c]:
                gone += height[r, c] - level[r, c]
                height[r, c] = level[r, c]
    return gone


def work_shape(height: np.ndarray) -> tuple[int, int, int]:
    """Shape of the work space for `height` [rows, cols]; it has the same type."""
    return 5, height.shape[0] + 1, height.shape[1] + 1


@entry
def relax_by_neighbours(
    height: np.ndarray,
    solid: np.ndarray | None,
    sink: np.ndarray | None,
    cell: float,
    slope: float,
    tolerance: float,
    eight: bool,
    most: int,
    active: np.ndarray,
    work: np.ndarray,
) -> tuple[int, float]:
    """Relax `height` [rows, cols] m in place, in its own precision, until no neighbour is lower by more than repose.

    Within the share `tolerance` of repose, or for `most` sweeps. Soil enters no `solid` cell, and what enters a `sink`
    (both bool[rows, cols] or None) is taken away. `active` i8[4]: the rows and columns that may be unsettled, emptied
    when all is done. `work`: zeros of `work_shape`. Returns (sweeps, height taken away [m of one cell]).
    """
    rows, cols = height.shape
    real = height.dtype.type
    if solid is not None:
        for r in range(rows):
            for c in range(cols):
                work[ROOM, r, c] = real(0.0) if solid[r, c] else real(1.0)
    level = height if sink is None else height.copy()
    # Shares of all directions add up to 4 RATE, so that no cell gives more than it has over its neighbours.
    rates = (real(RATE), real(0.5 * RATE)) if not eight else (real(RATE * 2.0 / 3.0), real(RATE / 3.0))
    thresholds = (real(slope * cell), real(slope * cell * sqrt(2.0)))
    settled = (real(slope * cell * (1 + tolerance)), real(slope * cell * sqrt(2.0) * (1 + tolerance)))
    sweeps = 0
    gone = 0.0
    while active[1] > active[0] and sweeps < most:
        work[:ROOM] = 0
        since = 0
        box = (0, 0, 0, 0)
        while since < PATIENCE and sweeps < most:
            grow = since + 1
            box = (
                max(active[0] - grow, 0), min(active[1] + grow, rows), max(active[2] - grow, 0),
                min(active[3] + grow, cols),
            )  # fmt: skip
            sweep_neighbours(height, solid, work, rates, thresholds, settled, eight, box)
            if sink is not None:
                gone += restore(height, sink, level, box)
            sweeps += 1
            since += 1
        moving_cells(work, eight, box, active)
    return sweeps, gone
