"""Long avalanches: super-time-stepping with exact volume, many sweeps' worth of slumping for few sweeps' work.

A super-step of s stages is worth s (s + 1) / 2 explicit sweeps: the Runge-Kutta-Legendre method of first order (Meyer,
Balsara and Aslam 2014), Y_j = mu_j Y_{j-1} + (1 - mu_j) Y_{j-2} + ..., with mu_j = (2 j - 1) / j. Written for what
crosses a link in stage j it is a sweep with momentum,

    H_j = (j - 1) / j H_{j-1} + a (2 j - 1) / j F(Y_{j-1}),   Y_j = Y_{j-1} - div H_j,

in which s no longer appears: a super-step can end after any stage. What crosses a link is rounded every few stages, and
what that leaves over stays in Y: heights are exact, and rounding makes no noise (see `stages.carry`).
"""

from math import sqrt

import numpy as np

from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.laws import RATE
from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.sheet import (
    FINE,
    GROUND,
    HALF,
    NEXT,
    RATE_X,
    RATE_Y,
    drain_rim,
    move_flows,
    new_sheet,
    pack_ground,
    pack_links,
    reached,
    unpack_ground,
)
from dirt_env.sim.slump import limits
from dirt_env.sim.stages import lean_stages, masked_stage, weights
from dirt_env.sim.state import World
from dirt_env.sim.unsettled import count_unsettled
from dirt_env.sim.window import clear, widen, window_around

LOOK = 4  # stages between two looks whether all is settled and whether the window is wide enough
BAND = LOOK + 2  # cells along the window's sides that soil may not have reached at a look
SHARE = 0.25  # length of a super-step, as a share of the pseudo-time before it


@kernel
def largest_drop(sheet, ground, stride, tall):
    """Largest height difference over a link that is swept [m]."""
    rate_x, rate_y, work = sheet[RATE_X], sheet[RATE_Y], sheet[HALF]
    n = tall * stride
    drop_lines(ground[stride + 1 :], ground[2 * stride + 1 :], rate_x[stride + 1 :], rate_y[stride + 1 :], work, n)
    largest = work[0]
    for p in range(1, n):
        largest = max(largest, work[p])
    return largest


@kernel
def drop_lines(here, high, rate_x, rate_y, result, n):
    """The larger of the differences over the two links of n cells."""
    for p in range(n):
        result[p] = max(rate_x[p] * abs(here[p + 1] - here[p]), rate_y[p] * abs(high[p] - here[p]))


@kernel
def stages_allowed(elapsed, largest, quantum, most):
    """How many stages the next super-step may have, after `elapsed` pseudo-time (one sweep is worth RATE).

    Its worth, RATE s (s + 1) / 2, is at most SHARE of `elapsed`, and no flow exceeds `most` quanta, which rounding
    can take.
    """
    stages = (sqrt(1.0 + 8.0 * SHARE * elapsed / RATE) - 1.0) / 2.0
    if largest > 0:
        stages = min(stages, most * quantum / (2.0 * RATE * largest))
    return max(int(stages), 1)


@kernel
def grown(window, sides, largest):
    """The window with the `sides` that soil has come near to (see `sheet.reached`) moved outwards."""
    r0, r1, c0, c1 = window
    more = BAND + 2 + max(r1 - r0, c1 - c0) // 8
    return (
        max(r0 - more, largest[0]) if sides & 1 else r0,
        min(r1 + more, largest[1]) if sides & 2 else r1,
        max(c0 - more, largest[2]) if sides & 4 else c0,
        min(c1 + more, largest[3]) if sides & 8 else c1,
    )


