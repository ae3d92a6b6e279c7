"""From records of episodes to the figures of an evaluation: plain values, whatever the order of the records."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from dirt_env.bench.evaluate.aggregate import (
    Estimate,
    band,
    interquartile_mean,
    paired_improvement,
    probability_of_improvement,
    profile,
)
from dirt_env.bench.evaluate.episode import METRICS
from dirt_env.bench.evaluate.suite import Task

COMPARED = "score"  # what pairs of policies are compared by
TAUS = np.round(np.linspace(0.0, 1.0, 51), 2)
Records = Mapping[tuple, Mapping[str, Any]]


def by_key(records: Iterable[Mapping[str, Any]]) -> dict[tuple, Mapping[str, Any]]:
    """Records by policy, job, level and layout."""
    return {tuple(record[name] for name in ("policy", "job", "level", "layout")): record for record in records}


def summarise(
    records: Records, policies: Sequence[str], tasks: Sequence[Task], layouts: Sequence[int]
) -> dict[str, Any]:
    """Every figure of an evaluation: `results`, `overall`, `pairs`, `curves` and `profiles` (docs/evaluation.md)."""

    def rows(policy: str, task: Task) -> list[Mapping[str, Any]]:
        return [records[policy, task.job, task.level, layout] for layout in layouts]

    def figures(policy: str, chosen: Sequence[Task]) -> dict[str, Any]:
        of_task = [[row["metrics"] for row in rows(policy, task)] for task in chosen]
        return {name: _figure([[metrics[name] for metrics in some] for some in of_task]) for name in METRICS}

    def scores(policy: str, chosen: Sequence[Task]) -> list[np.ndarray]:
        return [np.array([row["metrics"][COMPARED] for row in rows(policy, task)]) for task in chosen]

    def curves(policy: str, task: Task) -> dict[str, Any]:
        some = rows(policy, task)
        mean, low, high = band([np.array([row["curve"] for row in some])])
        seconds = np.linspace(0.0, some[0]["seconds"], len(mean))
        return {"time_s": _list(seconds), "iqm": _list(mean), "low": _list(low), "high": _list(high)}

    def pair(first: str, second: str) -> dict[str, Any]:
        some, others = scores(first, tasks), scores(second, tasks)
        each = [(_named(task), scores(first, [task]), scores(second, [task])) for task in tasks]
        return {
            "first": first,
            "second": second,
            "probability": _estimate(paired_improvement(some, others)),
            "unpaired": probability_of_improvement(some, others),
            "by_task": [{**name, **_estimate(paired_improvement(a, b))} for name, a, b in each],
        }

    def curve_of(policy: str) -> dict[str, Any]:
        share, low, high = profile(scores(policy, tasks), TAUS)
        return {"policy": policy, "share": _list(share), "low": _list(low), "high": _list(high)}

    sees = {policy: rows(policy, tasks[0])[0]["sees"] for policy in policies}
    each = [(task, policy, {**_named(task), "policy": policy}) for task in tasks for policy in policies]
    return {
        "policies": [{"name": policy, "sees": sees[policy]} for policy in policies],
        "results": [{**name, "metrics": figures(policy, [task])} for task, policy, name in each],
        "overall": [{"policy": policy, "metrics": figures(policy, tasks)} for policy in policies],
        "pairs": [pair(first, second) for first, second in combinations(policies, 2)],
        "curves": [{**name, **curves(policy, task)} for task, policy, name in each],
        "profiles": {"score": _list(TAUS), "policies": [curve_of(policy) for policy in policies]},
    }


def _named(task: Task) -> dict[str, Any]:
    return {"job": task.job, "level": task.level}


def _figure(values: Sequence[Sequence[float | None]]) -> dict[str, Any]:
    """Interquartile mean, interval, mean and number of the values of each task; a missing value does not count.

    Over several tasks there is no figure if one of them has no value at all.
    """
    there = [np.array([value for value in some if value is not None], float) for some in values]
    count = sum(map(len, there))
    if not all(map(len, there)):
        return {"iqm": None, "low": None, "high": None, "mean": None, "n": count}
    value, low, high = interquartile_mean(there)
    return {"iqm": value, "low": low, "high": high, "mean": float(np.concatenate(there).mean()), "n": count}


def _estimate(found: Estimate) -> dict[str, float]:
    return {"value": found.value, "low": found.low, "high": found.high}


def _list(values: np.ndarray) -> list[float]:
    return [float(value) for value in values]
