"""The command: run the cases one after the other, print the table, write the report."""

import sys
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from dirt_env.bench.stability import report
from dirt_env.bench.stability.registry import Case, all_cases
from dirt_env.bench.stability.watchdog import Row, Watchdog
from dirt_env.progress import Progress

DOCUMENT = "stability.md"


def chosen(names: Sequence[str]) -> list[Case]:
    """The cases of those names, all if there are none; ValueError for a name that is not known."""
    cases = all_cases()
    for name in names:
        if name not in cases:
            close = get_close_matches(name, list(cases), n=1)
            hint = f" (did you mean {close[0]}?)" if close else ""
            raise ValueError(f"--case is {name!r}{hint}; allowed: {', '.join(cases)}")
    return [cases[name] for name in dict.fromkeys(names)] or list(cases.values())


def stability(names: Sequence[str], quick: bool, out: Path | None, docs: Path | None) -> bool:
    """Run the cases and report; returns whether all of them pass."""
    if docs is not None and (names or quick):
        raise ValueError("--renew-docs is given; allowed: with all cases, without --case and --quick")
    if docs is not None and not (docs / DOCUMENT).is_file():
        raise ValueError(f"--renew-docs is {docs}; allowed: a folder with {DOCUMENT}")
    cases = chosen(names)
    rows = measure(cases, quick)
    if out is not None:
        report.write_json(rows, quick, out / "stability.json")
    if docs is not None:
        report.renew(docs / DOCUMENT, rows)
    sys.stdout.write(report.summary(rows) + "\n")
    return all(row.ok for row in rows)


def measure(cases: Sequence[Case], quick: bool) -> list[Row]:
    """The rows of the cases; each is printed as soon as it is there."""
    wide = max(len(case.name) for case in cases)
    progress = Progress(len(cases))
    rows = []
    with Watchdog() as watchdog:
        for case in cases:
            progress.show(len(rows), case.name)
            rows.append(watchdog.run(case, quick))
            progress.clear()
            sys.stdout.write(report.line(rows[-1], wide) + "\n")
            sys.stdout.flush()
    return rows
