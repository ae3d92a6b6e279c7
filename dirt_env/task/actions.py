"""From three numbers in [-1, 1] to what the machine is told."""

from math import isfinite
from typing import Any

import numpy as np

from dirt_env.sim.params import Command, Machine

ACTIONS = ("steering", "speed", "blade")
"""Order of the entries: left, forward and up are positive."""


def decode(action: Any, machine: Machine) -> Command:
    """Command of an action (3,) in [-1, 1]: steering, speed, blade; what lies outside counts as clipped.

    Blade 0 puts the cutting edge at grade, -1 at the machine's largest cut depth, +1 at its travel height.
    """
    steering, speed, blade = _numbers(action)
    steering = min(max(steering, -1.0), 1.0)
    speed = min(max(speed, -1.0), 1.0)
    blade = min(max(blade, -1.0), 1.0)
    edge = blade * (machine.lift if blade > 0.0 else machine.cut)
    return Command(speed * machine.speed, steering * machine.yaw_rate, edge)


def _numbers(action: Any) -> list[float]:
    """The three entries of an action as Python floats, or a ValueError that names what is wrong with it."""
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"action is {action!r}; allowed: 3 numbers in [-1, 1] ({', '.join(ACTIONS)})") from None
    if values.shape != (3,):
        raise ValueError(f"action has the shape {values.shape}; allowed: (3,), which is {', '.join(ACTIONS)}")
    numbers = values.tolist()
    if not (isfinite(numbers[0]) and isfinite(numbers[1]) and isfinite(numbers[2])):
        name, value = next((n, v) for n, v in zip(ACTIONS, numbers, strict=True) if not isfinite(v))
        raise ValueError(f"action is {numbers}, its {name} {value}; allowed: finite numbers")
    return numbers
