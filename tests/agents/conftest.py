"""Policy files and settings that the tests of the agents share."""

from pathlib import Path

import numpy as np
import pytest
from dirt_env.agents.loading import load_settings
from dirt_env.agents.network import written

SMOKE = Path(__file__).resolve().parents[2] / "configs" / "train" / "smoke.toml"
SEEN = {
    "size": 8,
    "resolution": 2.0,
    "ahead": 0.7,
    "height_limit": 4.0,
    "channels": ["height", "todo"],
    "overview": False,
}
METADATA = {"observation": SEEN, "action": {"blade": "tracks"}, "strides": [2], "hidden": 1, "clip": 10.0}


def smoke(**overrides):
    """The smoke settings, with some changes."""
    return load_settings(SMOKE, overrides)


def weights(generator=None, drive=(0.0, 0.0, 0.0)):
    """Arrays of a small network: drawn by the generator, or zero, which always acts as `drive`."""
    shapes = {
        "conv0.weight": (4, 2, 3, 3),
        "conv0.bias": (4,),
        "hidden0.weight": (16, 4 * 3 * 3 + 15),
        "hidden0.bias": (16,),
        "action.weight": (3, 16),
        "action.bias": (3,),
        "pose.mean": (15,),
        "pose.scale": (15,),
    }
    draw = (lambda shape: np.zeros(shape)) if generator is None else generator.standard_normal
    arrays = {name: draw(shape).astype(np.float32) for name, shape in shapes.items()}
    arrays["pose.scale"][:] = 1.0
    if generator is None:
        arrays["action.bias"][:] = drive
    return arrays


@pytest.fixture
def pusher(tmp_path):
    """The file of a policy that drives straight on with its blade at grade."""
    path = tmp_path / "pusher.npz"
    path.write_bytes(written(weights(drive=(0.0, 0.25, 0.0)), METADATA))
    return path
