"""Actions become commands in SI units; what is no action is refused by name."""

import numpy as np
import pytest

from dirt_env.sim.params import Command, Machine
from dirt_env.task.actions import decode

MACHINE = Machine(speed=2.0, yaw_rate=0.6, cut=0.25, lift=0.75)


@pytest.mark.parametrize(
    ("action", "command"),
    [
        ([0, 0, 0], Command(0.0, 0.0, 0.0)),
        ([1, 1, 1], Command(2.0, 0.6, 0.75)),
        ([-1, -1, -1], Command(-2.0, -0.6, -0.25)),
        ([0.5, -0.5, -0.5], Command(-1.0, 0.3, -0.125)),
    ],
)
def test_actions_are_shares_of_the_machines_limits(action, command):
    assert decode(action, MACHINE) == command


@pytest.mark.parametrize("kind", [list, tuple, np.float32, np.float64])
def test_every_kind_of_number_is_taken(kind):
    action = kind([0.5, 0.25, -1]) if kind in (list, tuple) else np.array([0.5, 0.25, -1], kind)
    assert decode(action, MACHINE) == Command(0.5, 0.3, -0.25)


def test_out_of_range_is_clipped():
    assert decode([7, -7, 1e300], MACHINE) == decode([1, -1, 1], MACHINE)


@pytest.mark.parametrize(("entry", "name"), [(0, "steering"), (1, "speed"), (2, "blade")])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_by_name(entry, name, value):
    action = np.zeros(3)
    action[entry] = value
    with pytest.raises(ValueError, match=f"{name} {value}; allowed: finite"):
        decode(action, MACHINE)


@pytest.mark.parametrize("action", [0.0, [0, 0], np.zeros(4), np.zeros((1, 3)), []])
def test_a_wrong_shape_is_refused(action):
    with pytest.raises(ValueError, match=r"action has the shape .*; allowed: \(3,\)"):
        decode(action, MACHINE)


@pytest.mark.parametrize("action", [None, "left", ["a", "b", "c"], [[1], [1, 2], 3]])
def test_what_is_no_numbers_is_refused(action):
    with pytest.raises(ValueError, match="allowed"):
        decode(action, MACHINE)
