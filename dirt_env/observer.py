"""What the observations of a scene are like: the bounds of their spaces, and new arrays for them."""

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.task.observation import Sight, bounds, make_view, pose_table

CERTAIN = 3.0  # standard deviations of a height: what is less above its aim may be an error, and is not in the overview


class Observer:
    """The observations of a scene.

    `table` has units and scales of the pose vector, `bounds` the lowest and highest values of every array, by name,
    `view` the constants for the kernel.
    """

    def __init__(self, config: SceneConfig) -> None:
        wanted, grid = config.observation, config.grid
        limit, height = wanted.height_limit, config.blade.height
        self.table = pose_table(grid, config.blade, config.machine)
        walls, channels = config.has_walls, config.channels
        self.bounds = bounds(grid, self.table, wanted.size, channels, limit, walls, wanted.overview, wanted.map)
        beyond = -height if config.site.border == "open" else height
        doubt = 0.0 if wanted.noise is None else CERTAIN * wanted.noise.height
        self.view = make_view(self.table, grid, wanted.resolution, wanted.ahead, limit, beyond, doubt, channels)
        self._shapes = {name: low.shape for name, (low, _) in self.bounds.items()}

    def blank(self) -> tuple[dict[str, np.ndarray], Sight]:
        """New f4 arrays for one world, not filled, by name; and the same for the kernels, with a leading axis."""
        arrays = {name: np.empty(shape, np.float32) for name, shape in self._shapes.items()}
        overview, site = arrays.get("overview"), arrays.get("map")
        return arrays, Sight(
            arrays["patch"][None],
            arrays["pose"][None],
            None if overview is None else overview[None],
            None if site is None else site[None],
        )

    def blanks(self, count: int) -> tuple[dict[str, np.ndarray], Sight]:
        """New f4 arrays for `count` worlds, not filled, by name; and the same arrays for the kernels."""
        arrays = {name: np.empty((count, *shape), np.float32) for name, shape in self._shapes.items()}
        return arrays, Sight(arrays["patch"], arrays["pose"], arrays.get("overview"), arrays.get("map"))
