"""The command line: `dirt-push`, the same as `python -m dirt_env`."""

import argparse
import os
import re
import sys
import tomllib
import warnings
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from dirt_env import __version__

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
NO_KEYS = ("self", "scene", "render_mode")  # arguments of the environment that are no keys of a scene


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status. Bad input is one line on stderr and status 2."""
    _forgive(sys.stdout)
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, *_: sys.stderr.write(f"dirt-push: warning: {message}\n")
            return options.command(options)
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, OSError, ImportError) as error:
        sys.stderr.write(f"dirt-push: error: {error}\n")
        return BAD_INPUT
    except KeyboardInterrupt:
        sys.stderr.write("dirt-push: interrupted\n")
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("dirt-push", description="Machines that push soil, in a simulator.")
    parser.add_argument("--version", action="version", version=f"dirt-push {__version__}")
    commands = parser.add_subparsers(required=True, metavar="command")
    run = commands.add_parser("run", help="let a policy do a job; write figures, a replay and an animated picture")
    run.add_argument("--scene", default="heap", metavar="NAME|FILE", help="shipped scene or TOML file (default: heap)")
    run.add_argument(
        "--policy",
        default="adaptive_push",
        metavar="NAME",
        help="what drives (default: adaptive_push), a policy.npz of training, or module:Class; two with a comma are "
        "played side by side",
    )
    run.add_argument("--episodes", type=_whole(1), default=1, metavar="N", help="how many (default: 1)")
    run.add_argument("--seed", type=_whole(0), default=0, metavar="S", help="of the first layout (default: 0)")
    run.add_argument("--out", type=Path, metavar="DIR", help="folder for what is written (default: runs/SCENE-POLICY)")
    run.add_argument("--level", type=_whole(0), metavar="L", help="difficulty, in scenes that have levels")
    run.add_argument("--steps", type=_whole(1), metavar="N", help="most control steps (default: the job's time)")
    run.add_argument("--no-replay", action="store_true", help="write summary.json only (an old replay goes)")
    run.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change the scene, as in --set soil.repose=30"
    )
    run.set_defaults(command=_run)
    _add_accuracy(commands)
    _add_evaluate(commands)
    _add_speed(commands)
    _add_stability(commands)
    commands.add_parser("scenes", help="list the shipped scenes").set_defaults(command=_scenes)
    commands.add_parser("soils", help="list the soils for soil.preset").set_defaults(command=_soils)
    commands.add_parser("policies", help="list the policies").set_defaults(command=_policies)
    return parser


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
    run = Accuracy(_writable(options.out), options.quick, options.problem, options.method)
    if run.aside is not None:
        sys.stderr.write(f"dirt-push: rows of another version or machine are now in {run.aside}; beginning anew\n")
    if not run.measure():
        done = f"after {len(run.items) - len(run.left())} of {len(run.items)} rows, all kept in {options.out}"
        sys.stderr.write(f"dirt-push: interrupted {done}; the same command goes on from there\n")
        return INTERRUPTED
    written = run.write()
    if options.renew_docs is not None:
        written += renew_document(options.renew_docs, run.report())
    _say(run.table(), "wrote " + ", ".join(str(path) for path in written))
    return 0


def _add_evaluate(commands: Any) -> None:
    evaluate = commands.add_parser("evaluate", help="compare policies on held-out layouts; figures with intervals")
    evaluate.add_argument(
        "--policies", default="adaptive_push,idle", metavar="A,B,...", help="names, .npz files, or module:Class"
    )
    evaluate.add_argument(
        "--suite", default="quick", metavar="NAME|FILE", help="jobs: quick, heap, paper, hauls, surfaces, all, or TOML"
    )
    evaluate.add_argument("--layouts", type=_whole(1), default=10, metavar="N", help="of each job (default: 10)")
    evaluate.add_argument("--split", default="evaluation", help="evaluation (default), or selection, training")
    evaluate.add_argument("--steps", type=_whole(1), metavar="N", help="most control steps (default: the jobs' times)")
    evaluate.add_argument("--workers", type=_whole(1), default=1, metavar="W", help="processes (default: 1)")
    evaluate.add_argument("--ray", metavar="ADDRESS", help='play on a Ray cluster: its address, "auto" or "local"')
    evaluate.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the results (default: runs/evaluate-SUITE)"
    )
    evaluate.add_argument("--fresh", action="store_true", help="forget the episodes that the folder holds")
    evaluate.set_defaults(command=_evaluate)


def _evaluate(options: argparse.Namespace) -> int:
    from dirt_env.bench.evaluate.evaluation import FAILURES, Evaluation, player
    from dirt_env.bench.evaluate.journal import Journal
    from dirt_env.bench.evaluate.report import table
    from dirt_env.bench.evaluate.suite import load_suite

    suite = load_suite(options.suite, options.steps)
    names = [name.strip() for name in options.policies.split(",") if name.strip()]
    evaluation = Evaluation(names, suite, options.layouts, options.split)
    play = player(options.workers, options.ray)
    out = _writable(options.out or Path("runs") / f"evaluate-{suite.name}")
    with Journal(out, evaluation.settings(), options.fresh) as journal:
        failed = None
        try:
            evaluation.play(journal, play)
        except FAILURES as failure:
            failed = failure
        left = len(evaluation.left(journal))
        if left:
            done = f"{len(evaluation.trials) - left} of {len(evaluation.trials)} episodes are kept in {out}"
            again = f"{done}; the same command goes on from there"
            sys.stderr.write(
                f"dirt-push: error: {failed}; {again}\n" if failed else f"dirt-push: interrupted: {again}\n"
            )
            return BAD_INPUT if failed else INTERRUPTED
        result, written = evaluation.write(journal)
    _say(table(result), "wrote " + ", ".join(str(path) for path in written))
    return 0


def _run(options: argparse.Namespace) -> int:
    from dirt_env.run import SIDE_BY_SIDE, Run, write_side_by_side

    overrides = read_settings(options.set)
    if options.level is not None:
        overrides["level"] = options.level
    names = [name.strip() for name in options.policy.split(",")]
    if len(names) > 2 or len(set(names)) < len(names):
        raise ValueError(f"--policy is {options.policy!r}; allowed: one, or two different ones to see side by side")
    settings = options.seed, options.steps, overrides, not options.no_replay
    runs = [Run(options.scene, name, *settings) for name in names]
    out = _writable(options.out or Path("runs") / "-".join([Path(options.scene).stem, *map(_as_folder, names)]))
    (out / SIDE_BY_SIDE).unlink(missing_ok=True)
    for run in runs:
        if status := _play(run, options.episodes, out if len(runs) == 1 else out / _as_folder(run.policy_name)):
            return status
    if len(runs) == 2 and not options.no_replay:
        _say(f"wrote {write_side_by_side(*runs, out)}")
    return 0


def _as_folder(policy: str) -> str:
    """A name for a folder: of a path or module:attribute, without what folders cannot have in theirs."""
    return re.sub(r"[^\w.-]+", "-", policy.removesuffix(".npz")).strip("-.")


def _play(run: Any, episodes: int, out: Path) -> int:
    """Play a run's episodes, write and say what came of them; returns the exit status."""
    run.play(episodes)
    written = run.write(out) if run.summaries else []  # before anything is said: nobody may be listening any more
    if run.interrupted:
        done = f"after {len(run.summaries)} of {run.wanted} episodes"
        if not run.summaries:
            done = "before the first episode was finished: nothing written"
        sys.stderr.write(f"dirt-push: interrupted {done}\n")
    if written:
        _say(f"{run.policy_name} in {run.env.config.name}, {run.env.config.task.period:g} s a step", run.table())
        _say("wrote " + ", ".join(str(path) for path in written))
    return INTERRUPTED if run.interrupted else 0


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

        _say(table(rows()))
        return 0
    if docs is not None and (options.quick or selects):
        raise ValueError("--renew-docs is given; allowed: with the full set, without --quick and without a choice")
    if docs is not None and not (docs / "speed.md").is_file():
        raise ValueError(f"--renew-docs is {docs}; allowed: a folder with speed.md")
    from dirt_env.bench.speed.command import Speed, renew_document

    run = Speed(options.quick, options.memory, **chosen)
    out = None if options.out is None else _writable(options.out)
    finished = run.measure()
    written = [] if out is None else [run.write(out)]
    if finished and docs is not None:
        written.append(renew_document(docs, run.report()))
    _say(run.table(), *([f"wrote {', '.join(map(str, written))}"] if written else []))
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

    out = None if options.out is None else _writable(options.out)
    return 0 if stability(options.case, options.quick, out, options.renew_docs) else FAILED


