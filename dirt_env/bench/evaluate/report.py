"""An evaluation as text: a table of the tasks, a line for each policy over all of them, and the pairs."""

from collections.abc import Mapping, Sequence
from typing import Any

COLUMNS = (  # metric, title, form, whether the interval is shown
    ("score", "score", "{:.3f}", True),
    ("share_end", "in goal", "{:.1%}", True),
    ("share_area", "area", "{:.3f}", False),
    ("time_to_90_s", "90% s", "{:.0f}", False),
    ("m3_per_h", "m3/h", "{:.0f}", False),
    ("volume_distance_m4_per_min", "m3 m/min", "{:.1f}", False),
    ("spilled_m3", "spill m3", "{:.2f}", False),
    ("energy_kj_per_m3", "kJ/m3", "{:.0f}", False),
    ("distance_m", "way m", "{:.0f}", False),
    ("grade_error_m", "grade m", "{:.3f}", False),
)


def table(evaluation: Mapping[str, Any]) -> str:
    """The text: interquartile means over the layouts, [95 % intervals], and how many episodes were done."""
    head = ["job", "level", "policy", "n", "done"]
    for _, title, _, with_interval in COLUMNS:
        head += [title, "95 %"] if with_interval else [title]
    rows = [head]
    rows += [_row(found["job"], found["level"], found) for found in evaluation["results"]]
    if len(evaluation["tasks"]) > 1:
        rows += [_row("all", None, found) for found in evaluation["overall"]]
    lines = _aligned(rows)
    for pair in evaluation["pairs"]:
        probability = "{value:.2f} [{low:.2f}, {high:.2f}]".format(**pair["probability"])
        lines.append(f"{pair['first']} scores higher than {pair['second']} on the same layout: {probability}")
    return "\n".join(lines)


def _row(job: str, level: int | None, found: Mapping[str, Any]) -> list[str]:
    metrics = found["metrics"]
    count = metrics["success"]["n"]
    done = round(count * metrics["success"]["mean"])
    cells = [job, "-" if level is None else str(level), found["policy"], str(count), str(done)]
    for name, _, form, with_interval in COLUMNS:
        figure = metrics[name]
        known = figure["iqm"] is not None
        cells.append(form.format(figure["iqm"]) if known else "-")
        if with_interval:
            cells.append(f"[{form.format(figure['low'])}, {form.format(figure['high'])}]" if known else "")
    return cells


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines with columns as wide as their longest cell: names to the left, figures to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) if i in (0, 2) else cell.rjust(width) for i, (cell, width) in enumerate(cells))
        for cells in (zip(row, widths, strict=True) for row in rows)
    ]
