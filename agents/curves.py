"""Plots of docs/results.md: the share in the goal over time, and what was learned when. Needs matplotlib."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dirt_env.bench.evaluate.aggregate import band
from dirt_env.bench.evaluate.plots import COLORS

from .contrast import Records

Log = Sequence[Mapping[str, str]]


def draw_shares(
    records: Records,
    scripted: Sequence[str],
    learned: Sequence[str],
    levels: Sequence[int],
    layouts: Sequence[int],
    path: Path,
) -> None:
    """A panel for each level: interquartile mean over layouts, a line with its band for each policy."""
    lines = [(name, name, COLORS[(0, 2, 3, 4)[index]], 1.6) for index, name in enumerate(scripted)]
    lines += [(name, "PPO, a seed each" if name == learned[0] else None, COLORS[1], 0.8) for name in learned]
    figure, panels = _figure(1, len(levels))
    for panel, level in zip(panels, levels, strict=True):
        for policy, label, color, width in lines:
            rows = [records[policy, "heap", level, layout] for layout in layouts]
            middle, low, high = band([np.array([row["curve"] for row in rows])])
            seconds = np.linspace(0.0, rows[0]["seconds"], len(middle))
            panel.plot(seconds, middle, color=color, linewidth=width, label=label)
            panel.fill_between(seconds, low, high, color=color, alpha=0.08, linewidth=0)
        panel.set(title=f"level {level}", xlabel="time [s]", ylim=(0, 1))
    panels[0].set_ylabel("share in the goal")
    panels[-1].legend(frameon=False, fontsize="small")
    _save(figure, path)


def draw_learning(logs: Mapping[str, Log], path: Path) -> None:
    """Volume-distance a minute on selection layouts against steps and against time, a line for each level and seed."""
    figure, panels = _figure(1, 2)
    for panel, axis, scale, label in (
        (panels[0], "steps", 1e6, "million steps"),
        (panels[1], "seconds", 60.0, "minutes of training, imitation included"),
    ):
        for log in logs.values():
            for index, level in enumerate(sorted({row["level"] for row in log})):
                rows = [row for row in log if row["level"] == level]
                x = [float(row[axis]) / scale for row in rows]
                y = [float(row["volume_distance_m4_per_min"]) for row in rows]
                known = f"level {level}" not in panel.get_legend_handles_labels()[1]
                panel.plot(x, y, color=COLORS[index], linewidth=0.8, label=f"level {level}" if known else None)
        panel.set(xlabel=label)
    panels[0].set_ylabel("m³ m a minute")
    panels[0].legend(frameon=False)
    _save(figure, path)


def _figure(rows: int, columns: int) -> tuple[Any, list[Any]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2 * columns, 3.4 * rows), layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False).flat)


def _save(figure: Any, path: Path) -> None:
    figure.savefig(path, dpi=110)
