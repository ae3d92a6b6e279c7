"""Zones: regions of the site with another soil than the rest."""

from collections.abc import Sequence

import numpy as np

from dirt_env.scene.regions import Region, rasterize
from dirt_env.sim.params import Grid

MOST = 100  # zones of a scene; cells keep their number in a byte


def zone_map(regions: Sequence[Region], grid: Grid) -> np.ndarray | None:
    """Which zone each cell belongs to, i1 [rows, cols]: 0 to none, i + 1 to region i; the later of two that overlap.

    None without regions. Raises ValueError for one that leaves the site or holds no cell centre.
    """
    if not regions:
        return None
    index = np.zeros((grid.rows, grid.cols), np.int8)
    for i, region in enumerate(regions):
        index[rasterize(region, grid, f"zone[{i}].region")] = i + 1
    return index
