"""`dirt-push evaluate`: policies compared on held-out layouts."""

import argparse
import sys
from pathlib import Path
from typing import Any

from dirt_env.terminal import BAD_INPUT, INTERRUPTED, say, whole, writable


def add_evaluate(commands: Any) -> None:
    """Add the command."""
    evaluate = commands.add_parser("evaluate", help="compare policies on held-out layouts; figures with intervals")
    evaluate.add_argument(
        "--policies",
        default="adaptive_push,idle",
        metavar="A,B,...",
        help="names that `dirt-push policies` lists, NAME@FILE.toml with numbers of your own, .npz files of training, "
        "or module:Class (default: adaptive_push,idle)",
    )
    evaluate.add_argument(
        "--suite", default="quick", metavar="NAME|FILE", help="name of a shipped suite (docs/evaluation.md), or TOML"
    )
    evaluate.add_argument("--layouts", type=whole(1), default=10, metavar="N", help="of each job (default: 10)")
    evaluate.add_argument("--split", default="evaluation", help="evaluation (default), or selection, training")
    evaluate.add_argument("--steps", type=whole(1), metavar="N", help="most control steps (default: the jobs' times)")
    evaluate.add_argument("--workers", type=whole(1), default=1, metavar="W", help="processes (default: 1)")
    evaluate.add_argument("--ray", metavar="ADDRESS", help='play on a Ray cluster: its address, "auto" or "local"')
    evaluate.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the results (default: runs/evaluate-SUITE)"
    )
    evaluate.add_argument("--fresh", action="store_true", help="forget the episodes that the folder holds")
    evaluate.add_argument("--renew-docs", type=Path, metavar="DIR", help="renew the suite's tables in DIR/jobs.md")
    evaluate.set_defaults(command=_evaluate)


def _evaluate(options: argparse.Namespace) -> int:
    from dirt_env.bench.evaluate.document import check_document, renew_document
    from dirt_env.bench.evaluate.evaluation import Evaluation, player
    from dirt_env.bench.evaluate.journal import Journal
    from dirt_env.bench.evaluate.report import table
    from dirt_env.bench.evaluate.suite import load_suite

    suite, docs = load_suite(options.suite, options.steps), options.renew_docs
    if docs is not None:
        if options.steps is not None or options.split != "evaluation":
            raise ValueError("--renew-docs is given; allowed: without --steps, on the split evaluation")
        check_document(docs, suite.name)
    names = [name.strip() for name in options.policies.split(",") if name.strip()]
    evaluation = Evaluation(names, suite, options.layouts, options.split)
    play = player(options.workers, options.ray)
    out = writable(options.out or Path("runs") / f"evaluate-{suite.name}")
    with Journal(out, evaluation.settings(), options.fresh) as journal:
        if status := play_rest("dirt-push", evaluation, journal, play):
            return status
        result, written = evaluation.write(journal)
    if docs is not None:
        written.append(renew_document(docs, suite, result))
    say(table(result), "wrote " + ", ".join(str(path) for path in written))
    return 0


def play_rest(command: str, evaluation: Any, journal: Any, play: Any) -> int:
    """Play what is left of an `Evaluation`; returns 0, or an exit status after a line on stderr that says why."""
    from dirt_env.bench.evaluate.evaluation import FAILURES

    failed = None
    try:
        evaluation.play(journal, play)
    except FAILURES as failure:
        failed = failure
    left, count = len(evaluation.left(journal)), len(evaluation.trials)
    if not left:
        return 0
    kept = f"{count - left} of {count} episodes are kept in {journal.folder}; the same command goes on from there"
    sys.stderr.write(f"{command}: error: {failed}; {kept}\n" if failed else f"{command}: interrupted: {kept}\n")
    return BAD_INPUT if failed else INTERRUPTED