def _writable(out: Path) -> Path:
    """The folder, made if it is not there; an error if it cannot be written to."""
    if out.exists() and not out.is_dir():
        raise ValueError(f"--out is {out}, which is a file; allowed: a folder, or a new name")
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            return out
    except OSError as error:
        raise ValueError(f"--out is {out}: {error.strerror}; allowed: a folder that can be written to") from error


def _scenes(options: argparse.Namespace) -> int:
    from dirt_env.config import load, scene_names

    _say(*_columns((name, load(name).description) for name in scene_names()))
    return 0


def _soils(options: argparse.Namespace) -> int:
    from dirt_env.config.presets import KEYS, PRESETS

    width = max(map(len, PRESETS))
    rows = [f"{name:<{width}}" + "".join(f"  {row[key]:>{len(key)}g}" for key in KEYS) for name, row in PRESETS.items()]
    _say(" " * width + "".join(f"  {key}" for key in KEYS), *rows)
    return 0


def _policies(options: argparse.Namespace) -> int:
    from dirt_env.policy import describe_policy, policy_names

    _say(*_columns((name, describe_policy(name)) for name in policy_names()))
    return 0


def read_settings(settings: Sequence[str]) -> dict[str, Any]:
    """Nested overrides of texts like `soil.repose=30`; values as in TOML, a bare word is a text."""
    overrides: dict[str, Any] = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        parts = key.strip().split(".")
        if not equals or not all(parts):
            raise ValueError(f"--set is {setting!r}; allowed: KEY=VALUE, as in soil.repose=30")
        if parts[0] in NO_KEYS:
            raise ValueError(f"--set is {setting!r}; allowed: keys of the scene only; --scene chooses another scene")
        table = overrides
        for part in parts[:-1]:
            table = table.setdefault(part, {})
            if not isinstance(table, dict):
                raise ValueError(f"--set {setting!r}: {part} is a value already; allowed: one or the other")
        table[parts[-1]] = _value(value.strip())
    return overrides


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _whole(least: int) -> Any:
    """A parser of whole numbers from `least`."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if value < least:
            raise argparse.ArgumentTypeError(f"is {text!r}; allowed: whole numbers >= {least}")
        return value

    return parse


def _columns(pairs: Any) -> list[str]:
    rows = list(pairs)
    width = max(len(name) for name, _ in rows)
    return [f"{name:<{width}}  {text}" for name, text in rows]


def _forgive(stream: Any) -> None:
    """Let a stream write '?' for letters that it cannot encode."""
    if hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="replace")


def _say(*lines: str) -> None:
    if sys.stdout is None:  # closed by whoever started this
        return
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()
