"""Bank and loose soil: undisturbed soil that is dug or slumps away takes more room from then on.

Two maps tell them apart: `now`, the surface of the undisturbed (bank) soil, and `natural`, what it was at the start.
What lies above `now` is loose. Where the ground is taken down below it, the depth that it loses has loosened, and the
share `swell` of that depth is added to the ground. All heights being multiples of the quantum, the depth d = natural -
now of a cell has brought loosened(d) = swell d, rounded to the quantum, in all, however many cuts it took. So

    sum(height) + what was lost = sum(height at the start) + sum(loosened(natural - now))

holds to the last bit, and rounding never adds up. Loose soil stays loose: nothing compacts it.
"""

from typing import NamedTuple

import numpy as np

from dirt_env.sim.jit import kernel
from dirt_env.sim.lanes import choose
from dirt_env.sim.laws import quantise


class Bank(NamedTuple):
    """The undisturbed soil of a world: its surface `now`, `natural` at the start, f4[rows, cols] m, and its swell."""

    now: np.ndarray
    natural: np.ndarray
    swell: float


@kernel
def bank_of(now, natural, swell):
    """The Bank of two maps, or None of None."""
    if now is None:
        return None
    return Bank(now, natural, swell)


@kernel
def loosened(depth, swell, lock):
    """What undisturbed soil of a `depth` [m] has grown by as it loosened [m], a multiple of the quantum."""
    return quantise(type(depth)(swell * depth), lock)


@kernel
def growth(bank, r, c, height, lock):
    """What is to be added [m] when the ground of cell (r, c) is taken down to `height` [m]; 0 above the bank soil."""
    now, natural = bank.now[r, c], bank.natural[r, c]
    if height >= now:
        return type(height)(0.0)
    return loosened(natural - height, bank.swell, lock) - loosened(natural - now, bank.swell, lock)


@kernel
def loosen(height, bank, r0, r1, c0, c1, lock, box):
    """Loosen the bank soil that has slumped away in [r0, r1) x [c0, c1): what it grows by stays in its cell.

    Writes the cells that grew into `box` i8[4]; returns whether there are any.
    """
    top, bottom, left, right = r1, r0 - 1, c1, c0 - 1
    for r in range(r0, r1):
        for c in range(c0, c1):
            if height[r, c] < bank.now[r, c]:
                more = growth(bank, r, c, height[r, c], lock)
                bank.now[r, c] = height[r, c]
                if more > 0:
                    height[r, c] += more
                    top, bottom, left, right = min(top, r), max(bottom, r), min(left, c), max(right, c)
    box[0], box[1], box[2], box[3] = top, bottom + 1, left, right + 1
    return bottom >= top


@kernel
def bank_metres(height, now, target, share):
    """Soil over a target as metres of bank soil, loose soil counting by `share` = 1 / (1 + swell); of `lanes` of cells.

    Negative where soil is missing, which will be loose.
    """
    in_bank = (height > target) & (now > target)
    return choose(in_bank, (now - target) + share * (height - now), share * (height - target))


@kernel
def bank_gain(height, now, natural, target, share):
    """What columns hold more than they did when they reached up to `target`, as metres of bank soil; of `lanes`."""
    start = choose(target < natural, target, natural)
    return (now - start) + share * ((height - now) - (target - start))
