"""A progress bar on a terminal; nothing in a pipe."""

import sys
from typing import TextIO

WIDTH = 28


class Progress:
    """One line that says how far `total` steps of work have come."""

    def __init__(self, total: int, stream: TextIO | None = None) -> None:
        """Draw on `stream`, by default on stderr as it is now."""
        self._total = max(total, 1)
        self._stream = stream or sys.stderr
        self._shown = -1
        self._width = 0
        self.on = self._stream.isatty()

    def show(self, done: float, words: str) -> None:
        """Draw the bar at `done` steps; at most 200 times over the whole work."""
        mark = int(200 * done / self._total)
        if not self.on or mark == self._shown:
            return
        self._shown = mark
        full = min(WIDTH, int(WIDTH * done / self._total))
        line = f"[{'#' * full}{'.' * (WIDTH - full)}] {100 * done / self._total:3.0f} %  {words}"
        self._width = max(self._width, len(line))
        self._stream.write(f"\r{line:<{self._width}}")
        self._stream.flush()

    def clear(self) -> None:
        """Wipe the line."""
        if self.on and self._width:
            self._stream.write(f"\r{' ' * self._width}\r")
            self._stream.flush()
            self._width = 0
