"""What is still to move: misplaced volume, and the potential whose fall is the work done."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from dirt_env.sim.bank import Bank, bank_gain, bank_metres
from dirt_env.sim.intrinsics import flat
from dirt_env.sim.jit import entry, kernel
from dirt_env.sim.lanes import LANES, choose, doubles, has, load, ramp, total
from dirt_env.task.job import Job
from dirt_env.task.kinds import DESIGN, GOAL, OUTSIDE, STRAY

SUMS = 6
SIDE = LANES  # rows and columns of cells that are added up together


class Remaining(NamedTuple):
    """The state of a job.

    `potential` [m4] is misplaced volume times the way it has to go; `misplaced` [m3] lies above the target outside the
    goal; `moved` [m3] has come to where it belongs; `stray` [m3] is the part of `misplaced` that lies outside the start
    region too; `grade_error` [m] is the root mean square of height minus design, 0 in jobs without a design. Where soil
    swells, volumes and potential are those of bank soil.
    """

    potential: float
    misplaced: float
    moved: float
    stray: float
    grade_error: float


class Sums(NamedTuple):
    """Sums over parts of the ground; they depend on it alone, and not on how it came to be.

    `blocks` f8[bands, blocks of a band, SUMS] of SIDE x SIDE cells, `bands` f8[bands, SUMS] of blocks, `total`
    f8[SUMS], and `result` f8[5], as in `Remaining`. A block that changed is added up anew, and then all in one order.
    """

    blocks: np.ndarray
    bands: np.ndarray
    total: np.ndarray
    result: np.ndarray


def make_sums(rows: int, cols: int) -> Sums:
    """Sums of a site of so many cells, to be filled by `measure` of the whole of it."""
    bands, blocks = -(-rows // SIDE), -(-cols // SIDE)
    shapes = (bands, blocks, SUMS), (bands, SUMS), SUMS, len(Remaining._fields)
    return Sums(*map(np.zeros, shapes))


class Gauge:
    """Measures a job; only the parts of the ground that changed are added up again."""

    def __init__(self, job: Job, cell: float) -> None:
        self._job = job
        self._cell = cell
        self._sums = make_sums(*job.target.shape)

    def measure(self, height: np.ndarray, changed: np.ndarray | None = None, bank: Bank | None = None) -> Remaining:
        """What is still to move of height[rows, cols].

        `changed` are the bounds r0, r1, c0, c1 of the cells that differ from those of the last call; None is all.
        """
        bounds = _everything(height) if changed is None else changed
        measure(height, self._job, self._cell, bounds, self._sums, bank)
        return Remaining(*self._sums.result.tolist())


def _everything(height: np.ndarray) -> np.ndarray:
    return np.array([0, height.shape[0], 0, height.shape[1]])


@entry
def measure(height, job: Job, cell, changed, sums: Sums, bank: Bank | None = None):
    """Add up the blocks of height[rows, cols] in which the cells changed[0]:changed[1], changed[2]:changed[3] lie.

    Fills `sums`; those of the other blocks have to be there from an earlier call.
    """
    if changed[0] < changed[1] and changed[2] < changed[3]:
        for b in range(changed[0] // SIDE, (changed[1] - 1) // SIDE + 1):
            for k in range(changed[2] // SIDE, (changed[3] - 1) // SIDE + 1):
                _add_block(height, job, b * SIDE, k * SIDE, sums.blocks[b, k], bank)
            _add_up(sums.blocks[b], sums.bands[b])
    _add_up(sums.bands, sums.total)
    _conclude(job, cell * cell, sums.total, sums.result)


@kernel
def _add_block(height, job, r0, c0, block, bank):
    """Fill block[SUMS] for the cells from row r0 and column c0 on.

    The sums [m of one cell]: soil above the target times its way, that outside the goal, that which is stray; gain in
    the goal; what the design lacks; the square of its error.
    """
    rows, cols = height.shape
    n = cols - c0
    ground, targets, hauls, kinds = flat(height), flat(job.target), flat(job.haul), flat(job.kind)
    way, over, stray = ramp(0.0, 0.0), ramp(0.0, 0.0), ramp(0.0, 0.0)
    gain, lack, square = ramp(0.0, 0.0), ramp(0.0, 0.0), ramp(0.0, 0.0)
    for r in range(r0, min(r0 + SIDE, rows)):
        p = r * cols + c0
        here, target = load(ground, p, n), load(targets, p, n)
        off = doubles(here - target)
        gained, error = off, off
        if bank is not None:
            share, level, aim = 1.0 / (1.0 + bank.swell), doubles(here), doubles(target)
            now, natural = doubles(load(flat(bank.now), p, n)), doubles(load(flat(bank.natural), p, n))
            off, gained = bank_metres(level, now, aim, share), bank_gain(level, now, natural, aim, share)
        bits = load(kinds, p, n)
        above = choose(off > 0.0, off, 0.0)
        way += above * doubles(load(hauls, p, n))
        over += choose(has(bits, OUTSIDE), above, 0.0)
        stray += choose(has(bits, STRAY), above, 0.0)
        gain += choose(has(bits, GOAL), gained, 0.0)
        if job.design_cells > 0.0:
            in_design = has(bits, DESIGN)
            lack += choose(in_design & (off < 0.0), 0.0 - off, 0.0)
            square += choose(in_design, error * error, 0.0)
    block[0], block[1], block[2] = total(way), total(over), total(stray)
    block[3], block[4], block[5] = total(gain), total(lack), total(square)


@kernel
def _add_up(parts, whole):
    """Sum parts[n, SUMS] over the parts to whole[SUMS]."""
    way = over = stray = gain = lack = square = 0.0
    for i in range(parts.shape[0]):
        way += parts[i, 0]
        over += parts[i, 1]
        stray += parts[i, 2]
        gain += parts[i, 3]
        lack += parts[i, 4]
        square += parts[i, 5]
    whole[0], whole[1], whole[2], whole[3], whole[4], whole[5] = way, over, stray, gain, lack, square


@kernel
def _conclude(job, area, whole, result):
    """Fill result[5] (see Remaining) from the sums over all cells; `area` of a cell [m2]."""
    way, over, stray, gain, lack, square = whole[0], whole[1], whole[2], whole[3], whole[4], whole[5]
    result[0] = (way + job.mean_haul * lack) * area
    result[1] = over * area
    result[2] = max(0.0, min(gain * area + job.missing - lack * area, job.soil - over * area))
    result[3] = stray * area
    result[4] = sqrt(square / job.design_cells) if job.design_cells > 0.0 else 0.0
