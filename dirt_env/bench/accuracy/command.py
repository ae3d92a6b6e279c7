"""`dirt-push accuracy`: measures row by row, keeps each, and writes the report."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dirt_env.bench.accuracy.ledger import Ledger, stamp
from dirt_env.bench.accuracy.measure import measure
from dirt_env.bench.accuracy.plan import Item, plan
from dirt_env.bench.accuracy.plots import need_matplotlib, write_plots
from dirt_env.bench.accuracy.report import renewed, terminal
from dirt_env.bench.document import as_json
from dirt_env.progress import Progress
from dirt_env.render.atomic import write_atomically

DOCUMENT, FIGURES = Path("accuracy.md"), Path("figures") / "accuracy"


class Accuracy:
    """The rows of one set, in the folder `out`, which is there."""

    def __init__(
        self, out: Path, quick: bool = False, problems: Sequence[str] = (), methods: Sequence[str] = ()
    ) -> None:
        """Plan them and open what was kept; raises ValueError or ImportError with a sentence that helps."""
        self.items = plan(quick, problems, methods)
        need_matplotlib()
        self._out, self._stamp = out, stamp()
        self._ledger = Ledger(out, self._stamp)
        self.aside = self._ledger.aside

    def left(self) -> list[Item]:
        """What has not been measured yet."""
        return [item for item in self.items if item not in self._ledger.rows]

    def measure(self) -> bool:
        """Measure what is left; False if Ctrl-C ended it."""
        progress = Progress(len(self.items))
        try:
            for item in self.left():
                progress.show(len(self.items) - len(self.left()), f"{item.problem}, {item.method}, {item.cells} cells")
                self._ledger.add(item, measure(item))
        except KeyboardInterrupt:
            return False
        finally:
            progress.clear()
        return True

    def report(self) -> dict[str, Any]:
        """What accuracy.json holds."""
        rows = [self._ledger.rows[item] for item in self.items]
        return {**{name: self._stamp[name] for name in ("commit", "machine", "versions")}, "rows": rows}

    def write(self) -> list[Path]:
        """Write accuracy.json and the plots."""
        report = self.report()
        path = self._out / "accuracy.json"
        write_atomically(path, as_json(report).encode())
        return [path, *write_plots(report["rows"], self._out)]

    def table(self) -> str:
        """All rows, for a terminal."""
        return terminal(self.report()["rows"])


def renew_document(docs: Path, report: dict[str, Any]) -> list[Path]:
    """Write the tables of accuracy.md in the folder `docs` anew, its plots and figures; returns what was written."""
    document = docs / DOCUMENT
    text = renewed(document.read_text(), report)
    figures = docs / FIGURES
    write_atomically(figures / "accuracy.json", as_json(report).encode())
    plots = write_plots(report["rows"], figures)
    write_atomically(document, text.encode())
    return [document, figures / "accuracy.json", *plots]
