"""The info of a batch in Gymnasium's form: an array for each number, and a mask of the worlds that have it."""

from typing import Any

import numpy as np

from dirt_env.task.reward import TERMS
from dirt_env.task.step import FIRST_TERM, INFO, REWARD

Infos = dict[str, Any]
_KEYS = {names: (*names, *(f"_{name}" for name in names)) for names in (INFO, TERMS)}  # numbers, then their masks


def batch_infos(figures: np.ndarray, present: np.ndarray, stepped: np.ndarray) -> Infos:
    """Infos of the worlds `present` bool[n], with the reward's terms of those that were `stepped` bool[n].

    The arrays are rows of `figures` f8[FIGURES, n], which is altered: 0 where a world has none.
    """
    if not np.count_nonzero(present):
        return {}
    infos = _columns(INFO, figures[:FIRST_TERM], present)
    infos["is_success"] = infos["is_success"] == 1.0
    if np.count_nonzero(stepped):
        infos["reward"] = _columns(TERMS, figures[FIRST_TERM:REWARD], stepped)
        infos["_reward"] = stepped.copy()
    return infos


def end_infos(final: Infos, observations: dict[str, np.ndarray], ended: np.ndarray) -> Infos:
    """`final_obs` and `final_info` of the worlds that have `ended` bool[n], from the infos and observations then."""
    last = np.full(len(ended), None, dtype=object)
    for world in np.flatnonzero(ended):
        last[world] = {name: array[world].copy() for name, array in observations.items()}
    infos: Infos = {"final_obs": last, "_final_obs": ended.copy()}
    if final:
        infos |= {"final_info": final, "_final_info": ended.copy()}
    return infos


def _columns(names: tuple[str, ...], rows: np.ndarray, mask: np.ndarray) -> Infos:
    """Each row under its name, 0 where not `mask`, and a mask of its own for each."""
    if np.count_nonzero(mask) < len(mask):
        rows[:, ~mask] = 0.0
    masks = np.empty(rows.shape, bool)
    masks[:] = mask
    return dict(zip(_KEYS[names], [*rows, *masks], strict=True))
