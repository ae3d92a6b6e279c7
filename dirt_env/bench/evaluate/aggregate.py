"""Statistics of evaluations, after Agarwal et al. 2021 (rliable): pure functions of the runs of several tasks.

`tasks` is a sequence of arrays, one for each task, with one number for each run (the columns of a runs x tasks matrix);
lengths may differ. Intervals are 95 % percentile intervals of a bootstrap that draws runs anew within each task. The
generator starts from the same seed at every call, so the same runs are drawn for every policy: pairs stay pairs.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

Tasks = Sequence[np.ndarray]
RESAMPLES, SEED, LEVEL = 2000, 0, 0.95


class Estimate(NamedTuple):
    """A figure and the bounds of its interval."""

    value: float
    low: float
    high: float


def iqm(runs: np.ndarray) -> np.ndarray:
    """Interquartile mean over the last axis: a quarter of the runs is left out at either end, rounded down."""
    runs = np.sort(np.asarray(runs, float), axis=-1)
    cut = int(0.25 * runs.shape[-1])
    return runs[..., cut : runs.shape[-1] - cut].mean(axis=-1)


def resampled(tasks: Tasks, resamples: int = RESAMPLES, seed: int = SEED) -> list[np.ndarray]:
    """Runs drawn with replacement within each task: one array [resamples, runs, ...] for each task."""
    generator = np.random.default_rng(seed)
    return [np.asarray(runs)[generator.integers(0, len(runs), (resamples, len(runs)))] for runs in tasks]


def interval(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds between which the middle 95 % of the values [resamples, ...] lie."""
    outside = 50.0 * (1.0 - LEVEL)
    low, high = np.percentile(values, [outside, 100.0 - outside], axis=0)
    return low, high


def estimate(tasks: Tasks, statistic: Callable[[Tasks], np.ndarray]) -> Estimate:
    """A statistic, a function of tasks along the last axis, and its interval; ValueError for no runs."""
    if not tasks or not all(len(runs) for runs in tasks):
        raise ValueError(f"tasks have {[len(runs) for runs in tasks]} runs; allowed: one run or more of each")
    low, high = interval(statistic(resampled(tasks)))
    return Estimate(float(statistic(tasks)), float(low), float(high))


def iqm_of_all(tasks: Tasks) -> np.ndarray:
    """Interquartile mean of all runs of all tasks."""
    return iqm(np.concatenate([np.asarray(runs, float) for runs in tasks], axis=-1))


def interquartile_mean(tasks: Tasks) -> Estimate:
    """Interquartile mean of all runs with its interval."""
    return estimate(tasks, iqm_of_all)


def probability_of_improvement(tasks: Tasks, others: Tasks) -> float:
    """How likely a run is better than another's in a task taken at random; ties count half. Mann and Whitney's U."""
    shares = []
    for mine, theirs in zip(tasks, others, strict=True):
        gap = np.asarray(mine, float)[:, None] - np.asarray(theirs, float)[None, :]
        shares.append((gap > 0).mean() + 0.5 * (gap == 0).mean())
    return float(np.mean(shares))


def wins(tasks: Tasks) -> np.ndarray:
    """Mean over tasks of the share of runs that are positive; zeros count half. Along the last axis."""
    return np.mean([((runs > 0) + 0.5 * (runs == 0)).mean(axis=-1) for runs in tasks], axis=0)


def paired_improvement(tasks: Tasks, others: Tasks) -> Estimate:
    """How likely one is better than the other on the same layout of a task taken at random; ties count half.

    Run i of a task is on the same layout for both; pairs are drawn together. ValueError where the numbers differ.
    """
    if [len(runs) for runs in tasks] != [len(runs) for runs in others]:
        raise ValueError("the policies have different numbers of runs; allowed: pairs on the same layouts")
    gaps = [np.asarray(mine, float) - np.asarray(theirs, float) for mine, theirs in zip(tasks, others, strict=True)]
    return estimate(gaps, wins)


def profile(tasks: Tasks, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of all runs above each level [levels], and the bounds of its interval."""
    everything = np.concatenate([np.asarray(runs, float) for runs in tasks])
    drawn = np.concatenate(resampled(tasks), axis=-1)
    bounds = [interval((drawn > level).mean(axis=-1)) for level in levels]
    low, high = (np.array([bound[side] for bound in bounds]) for side in (0, 1))
    return np.array([(everything > level).mean() for level in levels]), low, high


def band(tasks: Tasks) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interquartile mean of curves, each task [runs, moments]: the mean [moments], and the bounds of its interval."""
    moments = [[np.asarray(runs)[:, k] for runs in tasks] for k in range(np.shape(tasks[0])[1])]
    found = [interquartile_mean(moment) for moment in moments]
    return tuple(np.array(part) for part in zip(*found, strict=True))
