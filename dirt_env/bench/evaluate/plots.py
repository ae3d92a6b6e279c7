"""Pictures of an evaluation: the share in the goal over time, and performance profiles. Needs matplotlib."""

from collections.abc import Mapping
from importlib.util import find_spec
from io import BytesIO
from math import ceil
from pathlib import Path
from typing import Any

from dirt_env.render.atomic import write_atomically

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")  # Okabe and Ito 2008
ACROSS = 3


def can_plot() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def write_plots(evaluation: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write share.png and profile.png; returns their paths."""
    return [
        _save(_shares(evaluation), folder / "share.png"),
        _save(_profiles(evaluation), folder / "profile.png"),
    ]


def _shares(evaluation: Mapping[str, Any]) -> Any:
    """One panel for each task, one line with its band for each policy."""
    tasks, names = evaluation["tasks"], [policy["name"] for policy in evaluation["policies"]]
    across = min(ACROSS, len(tasks))
    figure, panels = _figure(ceil(len(tasks) / across), across)
    for panel, task in zip(panels, tasks, strict=False):
        for curve in evaluation["curves"]:
            if (curve["job"], curve["level"]) == (task["job"], task["level"]):
                color = COLORS[names.index(curve["policy"]) % len(COLORS)]
                panel.plot(curve["time_s"], curve["iqm"], color=color, label=curve["policy"])
                panel.fill_between(curve["time_s"], curve["low"], curve["high"], color=color, alpha=0.2, linewidth=0)
        panel.set(title=task["job"] if task["level"] is None else f"{task['job']}, level {task['level']}")
        panel.set(xlabel="time [s]", ylabel="share in goal", ylim=(0, 1))
    panels[0].legend(frameon=False)
    for panel in panels[len(tasks) :]:
        panel.remove()
    return figure


def _profiles(evaluation: Mapping[str, Any]) -> Any:
    figure, [panel] = _figure(1, 1)
    scores = evaluation["profiles"]["score"]
    for index, curve in enumerate(evaluation["profiles"]["policies"]):
        color = COLORS[index % len(COLORS)]
        panel.plot(scores, curve["share"], color=color, label=curve["policy"])
        panel.fill_between(scores, curve["low"], curve["high"], color=color, alpha=0.2, linewidth=0)
    panel.set(xlabel="score s (0 idle, 1 ideal machine)", ylabel="share of episodes with a score above s", ylim=(0, 1))
    panel.legend(frameon=False)
    return figure


def _figure(rows: int, columns: int) -> tuple[Any, list[Any]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.6 * columns, 3.4 * rows), layout="constrained")
    panels = list(figure.subplots(rows, columns, squeeze=False).flat)
    for panel in panels:
        panel.spines[["top", "right"]].set_visible(False)
        panel.grid(alpha=0.25)
    return figure, panels


def _save(figure: Any, path: Path) -> Path:
    picture = BytesIO()
    figure.savefig(picture, format="png", dpi=110)
    write_atomically(path, picture.getvalue())
    return path
