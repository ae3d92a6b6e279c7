"""How reports are written: JSON with a row a line, tables for a terminal and for Markdown, documents renewed."""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dirt_env.render.atomic import write_atomically
from dirt_env.terminal import end, say, writable


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
    head, *body = [[cell.replace("|", "\\|") for cell in line] for line in lines]
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *body])


def renewed(document: str, name: str, blocks: Mapping[str, str]) -> str:
    """The document with each block `<!-- name:BLOCK -->` ... `<!-- /name -->` made anew.

    Raises ValueError for a mark that has no end, or that there is no block for, and where there is no mark at all.
    """
    begin, end = f"<!-- {name}:", f"<!-- /{name} -->"
    first, *parts = document.split(begin)
    if not parts:
        raise ValueError(f"the document has no place for what is new; needed: {begin}{next(iter(blocks))} -->{end}")
    result = [first]
    for part in parts:
        mark, _, rest = part.partition(" -->")
        _, found, after = rest.partition(end)
        if mark not in blocks or not found:
            raise ValueError(
                f"mark {name}:{mark} has no end or no block; allowed: {', '.join(blocks)}, each with {end}"
            )
        result.append(f"{begin}{mark} -->\n{blocks[mark]}\n{end}{after}")
    return "".join(result)


def report(
    name: str,
    about: str | None,
    measure: Callable[[], dict[str, Any]],
    draw: Callable[[dict[str, Any], Path], None],
    table: Callable[[dict[str, Any]], str],
) -> int:
    """The command `python -m dirt_env.bench.NAME --out DIR`: writes NAME.json and NAME.png, prints the table."""
    parser = argparse.ArgumentParser(f"python -m dirt_env.bench.{name}", description=about)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for what is written")
    folder = parser.parse_args().out

    def write() -> int:
        out = writable(folder)
        results = measure()
        write_atomically(out / f"{name}.json", (json.dumps(results, indent=1) + "\n").encode())
        draw(results, out / f"{name}.png")
        say(table(results))
        return 0

    return end(name, write)
