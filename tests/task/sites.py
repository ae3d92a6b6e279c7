"""Small sites for the tests of the task, with what a layout of `dirt_env.scene` holds."""

from types import SimpleNamespace

import numpy as np

CELL = 0.5


def site(rows: int = 20, cols: int = 30, **fields) -> SimpleNamespace:
    """Flat ground of height 0, a goal of 2 x 2 m in the north-east corner and nothing to do; fields replace its own."""
    goal = np.zeros((rows, cols), bool)
    goal[-4:, -4:] = True
    flat = np.zeros((rows, cols))
    place = {
        "height": flat,
        "target": flat,
        "start": np.zeros_like(goal),
        "goal": goal,
        "design": None,
        "solid": None,
        "soil": 1.0,
    }
    return SimpleNamespace(**{**place, **fields})


def heaped(height: float = 1.0) -> SimpleNamespace:
    """A site with one heaped cell at row 2, column 3 in its start region."""
    ground = np.zeros((20, 30))
    ground[2, 3] = height
    return site(height=ground, start=ground > 0, soil=height * CELL**2)
