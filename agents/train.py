"""Train a policy: `python agents/train.py --config configs/train/ppo_heap.toml`. docs/training.md explains all of it.

The same command goes on where a run was stopped, by Ctrl-C, a crash or a kill.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dirt_env.cli.run import read_settings
from dirt_env.config.loading import merge
from dirt_env.terminal import end, writable


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status. Bad input is one line on stderr and status 2."""
    # By their installed name, here and below: this file also runs as a script, which has no package around it.
    from dirt_env.agents.arguments import training_parser

    description = "Train a policy by PPO or SAC; go on where a run was stopped."
    parser = training_parser("dirt_env.agents.train", description, "runs/train")
    options = parser.parse_args(arguments)
    return end("train", lambda: _train(options), "broken off; the same command goes on from the last save")


def _train(options: argparse.Namespace) -> int:
    from dirt_env.agents.loading import load_settings

    seed = {} if options.seed is None else {"seed": options.seed}
    settings = load_settings(options.config, merge(read_settings(options.set), seed))
    try:
        from dirt_env.agents.lock import alone_in
        from dirt_env.agents.trainer import Trainer, check_device
    except ImportError as error:
        raise ImportError(f'{error}; training needs more than the environment: pip install ".[train]"') from error
    check_device(settings.device)
    out = writable(options.out or Path("runs") / "train" / f"{settings.name}-seed{settings.seed}")
    with alone_in(out):
        return _run(Trainer(settings, out, options.fresh))


def _run(trainer: Any) -> int:
    """Train to the end, and say what came of it; returns the exit status."""
    settings, out = trainer.settings, trainer.out
    if trainer.resumed:
        sys.stderr.write(f"train: going on in {out} after {trainer.steps:,} of {settings.steps:,} steps\n")
        if other := ", ".join(trainer.other_versions):
            sys.stderr.write(f"train: with {other}, so not to the same last bit as if it had never stopped\n")
    else:
        sys.stderr.write(f"train: beginning in {out}, {settings.steps:,} steps\n")
    stopped = trainer.run()
    trainer.close()
    if stopped is not None:
        rest = "goes on from there" if trainer.is_saved else "begins again: imitation is not saved before its end"
        done = f"after {trainer.steps:,} of {settings.steps:,} steps; the same command {rest}"
        sys.stderr.write(f"train: stopped {done}\n")
        return 128 + stopped
    for score in trainer.notes["scores"]:
        level = "" if score["level"] is None else f"level {score['level']}: "
        shares = f"{score['share_end']:.1%} in the goal, {score['success']:.0%} done, {score['time_s']:.0f} s"
        sys.stdout.write(f"{level}{shares} (selection layouts)\n")
    sys.stdout.write(f"{trainer.steps:,} steps in {trainer.notes['seconds']:.0f} s; policy in {out / 'policy.npz'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
