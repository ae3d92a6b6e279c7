"""`dirt-push scenes`, `soils` and `policies`: what there is by name."""

import argparse
from typing import Any

from dirt_env.terminal import columns, say


def add_lists(commands: Any) -> None:
    """Add the three commands."""
    commands.add_parser("scenes", help="list the shipped scenes").set_defaults(command=_scenes)
    commands.add_parser("soils", help="list the soils for soil.preset").set_defaults(command=_soils)
    commands.add_parser("policies", help="list the policies").set_defaults(command=_policies)


def _scenes(options: argparse.Namespace) -> int:
    from dirt_env.config import load, scene_names

    say(*columns((name, load(name).description) for name in scene_names()))
    return 0


def _soils(options: argparse.Namespace) -> int:
    from dirt_env.config.presets import KEYS, PRESETS

    width = max(map(len, PRESETS))
    rows = [f"{name:<{width}}" + "".join(f"  {row[key]:>{len(key)}g}" for key in KEYS) for name, row in PRESETS.items()]
    say(" " * width + "".join(f"  {key}" for key in KEYS), *rows)
    return 0


def _policies(options: argparse.Namespace) -> int:
    from dirt_env.policy import describe_policy, policy_names

    say(*columns((name, describe_policy(name)) for name in policy_names()))
    return 0
