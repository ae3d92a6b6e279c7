"""What an evaluation has done so far, in a folder: its settings, and a line for every finished episode.

A line is written in one go and flushed to the disk; one that was cut off by a kill is dropped when the file is opened
again. So whatever stops an evaluation, the same command goes on where it was.
"""

import json
import os
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from dirt_env.render.atomic import write_atomically

try:
    import fcntl
except ImportError:  # no such locks on Windows
    fcntl = None

SETTINGS, EPISODES, RESULT = "settings.json", "episodes.jsonl", "evaluation.json"
OUTPUT = (RESULT, SETTINGS, EPISODES, "share.png", "profile.png")


class Journal:
    """Records of one evaluation; use it as a context, which keeps others out of the folder meanwhile."""

    def __init__(self, folder: Path, settings: dict[str, Any], fresh: bool = False) -> None:
        """Open the folder for an evaluation of these settings; `fresh` removes what another one left there.

        Raises ValueError if the folder is in use, holds an evaluation of other settings, or is damaged.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._file = open(folder / EPISODES, "a+b")  # noqa: SIM115  closed by the context
        try:
            self._lock()
            if fresh:
                self._file.truncate(0)
                for name in OUTPUT:
                    if name != EPISODES:
                        (folder / name).unlink(missing_ok=True)
            self._agree(settings)
            self.records = self._read()
        except BaseException:
            self._file.close()
            raise

    def add(self, record: dict[str, Any]) -> None:
        """Keep a record."""
        self._file.write(json.dumps(record, allow_nan=False).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self.records.append(record)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._file.close()

    def _lock(self) -> None:
        if fcntl is None:
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ValueError(f"another evaluation is at work in {self.folder}; allowed: one at a time") from None

    def _agree(self, settings: dict[str, Any]) -> None:
        """Keep the settings, or compare them with those of the evaluation that is there."""
        path, wanted = self.folder / SETTINGS, json.loads(json.dumps(settings))
        if not path.exists():
            if self._file.seek(0, os.SEEK_END):
                raise ValueError(f"{self.folder} has episodes without {SETTINGS}; allowed: --fresh, or another --out")
            write_atomically(path, (json.dumps(wanted, indent=2) + "\n").encode())
            return
        try:
            kept = json.loads(path.read_text())
        except ValueError as error:
            raise ValueError(f"{path} is damaged: {error}; allowed: --fresh, or another --out") from None
        differ = [key for key in dict.fromkeys([*wanted, *kept]) if wanted.get(key) != kept.get(key)]
        if differ:
            first = differ[0]
            was, now = map(_short, _apart(kept.get(first), wanted.get(first)))
            raise ValueError(
                f"{self.folder} holds an evaluation with other {', '.join(differ)} ({first} was {was}, is {now}); "
                "allowed: the settings it was begun with, --fresh to begin anew, or another --out"
            )

    def _read(self) -> list[dict[str, Any]]:
        """Records so far; half a line at the end is cut off."""
        self._file.seek(0)
        written = self._file.read()
        whole = written[: written.rfind(b"\n") + 1]
        if len(whole) < len(written):
            self._file.truncate(len(whole))
        records = []
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                records.append(json.loads(line))
            except ValueError as error:
                where = f"{self.folder / EPISODES}, line {number}"
                raise ValueError(f"{where} is damaged: {error}; allowed: --fresh, or another --out") from None
        return records


def _apart(one: Any, other: Any) -> tuple[Any, Any]:
    """Two values; of mappings only the entries in which they differ."""
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return one, other
    keys = [key for key in dict.fromkeys([*one, *other]) if one.get(key) != other.get(key)]
    return tuple({key: values[key] for key in keys if key in values} for values in (one, other))


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
