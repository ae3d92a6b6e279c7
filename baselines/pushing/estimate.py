"""The ground and the machine's pose as they most likely are, from observations that noise blurs.

Ground lies still where no blade is, so each cell is a running mean of what was measured there (a Kalman filter without
dynamics, R. E. Kalman 1960), which begins anew where the blade works and where a measurement contradicts it. The pose
is carried on by the speed and the yaw rate, which are exact, and corrected by what is measured.
"""

from math import cos, radians, sin

import numpy as np

from dirt_env.config.tables import Noise
from dirt_env.sim.params import Blade, Grid

CONTRADICTED = 4.0  # standard deviations by which a measurement is off where the ground has changed
AHEAD, ASIDE, BEHIND = 2.5, 1.0, 0.5  # m round the blade in which soil may move at any time
MOVING = 0.02  # m; standard deviation of what it moves there in a step, beyond what contradicts
DRIFT = 0.01  # m and rad; standard deviation of what the speed does not tell of a step's way
CERTAIN = 2.5  # standard deviations; soil less than that above the target may be none


class Estimate:
    """Mean and variance of the ground [row, col] and of the pose (x, y, heading), step by step.

    `untouched` [row, col] bool: where no blade has been near.
    """

    def __init__(self, noise: Noise, grid: Grid, blade: Blade, period: float) -> None:
        self._variance_of = float(noise.height) ** 2
        self._pose_variance = np.array([noise.position, noise.position, radians(noise.heading)]) ** 2
        self._grid, self._blade, self._period = grid, blade, period
        self.height: np.ndarray | None = None

    def begin(self, height: np.ndarray, pose: dict[str, float]) -> None:
        """Take the first measurement for true."""
        self.height, self.variance = height.astype(float), np.full(height.shape, self._variance_of)
        self.untouched = np.ones(height.shape, bool)
        self._at = np.array([pose["x"], pose["y"], pose["heading"]])
        self._spread = self._pose_variance.copy()

    def update(self, height: np.ndarray, pose: dict[str, float], x: np.ndarray, y: np.ndarray) -> dict[str, float]:
        """Take in a measurement; `x`, `y` [row, col] m are the cells' centres. Returns the pose as it likely is."""
        found = self._locate(pose)
        worked = self._worked(found, x, y)
        self.untouched &= ~worked
        if self._variance_of > 0.0:
            self._measure(height, worked)
        else:
            self.height = height
        return found

    @property
    def doubt(self) -> np.ndarray:
        """Height [row, col] m that the estimate is off with little likelihood."""
        return CERTAIN * np.sqrt(self.variance)

    def _measure(self, height: np.ndarray, worked: np.ndarray) -> None:
        """One step of the filter for each cell."""
        self.variance[worked] += MOVING**2
        off = height - self.height
        anew = off**2 > CONTRADICTED**2 * (self.variance + self._variance_of)
        gain = np.where(anew, 1.0, self.variance / (self.variance + self._variance_of))
        self.height += gain * off
        self.variance = np.where(anew, self._variance_of, (1.0 - gain) * self.variance)

    def _worked(self, pose: dict[str, float], x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Cells about the blade, bool [row, col]."""
        east, north = cos(pose["heading"]), sin(pose["heading"])
        ahead = (x - pose["x"]) * east + (y - pose["y"]) * north - self._blade.reach
        left = (y - pose["y"]) * east - (x - pose["x"]) * north
        return (ahead > -BEHIND) & (ahead < AHEAD) & (np.abs(left) < 0.5 * self._blade.width + ASIDE)

    def _locate(self, pose: dict[str, float]) -> dict[str, float]:
        """The pose carried on by a step, then drawn to what is measured."""
        turn, go = pose["yaw_rate"] * self._period, pose["speed"] * self._period
        middle = self._at[2] + 0.5 * turn
        at = self._at + np.array([go * cos(middle), go * sin(middle), turn])
        spread = self._spread + DRIFT**2 * (go != 0.0 or turn != 0.0)
        off = np.array([pose["x"], pose["y"], pose["heading"]]) - at
        off[2] = (off[2] + np.pi) % (2 * np.pi) - np.pi
        gain = spread / np.maximum(spread + self._pose_variance, 1e-12)
        gain[self._pose_variance == 0.0] = 1.0
        self._at, self._spread = at + gain * off, (1.0 - gain) * spread
        x, y, heading = self._at.tolist()
        return {**pose, "x": x, "y": y, "heading": heading, "sin_heading": sin(heading), "cos_heading": cos(heading)}
