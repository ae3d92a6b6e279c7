"""The paper's adaptive push: farthest soil first, blade and speed follow the load, the aim follows what escapes.

SELECT -> NAVIGATE -> ALIGN -> PUSH -> RETREAT -> SELECT, after Rodriguez, Su and Yu (IROS 2019, sections IV and V).
"""

from enum import Enum, auto
from math import atan2, cos, hypot, pi, sin

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.policy import Observation

from .pushing.body import Body
from .pushing.choose import Push, choose, layer
from .pushing.drive import drive_to, is_quicker_in_reverse, turn_to, wrap
from .pushing.edge import blade_action, edge_for
from .pushing.numbers import numbers_for
from .pushing.parameters import Parameters, Pushing
from .pushing.route import Point, way
from .pushing.site import Site
from .pushing.worth import Worth, farthest_first

FORGIVEN = 3  # failures kept in mind
NOTHING = 0.03  # loads; less ahead of the blade is nothing
PATIENCE, HARDLY = 7, 0.3  # so many steps within so many m and rad are no progress
NEAR, AT = 1.5, 0.8  # m from a way point that count as reached: the pivot on its way, the blade in a push


class State(Enum):
    """What the machine is about."""

    SELECT = auto()
    NAVIGATE = auto()
    ALIGN = auto()
    PUSH = auto()
    RETREAT = auto()
    DONE = auto()


