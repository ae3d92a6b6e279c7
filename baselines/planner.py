"""Rollout planner: tries candidate pushes out in the simulator and does the one that brings most per second.

It needs the simulator and the scene's configuration: the ground and machine that it sees are rebuilt in a world of
its own, in which each push is driven to its end. That the model is the true one is an advantage that no robot has.
"""

import numpy as np

from dirt_env.config import SceneConfig

from .grade import Grade, squared_error
from .greedy import Earner
from .pushing.choose import Push, choose
from .pushing.drive import wrap
from .pushing.imagine import ImaginedSite
from .pushing.numbers import numbers_for
from .pushing.parameters import Parameters, PassPlannerParameters, PlannerParameters
from .pushing.passes import choose_passes
from .pushing.site import Site
from .pushing.value import Value
from .pushing.worth import Candidates, farthest_first, gain_per_second

ALIKE = 0.2  # rad; passes that begin side by side and differ by less are the same


class Rehearsal:
    """Lets a behaviour drive one push on an imagined site; `is_over` when it would choose the next one."""

    def rehearse(self, push: Push) -> int:
        """Drive the push to its end; returns the control steps it took."""
        self.is_over = False
        self.forget()
        self.begin(push)
        limit = round(self.parameters.trial / self.site.period)
        for step in range(limit):
            action = self.decide()
            if self.is_over:
                return step
            self.site.step(action)
        return limit

    def _select(self):
        """Stop here."""
        self.is_over = True
        return 0.0, 0.0, self.site.machine.lift


class PushRehearsal(Rehearsal, Earner):
    """Drives a push as the greedy behaviour does."""


class PassRehearsal(Rehearsal, Grade):
    """Drives a pass as grading does."""


class Trying:
    """Lets a behaviour choose by what its `_rehearsal` of each of its `_candidates` brings in a second."""

    def _choose(self) -> list[Push]:
        """The candidates, tried out, the best first."""
        found = self._candidates()
        if len(found) < 2:
            return found
        left = self._measure()
        return sorted(found, key=lambda push: self._gain_per_second(push, left), reverse=True)

    def _gain_per_second(self, push: Push, left) -> float:
        """What the push takes off what is `left` on a site, by the seconds until the next one can be chosen."""
        copy = self._rehearsal.site
        copy.copy(self.site)
        before = left(copy)
        steps = self._rehearsal.rehearse(push)
        return (before - left(copy)) / (max(steps, 1) * self.site.period)


class Planner(Trying, Earner):
    """Greedy by simulated outcome instead of by estimate; sees the whole map, and knows the true model."""

    def __init__(self, config: SceneConfig, parameters: PlannerParameters | None = None) -> None:
        """For a scene; ValueError if its terrain is no height field, of which a map shows everything."""
        parameters = parameters or numbers_for(PlannerParameters, config)
        self._for_the_tail = numbers_for(Parameters, config)
        self._rehearsal = PushRehearsal(config, parameters, ImaginedSite(config))
        super().__init__(config, parameters)

    def _candidates(self) -> list[Push]:
        """The best pushes by both measures."""
        found: list[Push] = []
        for worth in (gain_per_second, self._farthest_first):
            pushes = choose(self.site, self.parameters, self._failed, worth, round(self.parameters.tries))
            found += [push for push in pushes if push not in found]
        return found

    def _measure(self):
        """Volume times way [m3 m], a function of a site."""
        return Value(self.site).left

    def _farthest_first(self, site: Site, numbers: PlannerParameters, found: Candidates) -> np.ndarray:
        """Worth [n] by the measure and the numbers of the adaptive push, which takes the far end of the soil first."""
        return farthest_first(site, self._for_the_tail, found)


class PassPlanner(Trying, Grade):
    """The same for passes over a design surface; for scenes without a goal region."""

    def __init__(self, config: SceneConfig, parameters: PassPlannerParameters | None = None) -> None:
        """For a scene; ValueError if it has no design, or its terrain is no height field."""
        parameters = parameters or numbers_for(PassPlannerParameters, config)
        self._rehearsal = PassRehearsal(config, parameters, ImaginedSite(config))
        super().__init__(config, parameters)

    def _candidates(self) -> list[Push]:
        """The best passes of which no two begin side by side in the same direction."""
        found: list[Push] = []
        for one in choose_passes(self.site, self.parameters, self._failed, most=1000):
            if len(found) < self.parameters.tries and not any(self._alike(one, other) for other in found):
                found.append(one)
        return found

    def _alike(self, one: Push, other: Push) -> bool:
        near = max(abs(a - b) for a, b in zip(one.first, other.first, strict=True)) < 0.5 * self.site.blade.width
        return near and abs(wrap(one.heading - other.heading)) < ALIKE

    def _measure(self):
        """The squared error [m4], a function of a site."""
        return squared_error


def make(config: SceneConfig, numbers: str | None = None) -> Planner | PassPlanner:
    """The behaviour for a scene: passes where only a design surface is asked for, else pushes.

    With the numbers of a TOML file if one is given, of the kind that the scene needs.
    """
    if config.design is not None and not config.goals and config.layout is None:
        return PassPlanner(config, numbers_for(PassPlannerParameters, config, numbers))
    return Planner(config, numbers_for(PlannerParameters, config, numbers))
