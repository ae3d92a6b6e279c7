"""From three numbers in [-1, 1] to what the machine is told."""

from math import isfinite
from typing import Any

import numpy as np

from dirt_env.sim.jit import kernel
from dirt_env.sim.params import Command, Machine

ACTIONS = ("steering", "speed", "blade")
"""Order of the entries: left, forward and up are positive."""


def decode(action: Any, machine: Machine) -> Command:
    """Command of an action (3,), see `command_of`; ValueError for what is no action."""
    return command_of(*read_action(action).tolist(), machine)


@kernel
def command_of(steering: float, speed: float, blade: float, machine: Machine) -> Command:
    """Command of an action in [-1, 1]; what lies outside counts as clipped.

    Blade 0 puts the cutting edge at grade, -1 at the machine's largest cut depth, +1 at its travel height.
    """
    steering = min(max(steering, -1.0), 1.0)
    speed = min(max(speed, -1.0), 1.0)
    blade = min(max(blade, -1.0), 1.0)
    edge = blade * (machine.lift if blade > 0.0 else machine.cut)
    return Command(speed * machine.speed, steering * machine.yaw_rate, edge)


def read_action(action: Any) -> np.ndarray:
    """The action as f8[3], or a ValueError that names what is wrong with it."""
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"action is {action!r}; allowed: 3 numbers in [-1, 1] ({', '.join(ACTIONS)})") from None
    if values.shape != (3,):
        raise ValueError(f"action has the shape {values.shape}; allowed: (3,), which is {', '.join(ACTIONS)}")
    numbers = values.tolist()  # quicker for three numbers than np.isfinite
    if not (isfinite(numbers[0]) and isfinite(numbers[1]) and isfinite(numbers[2])):
        name, value = next((n, v) for n, v in zip(ACTIONS, numbers, strict=True) if not isfinite(v))
        raise ValueError(f"action is {numbers}, its {name} {value}; allowed: finite numbers")
    return values


def read_actions(actions: Any, count: int) -> np.ndarray:
    """The actions of `count` worlds, f8[count, 3], or a ValueError that names the world and what is wrong with it."""
    try:
        values = np.asarray(actions, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        allowed = f"{count} x 3 numbers in [-1, 1] ({', '.join(ACTIONS)})"
        raise ValueError(f"actions are {actions!r:.200}; allowed: {allowed}") from None
    if values.shape != (count, 3):
        names = ", ".join(ACTIONS)
        raise ValueError(f"actions have the shape {values.shape}; allowed: {(count, 3)}, for each world {names}")
    if np.count_nonzero(np.isfinite(values)) < values.size:
        world, entry_ = np.argwhere(~np.isfinite(values))[0]
        found = f"{values[world].tolist()}, its {ACTIONS[entry_]} {values[world, entry_]}"
        raise ValueError(f"action of world {world} is {found}; allowed: finite numbers")
    return values