class AdaptivePush:
    """Pushes soil to its goals in passes that adapt to what the blade meets; sees the whole map."""

    sees = "map"
    worth: Worth = staticmethod(farthest_first)

    def __init__(self, config: SceneConfig, parameters: Pushing | None = None, site: Site | None = None) -> None:
        """For a scene; the numbers are the shipped ones, the site is what is observed, unless others are given."""
        self.parameters = parameters or numbers_for(Parameters, config)
        self.site = site or Site(config)
        self._body = Body(self.site)
        self._acts = {
            State.SELECT: self._select,
            State.NAVIGATE: self._navigate,
            State.ALIGN: self._align,
            State.PUSH: self._push,
            State.RETREAT: self._retreat,
            State.DONE: self._rest,
        }
        self.reset()

    @property
    def numbers(self) -> Pushing:
        """The numbers that it goes by just now."""
        return self.parameters

    def reset(self, seed: int | None = None) -> None:
        """Start an episode. Nothing is random, so the seed does not matter."""
        self.site.forget()
        self.forget()

    def forget(self) -> None:
        """Know of nothing that was done so far."""
        self.state = State.SELECT
        self.push: Push | None = None
        self._failed: list[Point] = []
        self._way: list[Point] = []
        self._steps = 0  # in this state
        self._peak = 0.0  # m3; largest load of this push
        self._asked = 0.0  # share of the top speed that the last step of this push asked for
        self._eased = 0.0  # m; how much higher the edge goes for what the ground holds the machine back
        self._start: Point = (0.0, 0.0)  # of the retreat
        self._before = 0.0  # loads times m; the potential when this push began
        self._trail: list[tuple[float, float, float]] = []  # x, y, heading of the last steps in this state

    def act(self, observation: Observation) -> np.ndarray:
        """Action (3,) for an observation with a map."""
        self.site.see(observation)
        return self.decide()

    def decide(self) -> np.ndarray:
        """Action (3,) for the site as it is."""
        action = None
        while action is None:
            action = self._acts[self.state]()
        self._steps += 1
        steering, speed, edge = action
        if self.state is not State.DONE:
            steering, speed = self._body.allowed(steering, speed)
        action = np.array([steering, speed, blade_action(self.site, edge)])
        return np.clip(action, -1.0, 1.0).astype(np.float32)

    def _go(self, state: State) -> None:
        self.state, self._steps, self._trail = state, 0, []

    @property
    def _seconds(self) -> float:
        return self._steps * self.site.period

    @property
    def _carry(self) -> float:
        """Height of the edge over the tracks on the way [m]."""
        return min(self.numbers.carry, self.site.machine.lift)

    @property
    def _here(self) -> Point:
        return self.site.pose["x"], self.site.pose["y"]

    def _select(self):
        """Choose a push and the way to its start."""
        pushes = self._choose()
        if not pushes and self._failed:
            self._failed.clear()
            pushes = self._choose()
        if not pushes:
            return self._go(State.DONE)
        self.begin(pushes[0])
        return None

    def begin(self, push: Push) -> None:
        """Set out for a push."""
        self.push = push
        self._way = self._way_to_start()
        self._found = self.site.excess
        self._layer = layer(self.site, self.push, self.numbers.layer * self.site.rated)
        self._go(State.NAVIGATE)

    def _choose(self) -> list[Push]:
        """Pushes worth beginning, the best one first."""
        return choose(self.site, self.numbers, self._failed, self.worth)

    def _way_to_start(self) -> list[Point]:
        """Round heaps and with room to turn, if there is such a way; else closer to what is solid."""
        site, numbers = self.site, self.numbers
        narrow = site.gap < 0.5 * site.blade.width + numbers.clearance
        wide = (site.gap < site.turning_room) | (site.excess > numbers.mound)
        for shut in (wide, narrow):
            points = way(shut, site.grid.cell, self._here, self.push.approach)
            if points is not None:
                return points
        return [self.push.approach]

    def _navigate(self):
        """Drive to the start of the push with the blade up, forward or in reverse."""
        numbers, heading = self.numbers, self.push.heading
        while self._way and self._is_near(self._way[0], numbers.arrive if len(self._way) == 1 else NEAR):
            self._way.pop(0)
        if not self._way:
            return self._go(State.ALIGN)
        if self._seconds > numbers.navigate_limit or self._is_stuck():
            return self._fail()
        if len(self._way) > 1:
            (x, y), (ahead_x, ahead_y) = self._way[:2]
            heading = atan2(ahead_y - y, ahead_x - x) if len(self._way) > 2 else heading
        reverse = is_quicker_in_reverse(self.site, self._way[0], heading)
        return *drive_to(self.site, self._way[0], reverse), self._carry

    def _align(self):
        """Turn in place to the heading of the push."""
        numbers = self.numbers
        error = abs(wrap(self.push.heading - self.site.pose["heading"]))
        edge, needed = self._edge(0.0)
        ready = error < numbers.align_tolerance and needed < numbers.lowered
        if ready or self._seconds > numbers.align_limit:
            self._peak, self._way, self._before = 0.0, list(self.push.way), self._potential()
            self._asked = self._eased = 0.0
            return self._go(State.PUSH)
        if error >= numbers.align_tolerance and self._would_disturb():
            edge = self._carry
        return turn_to(self.site, self.push.heading), 0.0, edge

    def _would_disturb(self) -> bool:
        """Whether a lowered blade that swings round here meets soil."""
        site, (x, y), radius = self.site, self._here, self.site.turning_room
        around = (site.x - x) ** 2 + (site.y - y) ** 2 < radius**2
        return bool((np.maximum(site.excess, site.fill)[around] > self.numbers.min_height).any())

    def _potential(self) -> float:
        """Soil to move times its way to this push's aim, loads times m; what a push brings is its fall."""
        site, (x, y) = self.site, self.push.aim
        return float((site.excess * np.hypot(site.x - x, site.y - y)).sum()) * site.grid.cell**2 / site.rated

    def _push(self):
        """Push along the way; ends inside the goal, past the aim, when the load is lost, or after a limit."""
        site, numbers = self.site, self.numbers
        x, y = site.blade_at()
        while len(self._way) > 1 and hypot(self._way[0][0] - x, self._way[0][1] - y) < AT:
            self._way.pop(0)
        self._peak = max(self._peak, site.pose["load"])
        if self._seconds > numbers.push_limit or self._is_over(x, y):
            if self._before - self._potential() < numbers.least_gain:
                return self._fail()
            self._start = self._here
            return self._go(State.RETREAT)
        if self._is_stuck() and (not site.pulls or self._eased >= site.machine.lift):
            return self._fail()
        self._ease()
        course = atan2(self._way[0][1] - y, self._way[0][0] - x) + self._lure(x, y)
        step = site.machine.speed * site.period
        _, needed = self._edge(step)
        speed = 1.0 / (1.0 + numbers.slow_load * site.pose["load"] / site.rated)
        speed *= 1.0 - numbers.slow_edge * (1.0 - min(1.0, site.machine.edge_rate * site.period / max(needed, 1e-9)))
        speed *= max(0.0, cos(2.0 * min(abs(wrap(course - site.pose["heading"])), pi / 4)))
        speed = max(speed, numbers.min_speed)
        speed = speed if site.goals else min(speed, numbers.grading_speed)
        self._asked = speed
        return turn_to(site, course), speed, self._edge(speed * step)[0] + self._eased

    def _ease(self) -> None:
        """Raise the edge while the ground holds the machine back, and let it down again when it runs freely."""
        site, numbers = self.site, self.numbers
        if not site.pulls or self._asked == 0.0:
            return
        share = site.pose["speed"] / (self._asked * site.machine.speed)
        if share < numbers.held:
            self._eased += numbers.ease * (1.0 - share / numbers.held)
        else:
            self._eased -= numbers.sink
        self._eased = min(max(self._eased, 0.0), 2.0 * site.machine.lift)

    def _edge(self, way: float) -> tuple[float, float]:
        """Height of the edge over the tracks for the next `way` m, and how far it is from there [m]."""
        site, numbers = self.site, self.numbers
        loads = site.pose["load"] / site.rated
        rise = self._layer + numbers.raise_gain * max(0.0, loads - numbers.full)
        return edge_for(site, numbers, way, rise, self._found)

    def _lure(self, x: float, y: float) -> float:
        """Angle [rad] by which the aim shifts to the soil ahead that escapes to a side."""
        site, numbers = self.site, self.numbers
        aim = self.push.aim
        if hypot(aim[0] - x, aim[1] - y) < numbers.gather_ahead:
            return 0.0
        soil, _, left = self._soil_ahead(x, y, numbers.gather_ahead, site.blade.width)
        volume = soil.sum()
        if volume < NOTHING * site.rated / site.grid.cell**2:
            return 0.0
        return numbers.gather * atan2(float((soil * left).sum() / volume), numbers.gather_ahead)

    def _soil_ahead(self, x: float, y: float, far: float, aside: float):
        """Soil to move [m of a cell], metres ahead and left of it, to `far` ahead of the blade, `aside` to a side."""
        site, heading = self.site, self.site.pose["heading"]
        dx, dy = site.x - x, site.y - y
        ahead, left = dx * cos(heading) + dy * sin(heading), dy * cos(heading) - dx * sin(heading)
        there = (ahead > 0.0) & (ahead < far) & (np.abs(left) < aside) & (site.excess > 0.01)
        return site.excess[there], ahead[there], left[there]

    def _is_over(self, x: float, y: float) -> bool:
        """Whether the push has come to its end."""
        site, numbers, aim = self.site, self.numbers, self.push.aim
        far, heading = hypot(aim[0] - x, aim[1] - y), site.pose["heading"]
        if site.goals and site.depth[site.cell_at(x, y)] >= numbers.enter and far < 2.0 * site.depth.max():
            return True
        if len(self._way) == 1 and (aim[0] - x) * cos(heading) + (aim[1] - y) * sin(heading) <= 0.0:
            return True
        soil, _, _ = self._soil_ahead(x, y, far + 1.0, 0.5 * site.blade.width)
        ahead = soil.sum() * site.grid.cell**2
        if ahead < NOTHING * site.rated and site.pose["load"] < NOTHING * site.rated:
            return True
        lost = site.pose["load"] < (1.0 - numbers.lost_share) * self._peak
        return lost and ahead < (1.0 - numbers.lost_share) * self._peak

    def _retreat(self):
        """Lift and back up, the way it came, until there is room to turn."""
        site, numbers = self.site, self.numbers
        gone = hypot(self._here[0] - self._start[0], self._here[1] - self._start[1])
        free = site.gap[site.cell_at(*self._here)] > site.turning_room
        if (gone >= numbers.retreat and free) or self._seconds > numbers.retreat_limit or self._is_stuck():
            return self._go(State.SELECT)
        return 0.0, -1.0, self._carry

    def _rest(self):
        """Nothing is left to do: stand, and look again now and then."""
        if self._seconds > 5.0:
            self._failed.clear()
            return self._go(State.SELECT)
        return 0.0, 0.0, self.site.machine.lift

    def _fail(self) -> None:
        """Give this push up and keep away from it for a while."""
        self._failed = [*self._failed[1 - FORGIVEN :], self.push.first]
        self._start = self._here
        self._go(State.RETREAT)

    def _is_near(self, point: Point, near: float) -> bool:
        return hypot(point[0] - self._here[0], point[1] - self._here[1]) < near

    def _is_stuck(self) -> bool:
        """Whether the machine has hardly moved for some steps in this state."""
        x, y, heading = self.site.pose["x"], self.site.pose["y"], self.site.pose["heading"]
        self._trail = [*self._trail[1 - PATIENCE :], (x, y, heading)]
        x0, y0, heading_0 = self._trail[0]
        moved = hypot(x - x0, y - y0) + abs(wrap(heading - heading_0))
        return len(self._trail) == PATIENCE and moved < HARDLY


def make(config: SceneConfig, numbers: str | None = None) -> AdaptivePush:
    """The behaviour for a scene, with the numbers of a TOML file if one is given."""
    return AdaptivePush(config, numbers_for(Parameters, config, numbers))
