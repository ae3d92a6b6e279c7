"""The report in words: the tables on the terminal, the tables of docs/speed.md."""

from collections.abc import Sequence

from dirt_env.bench.document import aligned, markdown
from dirt_env.bench.document import renewed as document_renewed
from dirt_env.bench.speed.targets import Report, Row, targets

COLUMNS = (
    ("case", "case", str), ("rows", "cells", "{0}x{0}".format), ("num_envs", "worlds", str),
    ("threads", "threads", str), ("drive", "drive", str), ("yaw", "yaw", "{:g}".format),
    ("tolerance", "tolerance", "{:g}".format), ("steps_per_s", "steps/s", "{:,.0f}".format),
    ("cartpole_ratio", "x CartPole", "{:.2f}".format), ("us_per_step", "us/step", "{:.2f}".format),
    ("cpu_us_per_step", "CPU us/step", "{:.2f}".format), ("sim_s_per_cpu_s", "sim s/CPU s", "{:,.0f}".format),
    ("m3_per_cpu_s", "m3/CPU s", "{:,.0f}".format), ("sweeps_per_cell", "sweeps/cell", "{:.1f}".format),
    ("reset_us_per_world", "us/reset", "{:,.0f}".format), ("bytes_per_world", "bytes/world", "{:,}".format),
)  # fmt: skip


def terminal(report: Report) -> str:
    """All that was measured."""
    parts = [aligned(cells(report["rows"]))] if report["rows"] else []
    parts += [aligned(lines) for lines in (split(report), starts(report), memory(report)) if len(lines) > 1]
    return "\n\n".join(parts) or "nothing measured"


def cells(rows: Sequence[Row]) -> list[list[str]]:
    """The table's cells, its head first; columns that no row has are left out."""
    shown = [column for column in COLUMNS if any(column[0] in row for row in rows)]
    body = [[form(row[name]) if name in row else "-" for name, _, form in shown] for row in rows]
    return [[title for _, title, _ in shown], *body]


def split(report: Report) -> list[list[str]]:
    """Where the time of a native step goes."""
    parts = report.get("shares") or {}
    whole = parts.get("whole_step")
    named = [[name.replace("_", " "), f"{value:.2f}", f"{value / whole:.0%}"] for name, value in parts.items()]
    return [["part of a native step", "us", "share"], *named]


def starts(report: Report) -> list[list[str]]:
    """Time to the first step."""
    rows = report.get("start") or []
    return [["first step, cache", "s"], *([row["cache"], f"{row['seconds']:.1f}"] for row in rows)]


def memory(report: Report) -> list[list[str]]:
    """Memory before and after."""
    found = report.get("memory")
    if not found:
        return [["memory", "MB"]]
    moments = ("before", f"after {found['steps']:,} steps", f"after {found['resets']:,} resets more")
    keys = ("before_mb", "after_steps_mb", "after_resets_mb")
    return [["memory", "MB"], *([moment, f"{found[key]:.1f}"] for moment, key in zip(moments, keys, strict=True))]


def blocks(report: Report) -> dict[str, str]:
    """What stands between the marks of docs/speed.md, by the mark's name."""
    versions = ", ".join(f"{name} {version}" for name, version in report["versions"].items())
    pole = f"CartPole-v1: {report['cartpole_steps_per_s']:,.0f} steps/s"
    rows = [row for row in report["rows"] if row["drive"] != "full_load"]
    pushes = [row for row in report["rows"] if row["drive"] == "full_load"]
    return {
        "made-with": f"Commit {report['commit']}; {report['machine']}; {versions}. {pole}.",
        "targets": markdown(targets(report)),
        "rows": markdown(cells(rows)),
        "full-load": markdown(cells(pushes)),
        "shares": markdown(split(report)),
        "start": markdown(starts(report)),
        "memory": markdown(memory(report)),
    }


def renewed(document: str, report: Report) -> str:
    """The text of docs/speed.md with its blocks made anew; raises ValueError for a mark without a block."""
    return document_renewed(document, "speed", blocks(report))
