"""`dirt-push run`: a policy does a job; figures, a replay and an animated picture."""

import argparse
import re
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dirt_env.terminal import BAD_INPUT, INTERRUPTED, say, whole, writable

NO_KEYS = ("self", "scene", "render_mode")  # arguments of the environment that are no keys of a scene


def add_run(commands: Any) -> None:
    """Add the command."""
    run = commands.add_parser("run", help="let a policy do a job; write figures, a replay and an animated picture")
    run.add_argument("--scene", default="heap", metavar="NAME|FILE", help="shipped scene or TOML file (default: heap)")
    run.add_argument(
        "--policy",
        default="adaptive_push",
        metavar="NAME",
        help="what drives (default: adaptive_push): a name that `dirt-push policies` lists, NAME@FILE.toml with "
        "numbers of your own, a .npz file of training, or module:Class; two with a comma are played side by side",
    )
    run.add_argument("--episodes", type=whole(1), default=1, metavar="N", help="how many (default: 1)")
    run.add_argument("--seed", type=whole(0), default=0, metavar="S", help="of the first layout (default: 0)")
    run.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for what is written (default: runs/SCENE-POLICY, or runs/SCENE-L-POLICY with a level)",
    )
    run.add_argument("--level", type=whole(0), metavar="L", help="difficulty, in scenes that have levels")
    run.add_argument("--steps", type=whole(1), metavar="N", help="most control steps (default: the job's time)")
    run.add_argument("--no-replay", action="store_true", help="write summary.json only (an old replay goes)")
    run.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change the scene, as in --set soil.repose=30"
    )
    run.set_defaults(command=_run)


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
    folders = [_as_folder(name) for name in names]
    if len(set(folders)) < len(folders):  # as of mine/ppo.npz and ppo
        folders[1] += "-2"
    level = [str(overrides["level"])] if "level" in overrides else []
    out = options.out or Path("runs") / "-".join([Path(options.scene).stem, *level, *folders])
    is_new, out = not out.exists(), writable(out)
    (out / SIDE_BY_SIDE).unlink(missing_ok=True)
    for run, folder in zip(runs, folders, strict=True):
        if status := _play(run, options.episodes, out if len(runs) == 1 else out / folder):
            if is_new and not any(out.iterdir()):
                out.rmdir()
            return status
    if len(runs) == 2 and not options.no_replay:
        say(f"wrote {write_side_by_side(*runs, out)}")
    return 0


def _as_folder(policy: str) -> str:
    """A name for a folder: of a path or module:attribute, without what folders cannot have in theirs."""
    return re.sub(r"[^\w.-]+", "-", policy.removesuffix(".npz")).strip("-.")


def _play(run: Any, episodes: int, out: Path) -> int:
    """Play a run's episodes, write and say what came of them; returns the exit status."""
    run.play(episodes)
    written = run.write(out) if run.summaries else []  # before anything is said: nobody may be listening any more
    if run.interrupted or run.failure:
        done = f"after {len(run.summaries)} of {run.wanted} episodes"
        if not run.summaries:
            done = "before the first episode was finished: nothing written"
        what = f"error: {run.failure};" if run.failure else "interrupted"
        sys.stderr.write(f"dirt-push: {what} {done}\n")
    if written:
        say(f"{run.policy_name} in {run.env.config.name}, {run.env.config.task.period:g} s a step", run.table())
        say("wrote " + ", ".join(str(path) for path in written))
    if run.failure:
        return BAD_INPUT
    return INTERRUPTED if run.interrupted else 0


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
