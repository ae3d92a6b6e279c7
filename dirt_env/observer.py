"""Observations of a scene: their spaces' bounds, and the arrays."""

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.episode import Episode
from dirt_env.task.observation import Sight, bounds, make_view, observe, pose_table


class Observer:
    """Makes the observations of a scene; every one is a set of new arrays.

    `table` has units and scales of the pose vector, `bounds` the lowest and highest values of every array, by name.
    """

    def __init__(self, config: SceneConfig) -> None:
        wanted, grid = config.observation, config.grid
        limit, height = wanted.height_limit, config.blade.height
        self.table = pose_table(grid, config.blade, config.machine)
        walls, channels = config.has_walls, config.channels
        self.bounds = bounds(grid, self.table, wanted.size, channels, limit, walls, wanted.overview, wanted.map)
        beyond = -height if config.site.border == "open" else height
        self._view = make_view(self.table, grid, wanted.resolution, wanted.ahead, limit, beyond, channels)
        self._shapes = {name: low.shape for name, (low, _) in self.bounds.items()}
        self._cell, self._time = grid.cell, config.task.time

    def look(self, episode: Episode) -> dict[str, np.ndarray]:
        """What the policy is shown of an episode, f4 arrays by name (see `DirtPushEnv`)."""
        seen = {name: np.empty(shape, np.float32) for name, shape in self._shapes.items()}
        sight = Sight(seen["patch"], seen["pose"], seen.get("overview"), seen.get("map"))
        world, job = episode.world, episode.job
        time_left = max(0.0, 1.0 - episode.time / self._time)
        observe(world.height, job, world.machine, self._cell, self._view, 1.0 - episode.share, time_left, sight)
        return seen
