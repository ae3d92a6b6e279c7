"""`dirt-push accuracy`, `speed` and `stability`: what the simulator is worth, measured here."""

import argparse
import sys
from pathlib import Path
from typing import Any

from dirt_env.terminal import FAILED, INTERRUPTED, say, writable


def add_reports(commands: Any) -> None:
    """Add the three commands."""
    _add_accuracy(commands)
    _add_speed(commands)
    _add_stability(commands)


def _add_accuracy(commands: Any) -> None:
    accuracy = commands.add_parser("accuracy", help="error against run time, at problems with known answers")
    accuracy.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the rows and the report")
    accuracy.add_argument("--quick", action="store_true", help="a few problems and settings, in under a minute")
    accuracy.add_argument("--problem", action="append", default=[], metavar="NAME", help="this only (may be repeated)")
    accuracy.add_argument("--method", action="append", default=[], metavar="NAME", help="this only (may be repeated)")
    accuracy.add_argument(
        "--renew-docs", type=Path, metavar="DIR", help="write the tables and plots of accuracy.md in DIR anew"
    )
    accuracy.set_defaults(command=_accuracy)


def _accuracy(options: argparse.Namespace) -> int:
    from dirt_env.bench.accuracy.command import Accuracy, renew_document

    if options.renew_docs is not None and (options.quick or options.problem or options.method):
        raise ValueError("--renew-docs is given; allowed: with the full set, without --quick, --problem and --method")
    if options.renew_docs is not None and not (options.renew_docs / "accuracy.md").is_file():
        raise ValueError(f"--renew-docs is {options.renew_docs}; allowed: a folder with accuracy.md")
    run = Accuracy(writable(options.out), options.quick, options.problem, options.method)
    if run.aside is not None:
        sys.stderr.write(f"dirt-push: rows of another version or machine are now in {run.aside}; beginning anew\n")
    if not run.measure():
        done = f"after {len(run.items) - len(run.left())} of {len(run.items)} rows, all kept in {options.out}"
        sys.stderr.write(f"dirt-push: interrupted {done}; the same command goes on from there\n")
        return INTERRUPTED
    written = run.write()
    if options.renew_docs is not None:
        written += renew_document(options.renew_docs, run.report())
    say(run.table(), "wrote " + ", ".join(str(path) for path in written))
    return 0


def _add_speed(commands: Any) -> None:
    speed = commands.add_parser("speed", help="steps per second of every way to run worlds, beside CartPole")
    speed.add_argument("--out", type=Path, metavar="DIR", help="folder for speed.json")
    for option, name, words in (
        ("--case", "NAME", "single, native, sync, sb3, world"),
        ("--size", "N", "cells along the side of the site"),
        ("--num-envs", "N", "worlds; single always has one"),
        ("--threads", "N", "threads; single, sync and world always have one"),
        ("--drive", "NAME", "idle, random, adaptive_push, full_load"),
    ):
        speed.add_argument(option, nargs="+", action="extend", default=[], metavar=name, help=f"only these: {words}")
    speed.add_argument("--quick", action="store_true", help="a few rows, shorter, in under a minute")
    speed.add_argument("--memory", action="store_true", help="memory over a million steps (100,000 with --quick), too")
    speed.add_argument("--lean", action="store_true", help="instead: a step with and without what scenes leave out")
    speed.add_argument("--renew-docs", type=Path, metavar="DIR", help="write the tables of speed.md in DIR anew")
    speed.set_defaults(command=_speed)


def _speed(options: argparse.Namespace) -> int:
    names = {"cases": options.case, "sizes": options.size, "counts": options.num_envs}
    chosen = {**names, "threads": options.threads, "drives": options.drive}
    docs, selects = options.renew_docs, any(chosen.values())
    if options.lean:
        if selects or options.out or options.quick or options.memory or docs:
            raise ValueError("--lean is given; allowed: alone")
        from dirt_env.bench.lean import rows, table

        say(table(rows()))
        return 0
    if docs is not None and (options.quick or selects):
        raise ValueError("--renew-docs is given; allowed: with the full set, without --quick and without a choice")
    if docs is not None and not (docs / "speed.md").is_file():
        raise ValueError(f"--renew-docs is {docs}; allowed: a folder with speed.md")
    from dirt_env.bench.speed.cases import NO_ADAPTER, has_adapter, need_adapter
    from dirt_env.bench.speed.command import Speed, renew_document

    if docs is not None:
        need_adapter()
    elif not has_adapter() and not options.case:
        sys.stderr.write(f"dirt-push: left out: {NO_ADAPTER}\n")
    run = Speed(options.quick, options.memory, **chosen)
    out = None if options.out is None else writable(options.out)
    finished = run.measure()
    written = [] if out is None else [run.write(out)]
    if finished and docs is not None:
        written.append(renew_document(docs, run.report()))
    say(run.table(), *([f"wrote {', '.join(map(str, written))}"] if written else []))
    if not finished:
        sys.stderr.write(f"dirt-push: interrupted after {len(run.rows)} of {len(run.items)} rows\n")
    return 0 if finished else INTERRUPTED


def _add_stability(commands: Any) -> None:
    stability = commands.add_parser(
        "stability", help="stiff and extreme cases: what is right, what was measured; status 1 if one fails"
    )
    stability.add_argument(
        "--case", action="append", default=[], metavar="NAME", help="this case only (may be repeated)"
    )
    stability.add_argument("--quick", action="store_true", help="a tenth of the steps in the long ones")
    stability.add_argument("--out", type=Path, metavar="DIR", help="folder for stability.json")
    stability.add_argument("--renew-docs", type=Path, metavar="DIR", help="write the table of stability.md in DIR anew")
    stability.set_defaults(command=_stability)


def _stability(options: argparse.Namespace) -> int:
    from dirt_env.bench.stability.command import stability

    out = None if options.out is None else writable(options.out)
    return 0 if stability(options.case, options.quick, out, options.renew_docs) else FAILED
