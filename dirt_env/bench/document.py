"""How reports are written: JSON with a row a line, tables for a terminal and for Markdown."""

import json
from collections.abc import Mapping, Sequence
from typing import Any


def as_json(report: Mapping[str, Any]) -> str:
    """A report with `rows`, each of them on a line, so that versions of it can be compared."""
    head = {name: value for name, value in report.items() if name != "rows"}
    rows = ",\n".join(json.dumps(row) for row in report["rows"])
    return f'{json.dumps(head, indent=1)[:-2]},\n "rows": [\n{rows}\n]}}\n'


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """Lines of cells in columns as wide as their longest cell, to the right."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join("  ".join(map(str.rjust, line, widths)).rstrip() for line in lines)


def markdown(lines: Sequence[Sequence[str]]) -> str:
    """Lines of cells, the head first, as a Markdown table."""
    head, *body = lines
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *body])
