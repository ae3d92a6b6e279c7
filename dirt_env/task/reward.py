"""Reward terms: named, without weights; an episode's reward is their weighted sum."""

from math import log
from typing import NamedTuple

from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import GRAVITY
from dirt_env.sim.params import Soil
from dirt_env.task.goal import Remaining

TERMS = ("work", "energy", "time", "spill", "success", "log_work")
TAIL = 0.05  # share of what there was to do below which its logarithm becomes a straight line
INSIDE = 3.0  # m that soil outside the goal counts as farther away by `log_work`: at the rim it would slump out again


class Scale(NamedTuple):
    """What the terms of one episode are measured in.

    `potential` [m4] at the start, and `deep` [m4], the same with all misplaced soil INSIDE farther away; `energy` [J]
    of dragging all the soil straight to the goal; `steps` in the nominal job time; `soil` [m3] to move.
    """

    potential: float
    deep: float
    energy: float
    steps: float
    soil: float


class ToDo(NamedTuple):
    """What of a job is left: its potential [m4] and the misplaced soil [m3], as in `Remaining`."""

    potential: float
    misplaced: float


def scale_of(start: Remaining, soil: Soil, volume: float, period: float, time: float) -> Scale:
    """Scales of an episode that starts with `start`, has `volume` m3 to move and control steps of `period` s."""
    potential = max(start.potential, 1e-9)
    heavy = soil.density * (1.0 + soil.swell) * GRAVITY  # volumes are those of bank soil
    energy = max(heavy * soil.friction * potential, 1e-9)  # without friction nothing takes work
    return Scale(potential, max(_deep(start), 1e-9), energy, time / period, max(volume, 1e-9))


@kernel
def _deep(left):
    """The potential [m4] if all misplaced soil had INSIDE farther to go than to the goal's rim."""
    return left.potential + INSIDE * left.misplaced


@kernel
def reward_terms(
    before: ToDo, after: ToDo, energy: float, lost: float, finished: bool, scale: Scale
) -> tuple[float, float, float, float, float, float]:
    """The TERMS of one step from what was to do `before` to `after` that took `energy` [J] and lost `lost` [m3].

    The first and the last are differences of potentials: over any loop they add up to nothing, over a whole job to 1.
    """
    return (
        (before.potential - after.potential) / scale.potential,
        -energy / scale.energy,
        -1.0 / scale.steps,
        -lost / scale.soil,
        1.0 if finished else 0.0,
        log((_deep(before) / scale.deep + TAIL) / (_deep(after) / scale.deep + TAIL)) / log((1.0 + TAIL) / TAIL),
    )
