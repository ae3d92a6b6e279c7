"""Left and right are alike: a network sees the world turned over where the goal lies to the right, and steers so."""

from collections.abc import Mapping

import numpy as np

from dirt_env.task.actions import ACTIONS
from dirt_env.task.observation import POSE_ENTRIES

SIDED = ("y", "sin_heading", "yaw_rate", "roll", "goal_left")  # entries of the pose that change their sign
PICTURES = ("patch", "overview")  # their last axis goes from left to right
GOAL_LEFT = POSE_ENTRIES.index("goal_left") - len(POSE_ENTRIES)  # of the last frame
SIGNS = np.array([-1.0 if name in SIDED else 1.0 for name in POSE_ENTRIES], np.float32)
STEERING = ACTIONS.index("steering")


class Mirror:
    """Turns over what is seen of a world where the goal lies to the right, as if in a mirror, and the steering back.

    A network that sees all goals on its left has half as much to learn. Training and the trained policy both turn by
    this class. With `on` False observations and actions are passed on as they are.
    """

    def __init__(self, on: bool) -> None:
        """Turn nothing yet."""
        self.on = on
        self.turned = np.zeros(0, bool)  # of each world of the batch: whether it was shown turned over

    def show(self, seen: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """What the network is shown of patches f4[n, ...], poses f4[n, 15 f] and overviews, of f frames."""
        if not self.on:
            return dict(seen)
        self.turned = seen["pose"][:, GOAL_LEFT] < 0.0
        which = np.flatnonzero(self.turned)
        shown = {name: seen[name].copy() for name in ("pose", *PICTURES) if name in seen}
        shown["pose"][which] *= np.tile(SIGNS, shown["pose"].shape[1] // len(SIGNS))
        for name in shown.keys() & PICTURES:
            shown[name][which] = seen[name][which, ..., ::-1]
        return {**seen, **shown}

    def show_last(self, seen: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The same for what was seen last in a single world whose episode has ended; `steer` is not told of it."""
        batch = Mirror(self.on).show({name: array[None] for name, array in seen.items()})
        return {name: array[0] for name, array in batch.items()}

    def steer(self, actions: np.ndarray) -> np.ndarray:
        """Actions [n, 3] with the steering turned over in the worlds that `show` has turned over; its own inverse."""
        if not self.on:
            return actions
        result = np.array(actions)
        result[self.turned, STEERING] *= -1.0
        return result
