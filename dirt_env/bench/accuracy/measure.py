"""One row of the report: error and processor time of one method at one problem."""

from functools import lru_cache
from math import isfinite
from statistics import median
from time import thread_time
from typing import Any

from dirt_env.bench.accuracy.case import Case
from dirt_env.bench.accuracy.catalogue import PROBLEMS
from dirt_env.bench.accuracy.errors import errors, relative_l1
from dirt_env.bench.accuracy.methods import METHODS, Settings
from dirt_env.bench.accuracy.plan import Item
from dirt_env.bench.accuracy.studies import STUDIES
from dirt_env.bench.accuracy.targets import target_of

REPEATS = 7  # at least, of which the median counts
MOST_REPEATS, ENOUGH = 101, 0.1  # no more, once so many seconds are spent
FLOOR_TOLERANCE = 1e-5
FLOOR_CELLS = 128  # resolution up to which the floor is computed

# A row's columns, in this order. `cpu_ms`: median of `repeats`, compilation excluded. `floor`: the error that remains
# when the grid's own equations are solved to 1e-5 in float64. `value`, `spread`, `unit`, `setting` are of the studies.
COLUMNS = (
    "problem", "method", "cells", "tolerance", "cap", "precision", "setting", "cpu_ms", "repeats", "rel_l1", "linf",
    "roundness", "slope", "volume_error", "sweeps", "floor", "value", "spread", "unit", "target_rel_l1", "target_ms",
)  # fmt: skip


def measure(item: Item) -> dict[str, Any]:
    """Run it, and return its row; what is not defined there is None."""
    row = dict.fromkeys(COLUMNS) | item._asdict()
    row["target_rel_l1"], row["target_ms"] = target_of(item.problem, item.cells)
    if study := STUDIES.get(item.problem):
        row |= {"unit": study.unit} | study.measure(item.method, item.cells, item.setting)
    else:
        row |= _measured(item)
    return {name: _plain(value) for name, value in row.items()}


def _measured(item: Item) -> dict[str, Any]:
    case, method = _case(item.problem, item.cells), METHODS[item.method]
    settings = Settings(item.tolerance, item.cap, item.precision)
    trial = method.prepare(case, settings)
    sweeps = trial.run()  # compiles
    found = errors(trial, case)
    times: list[float] = []
    while len(times) < REPEATS or (sum(times) < ENOUGH and len(times) < MOST_REPEATS):
        trial = method.prepare(case, settings)
        begin = thread_time()
        trial.run()
        times.append(thread_time() - begin)
    return found | {
        "cpu_ms": 1e3 * median(times),
        "repeats": len(times),
        "sweeps": sweeps,
        "floor": _floor(item.problem, item.cells),
    }


@lru_cache(maxsize=2)
def _case(problem: str, cells: int) -> Case:
    return PROBLEMS[problem].make(cells)


@lru_cache(maxsize=64)
def _floor(problem: str, cells: int) -> float | None:
    kind, most = PROBLEMS[problem].kind, min(PROBLEMS[problem].long, FLOOR_CELLS)
    if kind not in ("settle", "drain", "pour once") or cells > most:
        return None
    case = _case(problem, cells)
    trial = METHODS["explicit"].prepare(case, Settings(FLOOR_TOLERANCE, None, "f8"))
    trial.run()
    return relative_l1(trial.height(), case)


def _plain(value: Any) -> Any:
    """The value as JSON knows it; numbers that are not finite as None."""
    if isinstance(value, (str, int)) or value is None:
        return value
    return float(value) if isfinite(value) else None
