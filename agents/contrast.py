"""A learned policy against a scripted one: means and ratios, with intervals over training seeds and over layouts."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from dirt_env.bench.evaluate.aggregate import RESAMPLES, SEED, Estimate, interval

Records = Mapping[tuple, Mapping[str, Any]]


def matrix(records: Records, policies: Sequence[str], level: int, layouts: Sequence[int], metric: str) -> np.ndarray:
    """A metric of the default job, f8[policies, layouts]; NaN where an episode has none."""
    rows = [[records[policy, "heap", level, layout]["metrics"][metric] for layout in layouts] for policy in policies]
    return np.array(rows, float)


def drawn(runs: np.ndarray, generator: np.random.Generator, layouts: np.ndarray) -> np.ndarray:
    """Means [resamples] of runs[policies, layouts] with policies drawn anew, on these layouts [resamples, layouts]."""
    seeds = generator.integers(0, len(runs), (len(layouts), len(runs)))
    return np.array([runs[np.ix_(some, there)].mean() for some, there in zip(seeds, layouts, strict=True)])


def mean(runs: np.ndarray) -> Estimate:
    """Mean of runs[policies, layouts] and its 95 % interval; both policies (training seeds) and layouts are drawn."""
    generator, layouts = _layouts(runs.shape[1])
    return Estimate(float(runs.mean()), *map(float, interval(drawn(runs, generator, layouts))))


def ratio(runs: np.ndarray, others: np.ndarray) -> Estimate | None:
    """Mean of runs[policies, layouts] over that of others; layouts are drawn for both alike, policies for each.

    None where the others may have nothing.
    """
    generator, layouts = _layouts(runs.shape[1])
    mine, theirs = drawn(runs, generator, layouts), drawn(others, generator, layouts)
    if not theirs.all():
        return None
    return Estimate(float(runs.mean() / others.mean()), *map(float, interval(mine / theirs)))


def _layouts(count: int) -> tuple[np.random.Generator, np.ndarray]:
    generator = np.random.default_rng(SEED)
    return generator, generator.integers(0, count, (RESAMPLES, count))
