"""What was aimed at, and where a report says how far it was reached."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

Row = Mapping[str, Any]
Report = Mapping[str, Any]


class Target(NamedTuple):
    """A figure that was aimed at; `measured` finds it in a report, or raises LookupError."""

    title: str
    bound: float
    is_least: bool
    measured: Callable[[Report], float]


def find(report: Report, column: str, **wanted: Any) -> float:
    """The largest value of a column in the rows that have the wanted values; LookupError if there is none."""
    found = [row[column] for row in report["rows"] if all(row.get(name) == value for name, value in wanted.items())]
    if not found:
        raise LookupError
    return max(found)


def _rate(case: str, worlds: int, threads: int) -> Callable[[Report], float]:
    wanted = {"case": case, "rows": 64, "num_envs": worlds, "threads": threads, "drive": "random"}
    return lambda report: find(report, "steps_per_s", **wanted)


def _growth(case: str) -> Callable[[Report], float]:
    wanted = {"case": case, "num_envs": 1, "drive": "random"}
    return lambda report: (
        find(report, "us_per_step", rows=1024, **wanted) / find(report, "us_per_step", rows=64, **wanted)
    )


def _first_step(cache: str) -> Callable[[Report], float]:
    return lambda report: {row["cache"]: row["seconds"] for row in report.get("start") or []}[cache]


def _push(size: int) -> Callable[[Report], float]:
    wanted = {"drive": "full_load", "rows": size, "yaw": 0.0, "tolerance": 4e-3}
    return lambda report: 1e-3 * find(report, "us_per_step", **wanted)


def _leak(report: Report) -> float:
    found = report.get("memory") or {}
    return found["after_resets_mb"] - found["before_mb"]


TARGETS = (
    Target("single environment, steps/s", 30_000, True, _rate("single", 1, 1)),
    Target("native batch of 256 on one thread, steps/s", 150_000, True, _rate("native", 256, 1)),
    Target("native batch of 256 on two threads, steps/s", 300_000, True, _rate("native", 256, 2)),
    Target(
        "full load, tolerance 1e-3, us per cell of travel (worst yaw)",
        10.0,
        False,
        lambda report: find(report, "us_per_cell", drive="full_load", tolerance=1e-3),
    ),
    Target("physics on 1024 x 1024 cells, times that on 64 x 64", 2.0, False, _growth("world")),
    Target("environment on 1024 x 1024 cells, times that on 64 x 64", 2.0, False, _growth("single")),
    Target("blade update on 81 x 81 cells, ms (peer: 0.44)", 0.044, False, _push(81)),
    Target("blade update on 161 x 161 cells, ms (peer: 3.4)", 0.34, False, _push(161)),
    Target("blade update on 321 x 321 cells, ms (peer: 42)", 4.2, False, _push(321)),
    Target("first step with nothing compiled, s", 20.0, False, _first_step("cold")),
    Target("first step with a warm cache, s", 2.0, False, _first_step("warm")),
    Target("memory gained over a million steps and 10,000 resets, MB", 5.0, False, _leak),
)


def targets(report: Report) -> list[list[str]]:
    """Measured beside target, and whether it is met."""
    lines = [["64 x 64 cells, random driving unless said otherwise", "target", "measured", ""]]
    for target in TARGETS:
        bound = f"{'>=' if target.is_least else '<='} {target.bound:,g}"
        try:
            value = target.measured(report)
        except LookupError:
            lines.append([target.title, bound, "not measured", ""])
            continue
        met = value >= target.bound if target.is_least else value <= target.bound
        shown = f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
        lines.append([target.title, bound, shown, "met" if met else "**missed**"])
    return lines
