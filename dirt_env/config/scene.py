"""The validated scene: one frozen value that holds everything an environment is made from."""

from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np

from dirt_env.config.soils import Earth, Zone
from dirt_env.config.tables import POSE, SCENE, Action, Observation, Reward, Site, Task
from dirt_env.config.terrain import Terrain
from dirt_env.scene.design import Design
from dirt_env.scene.fixed import Goal, Ground, Hollow, Start
from dirt_env.scene.layout import Setting
from dirt_env.scene.obstacles import Obstacle
from dirt_env.scene.sampling import Sampler
from dirt_env.scene.vary import Vary
from dirt_env.sim.params import Blade, Grid, Machine, Soil, Strength, Traction
from dirt_env.sim.traction import PULL, Pull, pull_of
from dirt_env.sim.zones import SOILS, Zones

# Attribute of a key, where it differs.
FIELDS = {
    "soil": "earth",
    "zone": "zones",
    "start": "starts",
    "goal": "goals",
    "hollow": "hollows",
    "obstacle": "obstacles",
}


@dataclass(frozen=True)
class SceneConfig:
    """One scene. Made by `dirt_env.config.load`, which checks it; equal, hashable and picklable by value."""

    name: str
    description: str
    site: Site
    ground: Ground
    terrain: Terrain
    soil: Soil
    strength: Strength
    zones: tuple[Zone, ...]
    blade: Blade
    machine: Machine
    traction: Traction | None  # None: the machine does what it is told, whatever that takes
    pose: tuple[float, float, float] | str  # x m, y m, heading degrees; or "behind" or "random"
    starts: tuple[Start, ...]
    goals: tuple[Goal, ...]
    hollows: tuple[Hollow, ...]
    design: Design | None
    obstacles: tuple[Obstacle, ...]
    vary: Vary | None  # None: everything lies where it is written
    layout: Sampler | None  # None: the starts and goals above
    task: Task
    action: Action
    observation: Observation
    reward: Reward

    @property
    def grid(self) -> Grid:
        """The site's raster."""
        return Grid(
            round(self.site.size[1] / self.site.cell), round(self.site.size[0] / self.site.cell), self.site.cell
        )

    @property
    def earth(self) -> Earth:
        """What the table `soil` says."""
        return Earth(self.soil, self.strength)

    @property
    def pull(self) -> Pull | None:
        """Constants of draft and traction for the kernels, or None where they are not computed."""
        if self.traction is None:
            return None
        return self._pull(self.earth)

    @property
    def soils(self) -> tuple[Earth, ...]:
        """The scene's soil and that of each zone, in the order of the zones' numbers in a layout."""
        return self.earth, *(zone.earth(self.earth) for zone in self.zones)

    def zones_for(self, index: np.ndarray | None) -> Zones | None:
        """The soils of a layout whose cells have those numbers i1[rows, cols], for the simulator; None of None."""
        if index is None:
            return None
        soils, pulls = self.zone_tables
        return Zones(index, soils, pulls, np.zeros(len(soils)), np.zeros(len(soils)))

    @property
    def zone_tables(self) -> tuple[np.ndarray, np.ndarray | None]:
        """Records SOILS[k] and PULL[k] of all `soils`, the latter None without traction."""
        soils = np.array([tuple(earth.soil) for earth in self.soils], SOILS)
        if self.traction is None:
            return soils, None
        return soils, np.array([tuple(self._pull(earth)) for earth in self.soils], PULL)

    def _pull(self, earth: Earth) -> Pull:
        return pull_of(earth.soil, earth.strength, self.blade, self.machine, self.traction)

    @property
    def steps(self) -> int:
        """Control steps in the nominal job time: a `max_episode_steps` in which a good behaviour can finish."""
        return ceil(self.task.time / self.task.period - 1e-9)

    @property
    def has_walls(self) -> bool:
        """Whether layouts can have solid cells (obstacles, ground without data); the patch then has a channel more."""
        if self.layout is not None:
            return self.layout.obstacles[1] > 0
        return bool(self.obstacles) or getattr(self.ground, "nodata", None) == "wall"

    @property
    def channels(self) -> tuple[str, ...]:
        """The patch's channels: those that are asked for, else height and what is to do, and walls where can be any."""
        return self.observation.channels or (("height", "todo", "walls") if self.has_walls else ("height", "todo"))

    @property
    def setting(self) -> Setting:
        """What a layout has to suit."""
        return Setting(self.grid, self.soil.slope, self.blade, self.machine)

    def to_dict(self) -> dict[str, Any]:
        """Plain data (numbers, texts, lists, dicts) that `load` takes back; file paths are absolute."""
        values = {key: getattr(self, FIELDS.get(key, key)) for key in SCENE}
        plain = {key: SCENE[key].write(value) for key, value in values.items() if value is not None and value != ()}
        if self.layout is None:
            plain["machine"]["pose"] = POSE.write(self.pose)
        return plain
