"""The comparison of docs/results.md: the shipped policies against the scripted behaviours.

`python -m dirt_env.agents.compare --out runs/compare` plays the suites `learned` and `unseen` on held-out layouts, all
policies on the same ones, and goes on where it was stopped. `--renew-docs docs` writes results.md and its plots anew.
"""

import argparse
import csv
import sys
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

from dirt_env.bench.document import markdown, renewed
from dirt_env.bench.evaluate.aggregate import Estimate
from dirt_env.bench.evaluate.evaluation import Evaluation, player
from dirt_env.bench.evaluate.journal import Journal
from dirt_env.bench.evaluate.plots import can_plot
from dirt_env.bench.evaluate.suite import load_suite
from dirt_env.bench.evaluate.summary import by_key
from dirt_env.bench.provenance import provenance
from dirt_env.cli.evaluate import play_rest
from dirt_env.policy import policy_names, trained_file
from dirt_env.render.atomic import write_atomically
from dirt_env.terminal import end, say, whole, writable

from .contrast import Records, matrix, mean, ratio
from .curves import draw_learning, draw_shares

SUITES = {"learned": ("adaptive_push", "greedy", "planner"), "unseen": ("adaptive_push", "greedy")}
METRICS = {  # name: (heading, digits, factor)
    "share_end": ("share in the goal, %", 1, 100.0),
    "success": ("done, %", 0, 100.0),
    "time_s": ("time, s", 0, 1.0),
    "volume_distance_m4_per_min": ("m3 m a minute", 1, 1.0),
    "score": ("score", 3, 1.0),
}
SEEDS, ALL = "ppo_seed", "PPO, all seeds"  # how the seeds' names begin, and what they are called together
RATIOS = {"volume_distance_m4_per_min": "m3 m a minute", "time_s": "time", "score": "score"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    options = _parser().parse_args(arguments)
    return end("compare", lambda: _compare(options))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m dirt_env.agents.compare", description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("runs") / "compare", metavar="DIR", help="folder of results")
    parser.add_argument("--layouts", type=whole(1), default=100, metavar="N", help="of each level (default: 100)")
    parser.add_argument("--workers", type=whole(1), default=1, metavar="W", help="processes (default: 1)")
    parser.add_argument("--fresh", action="store_true", help="forget the episodes that the folder holds")
    parser.add_argument("--renew-docs", type=Path, metavar="DIR", help="write results.md and its figures there anew")
    return parser


def learned() -> tuple[str, ...]:
    """Names of the shipped policies of all training seeds; ValueError where none is shipped."""
    names = tuple(name for name in policy_names() if name.startswith(SEEDS))
    if not names:
        raise ValueError("no trained policies are shipped; needed: agents/policies/ppo_seed0.npz and so on")
    return names


def others() -> tuple[str, ...]:
    """Names of the shipped policies of other settings: one run each, so that their intervals are over layouts alone."""
    return tuple(name for name in policy_names() if name.startswith("ppo_") and not name.startswith(SEEDS))


def _compare(options: argparse.Namespace) -> int:
    out, blocks = writable(options.out), {}
    if not can_plot():
        raise ImportError('the plots need matplotlib: pip install ".[bench]"')
    if options.renew_docs is not None:
        _document(options.renew_docs)
    for name, scripted in SUITES.items():
        suite = load_suite(name)
        evaluation = Evaluation([*scripted, *learned(), *others()], suite, options.layouts)
        with Journal(out / name, evaluation.settings(), options.fresh) as journal:
            if status := play_rest("compare", evaluation, journal, player(options.workers, None)):
                return status
            evaluation.write(journal)
            records = by_key(journal.records)
        chosen = [task.level for task in suite.tasks]
        blocks[name] = markdown(_rows(records, scripted, chosen, evaluation.layouts))
        blocks[f"{name}-ratios"] = markdown(_ratios(records, scripted, chosen, evaluation.layouts))
        draw_shares(records, scripted, learned(), chosen, evaluation.layouts, out / f"{name}.png")
        say(blocks[name], "", blocks[f"{name}-ratios"], "")
    draw_learning(_logs(), out / "learning.png")
    found = provenance()
    blocks["made-with"] = f"Commit {found['commit']}; {found['machine']}; layouts: {options.layouts} of each level."
    if options.renew_docs is not None:
        _renew(options.renew_docs, out, blocks)
    return 0


def _rows(records: Records, scripted: Sequence[str], levels: Sequence[int], layouts: Sequence[int]) -> list[list[str]]:
    """A row for each level and policy, and one for all training seeds together."""
    rows = [["level", "policy", *(heading for heading, _, _ in METRICS.values())]]
    groups = {name: [name] for name in scripted} | {ALL: learned()}
    groups |= {name: [name] for name in (*learned(), *others())}
    for level in levels:
        for name, members in groups.items():
            cells = []
            for metric, (_, digits, factor) in METRICS.items():
                found = mean(matrix(records, members, level, layouts, metric))
                cells.append(_cell(found, digits, factor))
            rows.append([str(level), name, *cells])
    return rows


def _ratios(
    records: Records, scripted: Sequence[str], levels: Sequence[int], layouts: Sequence[int]
) -> list[list[str]]:
    """What all training seeds reach together, and the others, over scripted behaviours on the same layouts."""
    rows = [["level", "policy", "over", *RATIOS.values()]]
    groups = {ALL: learned()} | {name: [name] for name in others()}
    for level, (group, members), name in product(levels, groups.items(), scripted):
        pairs = [
            ratio(*(matrix(records, side, level, layouts, metric) for side in (members, [name]))) for metric in RATIOS
        ]
        rows.append([str(level), group, name, *(_cell(found, 2) for found in pairs)])
    return rows


def _cell(found: Estimate | None, digits: int, factor: float = 1.0) -> str:
    if found is None:
        return "-"
    value, low, high = (f"{factor * number:.{digits}f}" for number in found)
    return f"{value} [{low}, {high}]"


def _logs() -> dict[str, list[Mapping[str, str]]]:
    """The logs of evaluations during training, by policy."""
    logs = {}
    for name in learned():
        path = trained_file(name).with_suffix(".csv")
        if path.is_file():
            logs[name] = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    return logs


def _document(docs: Path) -> Path:
    """The document in that folder; ValueError where there is none."""
    path = docs / "results.md"
    if not path.is_file():
        raise ValueError(f"--renew-docs is {docs}, which has no results.md; allowed: the folder docs of a checkout")
    return path


def _renew(docs: Path, out: Path, blocks: Mapping[str, Any]) -> None:
    """Put the tables into results.md and the plots beside it."""
    path = _document(docs)
    content = renewed(path.read_text(encoding="utf-8"), "results", blocks)
    for name in (*SUITES, "learning"):
        figures = docs / "figures" / "results"
        figures.mkdir(parents=True, exist_ok=True)
        write_atomically(figures / f"{name}.png", (out / f"{name}.png").read_bytes())
    write_atomically(path, content.encode())
    say(f"renewed {path}")


if __name__ == "__main__":
    sys.exit(main())