@kernel
def avalanche(height, solid, outside, changed, pending, cell, soil, quantum, elapsed, most):
    """`slump.relax` by super-steps: at most `most` stages, the ground having slumped for `elapsed` pseudo-time before.

    Returns (stages, height lost over an open border [m of one cell]).
    """
    rows, cols = height.shape
    real = height.dtype.type
    border = 0 if outside is None else 1
    largest = (-border, rows + border, -border, cols + border)
    threshold, settled, lock = limits(height, quantum, cell, soil.slope, soil.tolerance)
    masked = solid is not None or outside is not None
    together = 1 if outside is not None else LOOK  # stages whose flows are rounded together; the ledger is of each
    exact = 2.0**22 / together if height.itemsize == 4 else np.inf  # quanta that one of them may carry
    stages = stage = length = sides = 0
    lost = 0.0
    window = window_around(pending, BAND + 2, rows, cols, border)
    sheet, stride = new_sheet(height, (0, 0, 0, 0))
    ground, fine, after = sheet[GROUND], sheet[FINE], sheet[NEXT]
    before = (0, 0, 0, 0)
    tall = 0
    while True:
        if window != before:
            old, old_stride = sheet, stride
            sheet, stride = new_sheet(height, window)
            ground, fine, after = sheet[GROUND], sheet[FINE], sheet[NEXT]
            tall = window[1] - window[0]
            pack_ground(height, sheet, stride, window)
            pack_links(solid, outside, sheet, stride, window, rows, cols, masked)
            move_flows(old, old_stride, before, sheet, stride, window)
            if outside is not None:
                drain_rim(outside, ground, ground, fine, stride, window, rows, cols)
            before = window
        if stages % LOOK == 0:
            if count_unsettled(sheet, ground, stride, tall, masked, settled) == 0:
                clear(pending)
                break
            sides = reached(height, ground, stride, window, largest, BAND)
            if sides:
                unpack_ground(height, ground, stride, window)
                widen(changed, max(window[0], 0), min(window[1], rows), max(window[2], 0), min(window[3], cols))
                window = grown(window, sides, largest)
                continue
        if stages >= most:
            pending[0], pending[1] = max(window[0], 0), min(window[1], rows)
            pending[2], pending[3] = max(window[2], 0), min(window[3], cols)
            break
        if stage == length:
            elapsed += RATE * stage * (stage + 1) / 2
            length = stages_allowed(elapsed, largest_drop(sheet, ground, stride, tall), quantum, exact)
            stage = 0
        run = min(length - stage, most - stages, together, LOOK - stages % LOOK)
        if masked:
            for i in range(run):
                if outside is not None:
                    sheet[HALF] = ground
                momentum, gain = weights(stage + i + 1, real)
                masked_stage(sheet, fine, after, stride, tall, momentum, gain, threshold, lock, i == run - 1)
                if outside is not None:
                    lost += drain_rim(outside, sheet[HALF], ground, after, stride, window, rows, cols)
                fine, after = after, fine
        else:
            lean_stages(sheet, fine, after, stride, window, rows, cols, stage, run, threshold * threshold, lock)
            if run % 2 == 1:
                fine, after = after, fine
        stage += run
        stages += run
    unpack_ground(height, ground, stride, window)
    widen(changed, max(window[0], 0), min(window[1], rows), max(window[2], 0), min(window[3], cols))
    return stages, lost


@entry
def settle_long(world: World, grid: Grid, soil: Soil, elapsed: float) -> int:
    """Relax what is pending of a world whose blade is up; returns the stages it took. See `avalanche`."""
    stages, lost = avalanche(
        world.height, world.solid, world.outside, world.changed, world.pending, grid.cell, soil, world.quantum,
        elapsed, soil.max_sweeps,
    )  # fmt: skip
    world.tally[0].lost += lost * grid.cell**2
    return stages


@entry
def is_settled(world: World, grid: Grid, soil: Soil) -> bool:
    """Whether no open link of a world with walls and nothing solid is steeper than what counts as settled."""
    height = world.height
    _, settled, _ = limits(height, world.quantum, grid.cell, soil.slope, soil.tolerance)
    window = (0, grid.rows, 0, grid.cols)
    sheet, stride = new_sheet(height, window)
    pack_ground(height, sheet, stride, window)
    pack_links(None, None, sheet, stride, window, grid.rows, grid.cols, False)
    return count_unsettled(sheet, sheet[GROUND], stride, grid.rows, False, settled) == 0
