"""How much is left to do on a site: the potential of the task, from what is seen."""

import numpy as np

from dirt_env.task.haul import haul_distance

from .site import Site


class Value:
    """Volume times way to where it belongs [m3 m], with the ways as they are on a site when this is made."""

    def __init__(self, site: Site) -> None:
        walls = site.solid if site.solid.any() else None
        self._way = np.where(site.solid, 0.0, haul_distance(site.goal | (site.fill > 0.0), walls, site.grid.cell))
        soil = float(site.excess.sum())
        self._mean = float((site.excess * self._way).sum()) / soil if soil > 0.0 else site.grid.cell

    def left(self, site: Site) -> float:
        """What is left on a site; soil that is missing counts with the mean way."""
        over = float((site.excess * self._way).sum()) + self._mean * float(site.fill.sum())
        return over * site.grid.cell**2
