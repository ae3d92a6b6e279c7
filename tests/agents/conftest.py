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


@pytest.fixture
def stable_baselines3():
    """Skips what needs it where it is not installed."""
    return pytest.importorskip("stable_baselines3")


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


def broken_and_gone_on(settings, folder, broken_at, saved_at):
    """Hold a run that breaks off at `broken_at` steps and goes on from `saved_at` to the policy of one that does not.

    They are left in the folder's `broken` and `whole`.
    """
    from dirt_env.agents.trainer import Trainer

    whole = Trainer(settings, folder / "whole")
    assert whole.run() is None
    whole.close()
    broken = Trainer(settings, folder / "broken")
    learn = broken.model.learn

    def fail(*arguments, **options):
        if broken.steps >= broken_at:
            raise RuntimeError("killed")
        return learn(*arguments, **options)

    broken.model.learn = fail
    with pytest.raises(RuntimeError, match="killed"):
        broken.run()
    broken.close()
    again = Trainer(settings, folder / "broken")
    assert again.steps == saved_at
    assert again.run() is None
    again.close()
    first, second = ((folder / name / "policy.npz").read_bytes() for name in ("whole", "broken"))
    assert first == second


@pytest.fixture
def pusher(tmp_path):
    """The file of a policy that drives straight on with its blade at grade."""
    path = tmp_path / "pusher.npz"
    path.write_bytes(written(weights(drive=(0.0, 0.25, 0.0)), METADATA))
    return path
