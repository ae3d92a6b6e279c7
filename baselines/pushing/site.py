"""What a behaviour that sees the map knows of the site: soil to move, goals and their room, the machine."""

from math import cos, sin

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.scene.distance import distance_inside, distance_outside
from dirt_env.scene.layout import centres
from dirt_env.scene.regions import rasterize
from dirt_env.task.observation import pose_table, read_pose

from .estimate import Estimate

RIM = 0.5  # of the slope at repose; where the target is steeper than that it has a step, as at the rim of a pit
MOST_HEIGHT = 1e3  # m; what a goal as large as the site is taken to hold


class Site:
    """The site as last seen; arrays are [row, col].

    `height`, `target` and `excess` (soil to take away) [m]; `fill` (soil missing) [m]; `may_lack`, where it is ever
    missing, as in a design only (bool); `solid` bool; `goals`, the connected goal regions as bool masks, and `depth`,
    how far inside its goal each cell lies [m]; `rim`, cells at a step of the target if there are goals (bool); `pose`,
    a dict of physical values (see `dirt_env.task.observation`); `plane`, (z, pitch, roll) of the ground under the
    tracks once that was worked out.
    """

    def __init__(self, config: SceneConfig) -> None:
        self.grid, self.soil, self.blade, self.machine = config.grid, config.soil, config.blade, config.machine
        self.period, self.walled = config.task.period, config.site.border == "wall"
        self.graded = config.action.blade == "grade"
        self.rated = 0.8 * self.blade.width * self.blade.height**2  # m3, SAE J1265
        self._table = pose_table(self.grid, self.blade, self.machine)
        axes = centres(self.grid)
        self.x, self.y = (np.broadcast_to(axis, (self.grid.rows, self.grid.cols)) for axis in axes)
        # Where a scene varies its design may lie elsewhere: then a hole just as deep as the blade is high may be taken
        # for a goal, but not where the scene has none and soil is missing elsewhere.
        known = config.design is not None and config.vary is None
        self._design = rasterize(config.design.region, self.grid, "design.region") if known else None
        self._has_goals = bool(config.goals)
        self.pulls = config.traction is not None  # whether the ground can hold the machine back
        noise = config.observation.noise
        self._estimate = None if noise is None else Estimate(noise, self.grid, self.blade, self.period)
        self.target: np.ndarray | None = None
        self.plane: np.ndarray | None = None

    def forget(self) -> None:
        """Start an episode."""
        self.target = None

    def see(self, observation) -> None:
        """Take in an observation with a map."""
        if "map" not in observation:
            raise ValueError('the observation has no map; allowed: one made with observation={"map": True}')
        self.plane = None
        height, todo = observation["map"][:2]
        pose = read_pose(observation["pose"], self._table)
        if self._estimate is not None:
            self._see_through_noise(height, todo, observation["map"], pose)
            return
        if self.target is None:
            self._survey(height, todo, observation["map"])
        self.height, self.pose = height, pose
        self.fill = np.where(self.goal, 0.0, np.maximum(-todo, 0.0))
        self.may_lack |= self.fill > 0.0
        self.excess = np.where(self.goal, 0.0, np.maximum(todo, 0.0))

    def _see_through_noise(self, height: np.ndarray, todo: np.ndarray, site: np.ndarray, pose: dict) -> None:
        """Take in an observation with noise: what is to do follows from the ground as it most likely is.

        A cell that is measured above its target shows it exactly, as `height - todo`; one that is measured below shows
        less. So the largest that was seen is the target, and within goals, which have none, the ground at first.
        """
        estimate = self._estimate
        if self.target is None:
            self._survey(height, todo, site)
            estimate.begin(height, pose)
            self.height, self.pose = estimate.height, pose
        else:
            self.pose = estimate.update(height, pose, self.x, self.y)
            self.height = estimate.height
            seen = np.where(self.goal, self.target, height - todo)
            self.target = np.where(self.goal & estimate.untouched, self.height, np.maximum(self.target, seen))
        over, doubt = self.height - self.target, estimate.doubt
        self.excess = np.where(self.goal | self.solid | (over < doubt), 0.0, over)
        self.may_lack |= (todo < 0.0) & ~self.goal
        self.fill = np.where(self.may_lack & (over < -doubt), -over, 0.0)

    def _survey(self, height: np.ndarray, todo: np.ndarray, site: np.ndarray) -> None:
        """What stays the same in an episode: target, goals, solid cells, distances to them."""
        self.solid = site[2] > 0.5 if len(site) > 2 else np.zeros(height.shape, bool)
        self.goal = (todo == np.float32(-self.blade.height)) & ~self.solid
        if self._design is not None:
            self.goal &= ~self._design
        elif not self._has_goals and ((todo < 0.0) & ~self.goal).any():
            self.goal[:] = False
        self.may_lack = self._design & ~self.solid if self._design is not None else np.zeros(height.shape, bool)
        self.target = np.where(self.goal, height, height - todo)
        self.goals = list(_parts(self.goal))
        self.depth = np.minimum(distance_inside(self.goal, self.grid.cell), MOST_HEIGHT)
        # Around a design the edge stays as it is: held low there, `pad` took 348 s instead of 241 s.
        self.rim = _steps(self.target, RIM * self.soil.slope * self.grid.cell) & bool(self.goals)
        self.gap = distance_outside(self.solid, self.grid.cell) - 0.5 * self.grid.cell
        self.capacity = [
            float(np.minimum(self.soil.slope * self.depth[goal], MOST_HEIGHT).sum()) * self.grid.cell**2
            for goal in self.goals
        ]

    def room(self) -> np.ndarray:
        """What each goal can still take [m3]: what it holds at repose less what lies in it."""
        area = self.grid.cell**2
        inside = [float((self.height - self.target)[goal].sum()) * area for goal in self.goals]
        return np.array(self.capacity) - inside

    @property
    def extent(self) -> tuple[float, float]:
        """Size of the site to the east and to the north [m]."""
        return self.grid.cols * self.grid.cell, self.grid.rows * self.grid.cell

    @property
    def turning_radius(self) -> float:
        """Of the circle about the pivot that holds blade and tracks [m]."""
        blade, machine = self.blade, self.machine
        return float(max(np.hypot(blade.reach, 0.5 * blade.width), 0.5 * np.hypot(machine.length, machine.width)))

    @property
    def turning_room(self) -> float:
        """Distance from solid ground at which it can turn on the spot, whatever corners the cells have [m]."""
        return self.turning_radius + 0.5 * self.grid.cell

    def blade_at(self) -> tuple[float, float]:
        """Centre of the blade x, y [m]."""
        pose, reach = self.pose, self.blade.reach
        return pose["x"] + reach * cos(pose["heading"]), pose["y"] + reach * sin(pose["heading"])

    def cell_at(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell at a point, or of the nearest one."""
        cell, grid = self.grid.cell, self.grid
        return min(max(int(y // cell), 0), grid.rows - 1), min(max(int(x // cell), 0), grid.cols - 1)


def _steps(surface: np.ndarray, least: float) -> np.ndarray:
    """Cells [row, col] on either side of a face over which a surface [m] rises by more than `least` m."""
    found = np.zeros(surface.shape, bool)
    east, north = np.abs(np.diff(surface, axis=1)) > least, np.abs(np.diff(surface, axis=0)) > least
    found[:, :-1] |= east
    found[:, 1:] |= east
    found[:-1] |= north
    found[1:] |= north
    return found


def _parts(region: np.ndarray):
    """Connected parts (over edges) of a mask, from south to north."""
    rest = region.copy()
    while rest.any():
        part = np.zeros_like(rest)
        part.flat[np.argmax(rest)] = True
        size = 0
        while size != (size := int(part.sum())):
            grown = part.copy()
            grown[1:] |= part[:-1]
            grown[:-1] |= part[1:]
            grown[:, 1:] |= part[:, :-1]
            grown[:, :-1] |= part[:, 1:]
            part = grown & rest
        yield part
        rest &= ~part
