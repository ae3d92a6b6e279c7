"""The list of cases: what each is called, what is right, how long it may take, and the function that measures it."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

PACKAGE = "dirt_env.bench.stability"
THEMES = (
    "limit",
    "grids",
    "soils",
    "ground",
    "blade",
    "blade_places",
    "driving",
    "border",
    "cells",
    "refusals",
    "extremes",
    "long_runs",
    "naive_ways",
)
LIMIT = 300.0  # s of wall-clock time; most take well under one, but the first to need a kernel may have to compile it

CASES: dict[str, "Case"] = {}


@dataclass(frozen=True)
class Case:
    """One case. `measure()`, or `measure(count)` with `counts`, returns (what was measured, whether it is right).

    `counts` are the full and the quick number of steps; `limit` s is the wall-clock time after which it counts as hung.
    """

    name: str
    theme: str
    expected: str
    measure: Callable[..., tuple[str, bool]]
    limit: float = LIMIT
    counts: tuple[int, int] | None = None

    def run(self, quick: bool) -> tuple[str, bool]:
        """Measure it."""
        measured, ok = self.measure() if self.counts is None else self.measure(self.counts[quick])
        return measured, bool(ok)


def case(expected: str, limit: float = LIMIT, counts: tuple[int, int] | None = None) -> Callable[[Callable], Callable]:
    """Enter a function in the list, under its own name, as `@case("what is right")`."""

    def enter(function: Callable) -> Callable:
        name = function.__name__.replace("_", "-")
        if name in CASES:
            raise ValueError(f"case {name} is there twice; allowed: names that differ")
        CASES[name] = Case(name, function.__module__.rpartition(".")[2], expected, function, limit, counts)
        return function

    return enter


def all_cases() -> dict[str, Case]:
    """Every case, by name, in the order of the themes."""
    for theme in THEMES:
        import_module(f"{PACKAGE}.{theme}")
    return dict(CASES)
