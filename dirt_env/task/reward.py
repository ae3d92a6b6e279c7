"""Reward terms: named, without weights; an episode's reward is their weighted sum."""

from typing import NamedTuple

from dirt_env.sim.jit import kernel
from dirt_env.sim.laws import GRAVITY
from dirt_env.sim.params import Soil
from dirt_env.task.goal import Remaining

TERMS = ("work", "energy", "time", "spill", "success")


class Scale(NamedTuple):
    """What the terms of one episode are measured in.

    `potential` [m4] at the start; `energy` [J] of dragging all the soil straight to the goal; `steps` in the nominal
    job time; `soil` [m3] to move.
    """

    potential: float
    energy: float
    steps: float
    soil: float


def scale_of(start: Remaining, soil: Soil, volume: float, period: float, time: float) -> Scale:
    """Scales of an episode that starts with `start`, has `volume` m3 to move and control steps of `period` s."""
    potential = max(start.potential, 1e-9)
    energy = max(soil.density * GRAVITY * soil.friction * potential, 1e-9)  # without friction nothing takes work
    return Scale(potential, energy, time / period, max(volume, 1e-9))


@kernel
def reward_terms(
    before: float, after: float, energy: float, lost: float, finished: bool, scale: Scale
) -> tuple[float, float, float, float, float]:
    """The TERMS of one step from the potential `before` to `after` [m4] that took `energy` [J] and lost `lost` [m3].

    The first is a difference of potentials: over any loop it adds up to nothing, over a whole job to 1.
    """
    return (
        (before - after) / scale.potential,
        -energy / scale.energy,
        -1.0 / scale.steps,
        -lost / scale.soil,
        1.0 if finished else 0.0,
    )
