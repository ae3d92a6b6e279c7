"""Figures to reach, each for one problem at one resolution, and which row of a report is held against it."""

from typing import Any, NamedTuple


class Target(NamedTuple):
    """The best of `methods` at `problem` with `cells` should do no worse than `most` of `column`; in `ms` at most.

    `least` turns the bound of the column around. `setting`: of a study, how its row is called.
    """

    title: str
    problem: str
    cells: int
    methods: tuple[str, ...]
    column: str
    bound: float
    ms: float | None = None
    least: bool = False
    setting: str = ""


_SETTLING = ("default", "explicit", "super", "projection")
TARGETS = (
    Target("volume after 1e6 float32 steps of driving", "driving", 64, ("default",), "volume_error", 0.0,
           setting="1000000 steps"),
    Target("dump, 64 x 64", "dump", 64, ("water-filling",), "rel_l1", 2e-3, 0.02),
    Target("dump, 256 x 256", "dump", 256, ("water-filling",), "rel_l1", 2e-4, 0.15),
    Target("dump, 1024 x 1024", "dump", 1024, ("water-filling",), "rel_l1", 1e-5, 3.0),
    Target("column collapse, 64 x 64", "column-collapse", 64, _SETTLING, "rel_l1", 5e-3, 1.5),
    Target("column collapse, 64 x 64 (stretch)", "column-collapse", 64, _SETTLING, "rel_l1", 5e-3, 0.5),
    Target("column collapse, 256 x 256", "column-collapse", 256, _SETTLING, "rel_l1", 6e-3, 25.0),
    Target("column collapse, 1024 x 1024", "column-collapse", 1024, _SETTLING, "rel_l1", 7e-3, 300.0),
    Target("roundness, 64 x 64", "column-collapse", 64, _SETTLING, "roundness", 0.995, least=True),
    Target("trench with spoil, slow relaxation", "trench-spoil", 64, _SETTLING[:-1], "rel_l1", 1e-2, 2.2),
    Target("trench with spoil, one projection", "trench-spoil-at-once", 64, ("projection",), "rel_l1", 1e-2, 2.2),
    Target("1-D berm at whole cells", "berm", 64, ("blade",), "rel_l1", 3e-3),
    Target("1-D berm between cells", "berm-between", 64, ("blade",), "rel_l1", 8e-2),
    Target("one world step, 64 x 64, 6 cells of blade", "world-step", 64, ("default",), "cpu_ms", 0.01),
    Target("linear mode, float64", "linear-mode", 64, ("explicit",), "rel_l1", 1e-13),
)  # fmt: skip


def target_of(problem: str, cells: int) -> tuple[float | None, float | None]:
    """(relative L1 error, ms) to reach there; None where nothing is asked."""
    for target in TARGETS:
        if (target.problem, target.cells, target.column) == (problem, cells, "rel_l1"):
            return target.bound, target.ms
    return None, None


def best(target: Target, rows: list[dict[str, Any]]) -> dict[str, Any] | None:
    """The row that comes nearest: the fastest of those that keep the bound, or else the one that misses it least.

    Of those that ran to their end: sweeps that were cut off prove nothing.
    """

    def misses(row: dict[str, Any]) -> float:
        return target.bound - row[target.column] if target.least else abs(row[target.column]) - target.bound

    found = [
        row
        for row in rows
        if (row["problem"], row["cells"]) == (target.problem, target.cells)
        and row["method"] in target.methods
        and row["cap"] is None
        and target.setting in ("", row["setting"])
        and row[target.column] is not None
    ]
    return min(found, key=lambda row: (max(misses(row), 0.0), row["cpu_ms"] or 0.0), default=None)


def is_met(target: Target, row: dict[str, Any]) -> bool:
    """Whether a row keeps the target's bounds, that of the time too."""
    value = row[target.column]
    kept = value >= target.bound if target.least else abs(value) <= target.bound
    return kept and (target.ms is None or row["cpu_ms"] <= target.ms)
