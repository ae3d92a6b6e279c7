"""Which rows a report has: one setting is swept at a time, the others stay at the base."""

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

from dirt_env.bench.accuracy.case import Problem
from dirt_env.bench.accuracy.catalogue import PROBLEMS
from dirt_env.bench.accuracy.methods import METHODS, Method
from dirt_env.bench.accuracy.studies import STUDIES

BASE_CELLS, BASE_TOLERANCE = 64, 1e-3
TOLERANCES = (1e-1, 3e-2, 1e-2, 4e-3, 1e-4)  # beside the base; shares of repose
LOOSE = (1e-2, 3e-2)  # tolerances at which the collapse is run at every fine resolution too
CAPPED = ("column-collapse", "wedge", "trench-spoil")  # problems at which caps are swept
CAPS = (16, 64, 256, 1024)  # sweeps
COLLAPSE = "column-collapse"  # with all settings in the quick set too
POURED = ("pour once", "pour")
NOT_QUICK = ("projection",)  # methods that the quick set has only when they are named
STEPPED = ("sweep", "flux")  # kinds of problem that a number of sweeps belongs to
QUICK_PROBLEMS = (
    "linear-mode", "manufactured", "dump", COLLAPSE, "cone-at-a-wall", "wedge", "berm", "berm-between", "trench-narrow",
)  # fmt: skip


class Item(NamedTuple):
    """One row to be measured; `setting` is that of a study, the others then are None or those of the default."""

    problem: str
    method: str
    cells: int
    tolerance: float | None
    cap: int | None
    precision: str
    setting: str = ""


def known_methods() -> list[str]:
    """Names of all methods, those of the studies included."""
    return list(dict.fromkeys([*METHODS, *(row[0] for study in STUDIES.values() for row in study.rows)]))


def plan(quick: bool, problems: Sequence[str] = (), methods: Sequence[str] = ()) -> list[Item]:
    """The rows of the quick or the full set, of some problems and methods only if any are named.

    Raises ValueError for a name that is not known, and where nothing is left.
    """
    for what, names, known in (
        ("--problem", problems, [*PROBLEMS, *STUDIES]),
        ("--method", methods, known_methods()),
    ):
        for name in names:
            if name not in known:
                raise ValueError(f"{what} is {name!r}; allowed: {', '.join(known)}")
    items = [
        item
        for item in dict.fromkeys([*_problem_items(quick, problems), *_study_items(quick, problems)])
        if (item.method in methods if methods else not quick or item.method not in NOT_QUICK)
    ]
    if not items:
        raise ValueError(
            f"--method {', '.join(methods)} does nothing of --problem {', '.join(problems) or 'all'}"
            f"{' in the quick set' if quick else ''}; allowed: a method that fits the problem"
        )
    return items


def _problem_items(quick: bool, names: Sequence[str]) -> Iterator[Item]:
    for problem in PROBLEMS.values():
        if _left_out(problem.name, names, quick, QUICK_PROBLEMS):
            continue
        for method in METHODS.values():
            if problem.kind in method.kinds:
                yield from _quick_sweep(problem, method) if quick else _full_sweep(problem, method)


def _left_out(name: str, names: Sequence[str], quick: bool, in_quick: Collection[str]) -> bool:
    """Names that are given decide; without any, the quick set is a choice."""
    return name not in names if names else quick and name not in in_quick


def _base(problem: Problem, method: Method) -> Item:
    tolerance = BASE_TOLERANCE if "tolerance" in method.knobs and problem.kind not in STEPPED else None
    precision = "f4" if "precision" in method.knobs else "f8"
    return Item(problem.name, method.name, BASE_CELLS, tolerance, None, precision)


def _quick_sweep(problem: Problem, method: Method) -> Iterator[Item]:
    base = _base(problem, method)
    if problem.kind in STEPPED:
        if method.name == "explicit":
            yield from (base._replace(cells=cells, precision="f8") for cells in (32, BASE_CELLS))
        return
    if problem.name == COLLAPSE or method.name != "paper":
        yield from (base._replace(cells=cells) for cells in (32, BASE_CELLS))
    else:
        yield base._replace(cells=32)
    if problem.name == COLLAPSE and base.tolerance is not None:
        yield from (base._replace(tolerance=tolerance) for tolerance in (1e-1, 1e-2))


def _full_sweep(problem: Problem, method: Method) -> Iterator[Item]:
    base = _base(problem, method)
    long = method.explicit or (problem.kind in POURED and method.name != "water-filling")
    most = min(method.cells, problem.long) if long else method.cells
    yield base
    yield from (base._replace(cells=cells) for cells in problem.cells if cells <= most)
    if base.tolerance is not None:
        yield from (base._replace(tolerance=tolerance) for tolerance in TOLERANCES)
    if "cap" in method.knobs and problem.name in CAPPED:
        yield from (base._replace(cap=cap) for cap in CAPS)
    if problem.name == COLLAPSE and not method.explicit:  # fine ground is what a looser tolerance is for
        fine = [cells for cells in problem.cells if cells > BASE_CELLS]
        yield from (base._replace(cells=cells, tolerance=tolerance) for cells in fine for tolerance in LOOSE)
    if "precision" in method.knobs:
        yield base._replace(precision="f8")
    if problem.kind in STEPPED:
        yield from (base._replace(cells=cells, precision="f8") for cells in problem.cells if cells <= most)


def _study_items(quick: bool, names: Sequence[str]) -> Iterator[Item]:
    for study in STUDIES.values():
        if not _left_out(study.name, names, quick, ()):
            for method, cells, setting in study.rows:
                yield Item(study.name, method, cells, None, None, "f4", setting)
