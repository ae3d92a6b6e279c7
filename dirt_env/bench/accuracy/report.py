"""The report in words: the table on the terminal, the tables of docs/accuracy.md."""

from collections.abc import Mapping, Sequence
from typing import Any

from dirt_env.bench.accuracy.catalogue import PROBLEMS
from dirt_env.bench.accuracy.methods import METHODS
from dirt_env.bench.accuracy.plan import BASE_CELLS, BASE_TOLERANCE, COLLAPSE
from dirt_env.bench.accuracy.plots import sweep_of
from dirt_env.bench.accuracy.studies import STUDIES
from dirt_env.bench.accuracy.targets import TARGETS, best, is_met
from dirt_env.bench.document import aligned, markdown
from dirt_env.bench.document import renewed as document_renewed

GOOD = 0.01  # relative L1 error at which the default's time is compared
NEAR = 1.05  # a rule's time counts where its error is within this of its smallest
Row = Mapping[str, Any]


def terminal(rows: Sequence[Row]) -> str:
    """All rows, a table for each problem, and the comparison of the collapse."""
    parts = []
    for name, title, truth in [
        *((problem.name, problem.title, problem.truth) for problem in PROBLEMS.values()),
        *((study.name, study.title, study.truth) for study in STUDIES.values()),
    ]:
        found = [row for row in rows if row["problem"] == name]
        if found:
            parts.append(f"{name}: {title} ({truth})\n{aligned(_cells(found))}")
    if comparison := collapse(rows):
        parts.append(f"Column collapse, {BASE_CELLS} x {BASE_CELLS}: time to the smallest error\n{aligned(comparison)}")
    return "\n\n".join(parts)


def _cells(rows: Sequence[Row]) -> list[list[str]]:
    columns = (
        ("method", "method", str), ("cells", "cells", str), ("tolerance", "tolerance", "{:g}".format),
        ("cap", "cap", str), ("precision", "type", str), ("setting", "setting", str), ("cpu_ms", "ms", "{:.4g}".format),
        ("rel_l1", "rel. L1", "{:.3g}".format), ("linf", "Linf/H", "{:.3g}".format),
        ("roundness", "round", "{:.4f}".format), ("slope", "slope/k", "{:.3f}".format),
        ("volume_error", "volume", "{:.1e}".format), ("floor", "floor", "{:.3g}".format),
        ("value", "value", "{:.4g}".format), ("unit", "unit", str), ("target_rel_l1", "target", "{:g}".format),
        ("target_ms", "target ms", "{:g}".format),
    )  # fmt: skip
    shown = [column for column in columns if any(row[column[0]] not in (None, "") for row in rows)]
    body = [["-" if row[name] in (None, "") else form(row[name]) for name, _, form in shown] for row in rows]
    return [[title for _, title, _ in shown], *body]


def collapse(rows: Sequence[Row]) -> list[list[str]]:
    """How long each method takes to its smallest error on the 64 x 64 column collapse, and the default to 1 %."""
    found = [row for row in rows if (row["problem"], row["cells"]) == (COLLAPSE, BASE_CELLS)]
    good = [row for row in found if row["method"] == "default" and row["rel_l1"] <= GOOD]
    if not good:
        return []
    reference = min(good, key=lambda row: row["cpu_ms"])
    lines = [["method", "relative L1 error", "time, ms", "times the default's"]]
    for name, method in METHODS.items():
        own = [row for row in found if row["method"] == name]
        if not own:
            continue
        least = min(row["rel_l1"] for row in own)
        row = min((row for row in own if row["rel_l1"] <= NEAR * least), key=lambda row: row["cpu_ms"])
        if name == "default":
            row = reference
        ratio = row["cpu_ms"] / reference["cpu_ms"]
        lines.append([method.title, _percent(row["rel_l1"]), f"{row['cpu_ms']:.3g}", f"{ratio:.3g}"])
    return lines


