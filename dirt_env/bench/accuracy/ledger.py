"""Rows on disk as they come: an interrupted run goes on where it was, and never with rows of another version."""

import hashlib
import json
import os
from pathlib import Path
from typing import Any

from dirt_env.bench.accuracy.plan import Item
from dirt_env.bench.provenance import provenance

PACKAGE = Path(__file__).resolve().parents[2]
MEASURED = ("sim", "bench")  # packages whose sources decide what a row says
NAME = "accuracy.rows.jsonl"


def stamp() -> dict[str, Any]:
    """What rows have to agree in to stand in one table: commit, machine, versions, and the sources as they are."""
    digest = hashlib.sha256()
    for path in sorted(path for package in MEASURED for path in (PACKAGE / package).rglob("*.py")):
        text = path.read_bytes()
        digest.update(f"{path.relative_to(PACKAGE).as_posix()} {len(text)}\n".encode() + text)
    return {**provenance(), "sources": digest.hexdigest()[:16]}


class Ledger:
    """A file of JSON lines: first the stamp, then a row a line, each written through to the disk.

    A line that is cut off is forgotten. A file with another stamp is moved aside; `aside` then says where to.
    """

    def __init__(self, folder: Path, mark: dict[str, Any]) -> None:
        """Open the ledger in `folder`, which is there, for rows with the stamp `mark`."""
        self._path = folder / NAME
        self.rows: dict[Item, dict[str, Any]] = {}
        self.aside: Path | None = None
        whole = self._read(mark)
        if whole is None:
            if self._path.exists():
                self.aside = self._free_name()
                os.replace(self._path, self.aside)
            self._append(mark)
        else:
            with open(self._path, "r+b") as file:
                file.truncate(whole)

    def add(self, item: Item, row: dict[str, Any]) -> None:
        """Keep a row."""
        self._append(row)
        self.rows[item] = row

    def _append(self, content: dict[str, Any]) -> None:
        with open(self._path, "ab") as file:
            file.write(json.dumps(content).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())

    def _read(self, mark: dict[str, Any]) -> int | None:
        """Take in the rows of a file with that stamp; returns how many bytes of it are whole lines, or None."""
        try:
            content = self._path.read_bytes()
        except FileNotFoundError:
            return None
        whole = content.rfind(b"\n") + 1
        try:
            lines = [json.loads(line) for line in content[:whole].splitlines()]
            rows = {Item(*(row[name] for name in Item._fields)): row for row in lines[1:]}
        except (ValueError, KeyError, TypeError):
            return None
        if not lines or lines[0] != mark:
            return None
        self.rows = rows
        return whole

    def _free_name(self) -> Path:
        number = 1
        while (path := self._path.with_name(f"accuracy.rows.old-{number}.jsonl")).exists():
            number += 1
        return path
