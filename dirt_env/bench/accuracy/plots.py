"""Work-precision plots: relative L1 error against processor time, both logarithmic. Needs matplotlib."""

from collections.abc import Mapping
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

from dirt_env.bench.accuracy.catalogue import PROBLEMS
from dirt_env.bench.accuracy.methods import METHODS
from dirt_env.bench.accuracy.plan import BASE_CELLS, BASE_TOLERANCE
from dirt_env.render.atomic import write_atomically

COLORS = ("#000000", "#d55e00", "#e69f00", "#56b4e9", "#0072b2", "#009e73", "#cc79a7", "#999999")  # Okabe and Ito 2008
LEAST = 1e-15  # errors below are drawn there
# A sweep's name, how it is drawn, and which of its columns is swept while the others stay at the base.
SWEEPS = (
    ("cells", "s-", "cells"),
    ("tolerance", "o--", "tolerance"),
    ("sweep cap", "^:", "cap"),
    ("float64", "x", None),
)


def need_matplotlib() -> None:
    """Raises ImportError that says what to install where there is no matplotlib."""
    if find_spec("matplotlib") is None:
        raise ImportError('the plots need matplotlib: pip install "dirt-push[bench]", or ".[bench]" in the checkout')


def write_plots(rows: list[Mapping[str, Any]], folder: Path) -> list[Path]:
    """One PNG for each problem that has rows with a time and an error; returns their paths."""
    written = []
    for name, problem in PROBLEMS.items():
        found = [row for row in rows if row["problem"] == name and row["cpu_ms"] and row["rel_l1"] is not None]
        if found:
            path = folder / f"{name}.png"
            write_atomically(path, _png(_plot(problem.title, found)))
            written.append(path)
    return written


def sweep_of(rows: list[Mapping[str, Any]], column: str | None) -> list[Mapping[str, Any]]:
    """Rows in which only `column` departs from the base, in its order; for None those in float64 at the base."""
    usual = {"cells": BASE_CELLS, "tolerance": BASE_TOLERANCE, "cap": None, "precision": "f4"}
    kept = [
        row
        for row in rows
        if all(
            row[name] == value or (name in ("tolerance", "precision") and not _listens(row, name))
            for name, value in usual.items()
            if name not in (column, "precision" if column is None else None)
        )
        and (column is not None or (row["precision"] == "f8" and _listens(row, "precision")))
        and (column != "cap" or row["cap"] is not None)
    ]
    return sorted(kept, key=lambda row: row[column] or 0.0) if column else kept


def _listens(row: Mapping[str, Any], knob: str) -> bool:
    return knob in METHODS[row["method"]].knobs and row[knob] is not None


def _plot(title: str, rows: list[Mapping[str, Any]]) -> Any:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    panel = figure.subplots()
    names = [name for name in METHODS if any(row["method"] == name for row in rows)]
    drawn = set()
    for name in names:
        color = COLORS[list(METHODS).index(name) % len(COLORS)]
        for label, style, column in SWEEPS:
            points = sweep_of([row for row in rows if row["method"] == name], column)
            if len(points) > (column is not None):
                times, found = [row["cpu_ms"] for row in points], [max(row["rel_l1"], LEAST) for row in points]
                panel.loglog(times, found, style, color=color, markersize=4, linewidth=1, mfc="none")
                drawn.add((label, style))
        panel.plot([], [], "-", color=color, label=METHODS[name].title)
    _mark_target(panel, rows)
    panel.set(xlabel="processor time [ms]", ylabel="relative L1 error", title=title)
    panel.spines[["top", "right"]].set_visible(False)
    panel.grid(alpha=0.25)
    panel.add_artist(panel.legend(frameon=False, fontsize=7, loc="upper right"))
    marks = [
        Line2D([], [], color="gray", linestyle=style[1:] or "", marker=style[0], mfc="none", markersize=4, label=label)
        for label, style, _ in SWEEPS
        if (label, style) in drawn
    ]
    panel.legend(handles=marks, frameon=False, fontsize=7, loc="lower left")
    return figure


def _mark_target(panel: Any, rows: list[Mapping[str, Any]]) -> None:
    """A star where the target of the base resolution lies."""
    for row in rows:
        if row["cells"] == BASE_CELLS and row["target_rel_l1"] and row["target_ms"]:
            panel.plot(row["target_ms"], row["target_rel_l1"], "*", color="gold", mec="black", ms=10, label="target")
            return


def _png(figure: Any) -> bytes:
    picture = BytesIO()
    figure.savefig(picture, format="png", dpi=80)
    return picture.getvalue()
