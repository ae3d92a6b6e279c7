"""The blade on a curve: fine steps near grade, where a centimetre matters, and coarse ones when it is lifted."""

from math import sinh

import numpy as np

from dirt_env.task.actions import ACTIONS

BLADE = ACTIONS.index("blade")


def to_blade(actions: np.ndarray, fineness: float) -> np.ndarray:
    """Actions [n, 3] of a network, in [-1, 1], as the world takes them: the blade u becomes sinh(f u) / sinh(f).

    Near 0 that is finer by f / sinh(f), 0.067 for a `fineness` f of 5; -1 and 1 stay. With 0 all stays as it is.
    """
    if fineness == 0.0:
        return actions
    result = np.array(actions)
    result[:, BLADE] = np.sinh(fineness * result[:, BLADE]) / sinh(fineness)
    return result


def from_blade(actions: np.ndarray, fineness: float) -> np.ndarray:
    """The other way round: what a network has to say for these actions [n, 3] of the world."""
    if fineness == 0.0:
        return actions
    result = np.array(actions)
    result[:, BLADE] = np.arcsinh(sinh(fineness) * result[:, BLADE]) / fineness
    return result
