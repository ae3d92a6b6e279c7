"""Train by RLlib: `python agents/rllib/train.py --config configs/rllib/ppo_heap.toml`; see docs/integrations.md.

The same command goes on where a run was stopped, by Ctrl-C, a crash or a kill.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from dirt_env.cli.run import read_settings
from dirt_env.config.loading import merge
from dirt_env.terminal import end, writable

NEEDED = 'it needs an environment of its own, since ray pins gymnasium 1.2.2: pip install ".[rllib]"'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status. Bad input is one line on stderr and status 2."""
    # By their installed name, here and below: this file also runs as a script, and the cluster's machines import it so.
    from dirt_env.agents.arguments import training_parser

    description = "Train a policy by RLlib's PPO, on one machine or many."
    parser = training_parser("dirt_env.agents.rllib.train", description, "runs/rllib")
    parser.add_argument(
        "--address", default="local", help='Ray cluster: its host:port, "auto", or "local" (default: this machine)'
    )
    options = parser.parse_args(arguments)
    return end("train", lambda: _train(options), "broken off; the same command goes on from the last save")


def _train(options: argparse.Namespace) -> int:
    from dirt_env.agents.rllib.settings import load_cluster_settings

    seed = {} if options.seed is None else {"seed": options.seed}
    settings = load_cluster_settings(options.config, merge(read_settings(options.set), seed))
    try:
        from dirt_env.agents.rllib.trainer import POLICY, ClusterTrainer
    except ImportError as error:
        raise ImportError(f"{error}; {NEEDED}") from error
    out = writable(options.out or Path("runs") / "rllib" / f"{settings.name}-seed{settings.seed}")
    trainer = ClusterTrainer(settings, out, options.address, options.fresh)
    if trainer.resumed:
        sys.stderr.write(f"train: going on in {out} after {trainer.steps:,} of {settings.steps:,} steps\n")
    stopped = trainer.run()
    trainer.close()
    if stopped is not None:
        done = f"after {trainer.steps:,} of {settings.steps:,} steps; the same command goes on from there"
        sys.stderr.write(f"train: stopped {done}\n")
        return 128 + stopped
    sys.stdout.write(f"{trainer.steps:,} steps; policy in {out / POLICY}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
