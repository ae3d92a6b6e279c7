"""The cases' rows as a table for people, as JSON, and as the table in docs/stability.md."""

import json
from collections.abc import Sequence
from pathlib import Path

from dirt_env.bench.document import markdown, renewed
from dirt_env.bench.provenance import provenance
from dirt_env.bench.stability.watchdog import Row
from dirt_env.render.atomic import write_atomically


def line(row: Row, wide: int) -> str:
    """One row of the table on the screen."""
    return f"{'pass' if row.ok else 'FAIL'}  {row.case:<{wide}}  {row.cpu_s:7.2f} s  {row.measured}"


def summary(rows: Sequence[Row]) -> str:
    """How many passed, how long it took, which is slowest."""
    failed = [row for row in rows if not row.ok]
    slowest = max(rows, key=lambda row: row.cpu_s)
    return (
        f"{len(rows) - len(failed)} of {len(rows)} cases pass; {sum(row.cpu_s for row in rows):.1f} s of processor "
        f"time, at most {slowest.cpu_s:.1f} s in one ({slowest.case})"
    )


def write_json(rows: Sequence[Row], quick: bool, path: Path) -> None:
    """Write `stability.json`; every row has the wall-clock limit it was under."""
    report = {**provenance(), "quick": quick, "limit_s": max(row.limit_s for row in rows)}
    report["rows"] = [row._asdict() for row in rows]
    write_atomically(path, (json.dumps(report, indent=1) + "\n").encode())


def table(rows: Sequence[Row]) -> str:
    """The table of docs/stability.md."""
    lines = [["case", "what is right", "measured", "", "s"]]
    lines += [
        [row.case, row.expected, row.measured, "pass" if row.ok else "**fails**", f"{row.cpu_s:.1f}"] for row in rows
    ]
    made = provenance()
    note = f"{summary(rows)}. {made['machine']}; " + ", ".join(f"{k} {v}" for k, v in made["versions"].items()) + "."
    return f"{markdown(lines)}\n\n{note}"


def renew(path: Path, rows: Sequence[Row]) -> None:
    """Put the table into a document, at its mark `<!-- stability:cases -->`; ValueError for another mark."""
    text = renewed(path.read_text(encoding="utf-8"), "stability", {"cases": table(rows)})
    write_atomically(path, text.encode())
