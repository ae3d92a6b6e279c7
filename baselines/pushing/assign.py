"""Which goal the soil of each cell is taken to: the one with room that costs least."""

import numpy as np


def assign(cost: np.ndarray, volume: np.ndarray, room: np.ndarray) -> np.ndarray:
    """Goal of each cell, int [cells], for `cost` [cells, goals] and `volume` [cells], so that `room` [goals] suffices.

    Cells that would lose most by going elsewhere choose first. What fits nowhere goes where most room is left.
    """
    cells, goals = cost.shape
    chosen = np.zeros(cells, int)
    if goals < 2 or cells == 0:
        return chosen
    best_two = np.partition(cost, 1, axis=1)
    order = np.argsort(best_two[:, 0] - best_two[:, 1], kind="stable")
    preference = np.argsort(cost, axis=1, kind="stable")
    left = np.asarray(room, float).copy()
    for i in order:
        goal = next((g for g in preference[i] if left[g] >= volume[i]), int(left.argmax()))
        chosen[i] = goal
        left[goal] -= volume[i]
    return chosen
