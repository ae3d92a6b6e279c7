"""A site to try things out on: the simulator's own ground and machine, rebuilt from what was seen.

The ground is that of the map; position, edge and speed of the machine are those of the pose vector, so a copy starts
within float32 rounding of the real site. Zones lie where the scene's file says. It needs the simulator and the scene's
configuration, no access to the environment.
"""

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.config.terrain import HeightField
from dirt_env.scene.zone import zone_map
from dirt_env.sim.advance import advance, set_down
from dirt_env.sim.state import make_world
from dirt_env.task.actions import decode

from .site import Site

SEEN = ("edge", "speed", "yaw_rate", "load")  # of the machine, beside where it stands


class ImaginedSite(Site):
    """A site that answers actions: `copy` another one, `step`, look at it as at the real one."""

    def __init__(self, config: SceneConfig) -> None:
        """For a scene; ValueError for one whose ground a map does not show in full, or with grade control."""
        if config.action.blade != "tracks":
            raise ValueError(f'action.blade is {config.action.blade!r}; allowed for the planner: "tracks"')
        if not isinstance(config.terrain, HeightField):
            raise ValueError(f"terrain is {config.terrain.kind!r}; allowed: heightfield, which a map shows in full")
        if config.soil.swell > 0.0:
            raise ValueError(
                f"soil.swell is {config.soil.swell:g}; allowed for the planner: 0, as a map does not tell bank soil "
                "from loose"
            )
        if config.zones and config.vary is not None:
            raise ValueError(
                f"zone has {len(config.zones)} and the scene has [vary]; allowed for the planner: zones without vary, "
                "as a map does not show where they were moved"
            )
        super().__init__(config)
        self._config, self._pull = config, config.pull
        self._zones = config.zones_for(zone_map([zone.region for zone in config.zones], config.grid))

    def copy(self, site: Site) -> None:
        """Begin where a site is now."""
        config = self._config
        for name in ("target", "solid", "goal", "goals", "depth", "gap", "capacity", "rim", "may_lack"):
            setattr(self, name, getattr(site, name))
        solid = site.solid if config.has_walls else None
        self._world = make_world(site.height.astype(float), self.grid, solid, config.site.border == "open")
        self._world.pending[:] = 0
        pose = site.pose
        place = pose["x"], pose["y"], pose["heading"]
        set_down(self._world, self.grid, self.soil, self.blade, self.machine, *place, self._zones)
        machine = self._world.machine[0]
        machine.closed = -1.0  # not known
        for name in SEEN:
            machine[name] = pose[name]
        self._look()

    def step(self, action: np.ndarray) -> None:
        """One control step."""
        command = decode(action, self.machine)
        constants = self.grid, self.soil, self.blade, self.machine
        advance(self._world, *constants, command, self.period, self._pull, self._zones)
        self._look()

    def _look(self) -> None:
        """What a policy would be shown."""
        self.height, self.plane = self._world.height, None
        over = np.where(self.solid, 0.0, self.height - self.target)
        self.excess = np.where(self.goal, 0.0, np.maximum(over, 0.0))
        self.fill = np.where(self.may_lack, np.maximum(-over, 0.0), 0.0)
        machine = self._world.machine[0]
        self.pose = {name: float(machine[name]) for name in machine.dtype.names}
