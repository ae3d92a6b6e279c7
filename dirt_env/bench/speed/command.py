"""`dirt-push speed`: measures row by row, and writes what was measured, also after Ctrl-C."""

from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

from dirt_env.bench.document import as_json
from dirt_env.bench.provenance import provenance
from dirt_env.bench.speed.full_load import Push, measure_push
from dirt_env.bench.speed.measure import QUICK, CartPole, Effort, Item, measure
from dirt_env.bench.speed.plan import plan
from dirt_env.bench.speed.process import memory, resident, start
from dirt_env.bench.speed.report import renewed, terminal
from dirt_env.bench.speed.shares import shares
from dirt_env.progress import Progress
from dirt_env.render.atomic import write_atomically

DOCUMENT = Path("speed.md")


class Speed:
    """The rows of one run; `rows` are those that were measured so far."""

    def __init__(self, quick: bool = False, with_memory: bool = False, **chosen: Any) -> None:
        """Plan them, see `plan`; raises ValueError or ImportError with a sentence that helps."""
        self.items = plan(quick, **chosen)
        self.rows: list[dict[str, Any]] = []
        self._extras: dict[str, Any] = {}
        self._effort = QUICK if quick else Effort()
        self._quick, self._all = quick, not any(chosen.values())
        self._memory = with_memory
        self._cartpole = CartPole()
        self._made_with = provenance()
        if with_memory:
            resident()

    def measure(self) -> bool:
        """Measure all; False if Ctrl-C ended it, with what was measured before kept."""
        more = self._more()
        progress = Progress(len(self.items) + len(more))
        try:
            for number, item in enumerate(self.items):
                progress.show(number, " ".join(map(str, item)))
                self.rows.append(self._row(item))
            for number, (name, extra) in enumerate(more.items(), len(self.items)):
                progress.show(number, name)
                self._extras[name] = extra(lambda share, number=number, name=name: progress.show(number + share, name))
        except KeyboardInterrupt:
            return False
        finally:
            progress.clear()
        return True

    def report(self) -> dict[str, Any]:
        """What speed.json holds."""
        poles = self._cartpole.found or [self._cartpole.chunk(self._effort.cartpole)]
        return {**self._made_with, "cartpole_steps_per_s": median(poles), **self._extras, "rows": self.rows}

    def table(self) -> str:
        """All that was measured, for a terminal."""
        return terminal(self.report())

    def write(self, out: Path) -> Path:
        """Write speed.json into the folder."""
        path = out / "speed.json"
        write_atomically(path, as_json(self.report()).encode())
        return path

    def _row(self, item: Item | Push) -> dict[str, Any]:
        work = measure_push if isinstance(item, Push) else measure
        return work(item, self._effort, self._cartpole)

    def _more(self) -> dict[str, Callable[[Callable[[float], None]], Any]]:
        """What is measured beside the rows, by its name in the report."""
        more: dict[str, Callable[[Callable[[float], None]], Any]] = {}
        if self._all:
            more["shares"] = lambda _: shares(20 if self._quick else 100)
        if self._all and not self._quick:
            more["start"] = lambda _: start()
        if self._memory:
            size = (100_000, 1_000) if self._quick else (1_000_000, 10_000)
            more["memory"] = lambda show: memory(*size, show)
        return more


def renew_document(docs: Path, report: dict[str, Any]) -> Path:
    """Write the tables of speed.md in the folder `docs` anew; returns its path."""
    document = docs / DOCUMENT
    write_atomically(document, renewed(document.read_text(encoding="utf-8"), report).encode())
    return document
