"""The command line: `dirt-push`, the same as `python -m dirt_env`."""

import argparse
import os
import sys
import tomllib
import warnings
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from dirt_env import __version__

BAD_INPUT, INTERRUPTED = 2, 130
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
    run.add_argument("--policy", default="adaptive_push", metavar="NAME", help="what drives (default: adaptive_push)")
    run.add_argument("--episodes", type=_whole(1), default=1, metavar="N", help="how many (default: 1)")
    run.add_argument("--seed", type=_whole(0), default=0, metavar="S", help="of the first layout (default: 0)")
    run.add_argument("--out", type=Path, metavar="DIR", help="folder for what is written (default: runs/SCENE-POLICY)")
    run.add_argument("--level", type=_whole(0), metavar="L", help="difficulty of a random layout, 0 to 5")
    run.add_argument("--steps", type=_whole(1), metavar="N", help="most control steps (default: the job's time)")
    run.add_argument("--no-replay", action="store_true", help="write summary.json only (an old replay goes)")
    run.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change the scene, as in --set soil.repose=30"
    )
    run.set_defaults(command=_run)
    _add_accuracy(commands)
    commands.add_parser("scenes", help="list the shipped scenes").set_defaults(command=_scenes)
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


def _run(options: argparse.Namespace) -> int:
    from dirt_env.run import Run

    overrides = read_settings(options.set)
    if options.level is not None:
        overrides["level"] = options.level
    run = Run(options.scene, options.policy, options.seed, options.steps, overrides, not options.no_replay)
    out = _writable(options.out or Path("runs") / f"{Path(options.scene).stem}-{options.policy}")
    run.play(options.episodes)
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