def targets(rows: Sequence[Row]) -> list[list[str]]:
    """Measured / target for every target that has a row."""
    lines = [["target", "method", "measured / target", "time / target, ms", ""]]
    for target in TARGETS:
        row = best(target, list(rows))
        if row is None:
            lines.append([target.title, "-", "not measured", "-", ""])
            continue
        if target.column == "cpu_ms":
            figure, time = "-", f"{row['cpu_ms']:.3g} / {target.bound:g}"
        else:
            form = _percent if target.column == "rel_l1" and target.bound > 1e-6 else "{:.4g}".format
            figure = f"{form(row[target.column])} / {form(target.bound)}"
            time = "-" if target.ms is None else f"{row['cpu_ms']:.3g} / {target.ms:g}"
        lines.append([target.title, _how(row), figure, time, "met" if is_met(target, row) else "**missed**"])
    return lines


def _how(row: Row) -> str:
    """A row's method and where its settings depart from the base."""
    parts = [row["method"]]
    if row["tolerance"] not in (None, BASE_TOLERANCE):
        parts.append(f"tolerance {row['tolerance']:g}")
    if row["cap"] is not None:
        parts.append(f"cap {row['cap']}")
    if row["precision"] == "f8":
        parts.append("float64")
    return ", ".join(parts)


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def problems(rows: Sequence[Row]) -> list[list[str]]:
    """Error and time of all methods at the base: 64 x 64, 1e-3 of repose, float32."""
    base = [row for row in rows if row["problem"] in PROBLEMS and _at_base(row)]
    names = [name for name in METHODS if any(row["method"] == name for row in base)]
    lines = [["problem", "floor", *(METHODS[name].title for name in names)]]
    for problem in PROBLEMS.values():
        own = {row["method"]: row for row in base if row["problem"] == problem.name}
        if own:
            floor = next(iter(own.values()))["floor"]
            cells = [
                f"{_percent(own[name]['rel_l1'])}, {own[name]['cpu_ms']:.3g} ms" if name in own else "-"
                for name in names
            ]
            lines.append([problem.title, "-" if floor is None else _percent(floor), *cells])
    return lines


def _at_base(row: Row) -> bool:
    return row in sweep_of([row], "cells") and row["cells"] == BASE_CELLS and row["cap"] is None


def sweeps(rows: Sequence[Row], column: str, title: str) -> list[list[str]]:
    """The default on the column collapse with one setting swept."""
    own = [row for row in rows if (row["problem"], row["method"]) == (COLLAPSE, "default")]
    lines = [[title, "relative L1 error", "largest slope / k", "roundness", "time, ms"]]
    for row in sweep_of(own, column):
        figures = [_percent(row["rel_l1"]), f"{row['slope']:.4f}", f"{row['roundness']:.4f}", f"{row['cpu_ms']:.3g}"]
        lines.append([f"{row[column]:g}", *figures])
    return lines


def study(rows: Sequence[Row], name: str) -> list[list[str]]:
    """A study's rows."""
    own = [row for row in rows if row["problem"] == name]
    lines = [["method", "setting", STUDIES[name].unit or "value", "departs by"]]
    for row in own:
        spread = "" if row["spread"] is None else f" ± {row['spread']:.2g}"
        value = "not finite" if row["value"] is None else f"{row['value']:.3g}{spread}"
        lines.append([row["method"], row["setting"], value, "-" if row["rel_l1"] is None else _percent(row["rel_l1"])])
    return lines


def blocks(report: Mapping[str, Any]) -> dict[str, str]:
    """What stands between the marks of docs/accuracy.md, by the mark's name."""
    rows = report["rows"]
    versions = ", ".join(f"{name} {version}" for name, version in report["versions"].items())
    return {
        "made-with": f"Commit {report['commit']}; {report['machine']}; {versions}.",
        "targets": markdown(targets(rows)),
        "collapse": markdown(collapse(rows) or [["not measured"]]),
        "problems": markdown(problems(rows)),
        "cells": markdown(sweeps(rows, "cells", "cells along the side")),
        "tolerances": markdown(sweeps(rows, "tolerance", "tolerance, share of repose")),
        **{name: markdown(study(rows, name)) for name in STUDIES},
    }


def renewed(document: str, report: Mapping[str, Any]) -> str:
    """The text of docs/accuracy.md with its blocks made anew; raises ValueError for a mark without a block."""
    return document_renewed(document, "accuracy", blocks(report))
