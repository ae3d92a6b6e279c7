"""`dirt-push record`: a policy's episodes as a data set of Minari."""

import argparse
import re
import sys
from pathlib import Path
from typing import Any

from dirt_env.cli.run import read_settings
from dirt_env.split import SPLITS, layouts
from dirt_env.terminal import INTERRUPTED, say, whole, writable


def add_record(commands: Any) -> None:
    """Add the command."""
    record = commands.add_parser("record", help="record a policy's episodes as a data set of Minari")
    record.add_argument("--scene", default="heap", metavar="NAME|FILE", help="shipped scene or TOML file")
    record.add_argument(
        "--policy",
        default="adaptive_push",
        metavar="NAME",
        help="what drives (default: adaptive_push): a name that `dirt-push policies` lists, NAME@FILE.toml with "
        "numbers of your own, a .npz file of training, or module:Class",
    )
    record.add_argument("--episodes", type=whole(1), default=10, metavar="N", help="how many (default: 10)")
    record.add_argument(
        "--split", default="training", choices=SPLITS, help="whose layouts: training (default), selection, evaluation"
    )
    record.add_argument("--skip", type=whole(0), default=0, metavar="K", help="leave out the first K of the layouts")
    record.add_argument("--level", type=whole(0), metavar="L", help="difficulty, in scenes that have levels")
    record.add_argument("--steps", type=whole(1), metavar="N", help="most control steps (default: the job's time)")
    record.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change the scene, as in --set soil.repose=30"
    )
    record.add_argument(
        "--dataset", metavar="ID", help="name of the data set (default: SCENE/POLICY-v0, or SCENE-L/POLICY-v0)"
    )
    record.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of data sets (default: where Minari looks for them)"
    )
    record.set_defaults(command=_record)


def _record(options: argparse.Namespace) -> int:
    try:
        from minari.storage import get_dataset_path

        from dirt_env.record import DataSet, Recording, place_of
    except ImportError as error:
        raise ImportError(f'{error}; record needs Minari: pip install ".[record]" in the checkout') from error
    overrides = read_settings(options.set)
    if options.level is not None:
        overrides["level"] = options.level
    seeds = layouts(options.split, options.skip + options.episodes)[options.skip :]
    level = "" if "level" not in overrides else f"-{overrides['level']}"
    policy = _as_name(options.policy.removesuffix(".npz"))
    name = options.dataset or f"{_as_name(Path(options.scene).stem)}{level}/{policy}-v0"
    place_of(options.out or get_dataset_path(), name)
    recording = Recording(options.scene, options.policy, seeds, options.steps, overrides)
    with DataSet(writable(options.out or get_dataset_path()), name, recording.env) as data:
        recording.play(data)
        told = recording.told
        if told:
            size = data.keep(recording.notes())
    if recording.interrupted:
        done = f"after {len(told)} of {len(seeds)} episodes" if told else "before the first episode was finished"
        sys.stderr.write(f"dirt-push: interrupted {done}{'' if told else ': nothing written'}\n")
    if told:
        share, done = sum(one.share_in_goal for one in told) / len(told), sum(one.is_success for one in told)
        say(
            f"{options.policy} in {recording.config.name}: {len(told)} episodes, {sum(one.steps for one in told):,} "
            f"steps, {share:.1%} in the goal, {done} of {len(told)} done, {size:.1f} MB",
            f"wrote {data.place}",
        )
    return INTERRUPTED if recording.interrupted else 0


def _as_name(text: str) -> str:
    """A part of a data set's name, without what those cannot have in theirs."""
    return re.sub(r"[^\w-]+", "-", text).strip("-")
