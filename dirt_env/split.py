"""Which layouts are for training, for selection and for evaluation: the one place that says so.

A layout's id is the seed of the `reset` that draws it. Whatever is tuned or trained draws its seeds by
`training_seeds`; what is chosen among (checkpoints, settings) is compared on SELECTION; figures that are reported come
from EVALUATION, and nothing else may look at those.
"""

import numpy as np

TRAINING = range(8_000)
SELECTION = range(8_000, 10_000)
EVALUATION = range(10_000, 20_000)
SPLITS = {"training": TRAINING, "selection": SELECTION, "evaluation": EVALUATION}


def layouts(split: str, count: int) -> tuple[int, ...]:
    """The first `count` layouts of a part, always the same ones; ValueError for more than it has."""
    if split not in SPLITS:
        raise ValueError(f"split is {split!r}; allowed: {', '.join(SPLITS)}")
    seeds = SPLITS[split]
    if not 1 <= count <= len(seeds):
        raise ValueError(f"layouts is {count!r}; allowed: 1 to {len(seeds)} of {split}")
    return tuple(seeds[:count])


def training_seeds(generator: np.random.Generator, count: int) -> list[int]:
    """`count` different layouts to train or tune on; ValueError for more than there are."""
    if not 1 <= count <= len(TRAINING):
        raise ValueError(f"count is {count!r}; allowed: 1 to {len(TRAINING)} training layouts")
    return [TRAINING[int(i)] for i in generator.choice(len(TRAINING), count, replace=False)]
