"""Rollout planner: tries candidate pushes out in the simulator and does the one that brings most per second.

It needs the simulator and the scene's configuration: the ground and machine that it sees are rebuilt in a world of
its own, in which each push is driven to its end. That the model is the true one is an advantage that no robot has.
"""

from dirt_env.config import SceneConfig

from .greedy import Greedy
from .pushing.choose import Push, choose
from .pushing.imagine import ImaginedSite
from .pushing.parameters import GreedyParameters, Parameters
from .pushing.site import Site
from .pushing.value import Value
from .pushing.worth import farthest_first, gain_per_second

TRIES = 12  # pushes tried out at each SELECT, of each of two ways to value them
LIMIT = 240  # control steps of one trial


class Rehearsal(Greedy):
    """Drives one push on an imagined site; `is_over` when it would choose the next one."""

    def rehearse(self, push: Push) -> int:
        """Drive the push to its end; returns the control steps it took."""
        self.is_over = False
        self.forget()
        self.begin(push)
        for step in range(LIMIT):
            action = self.decide()
            if self.is_over:
                return step
            self.site.step(action)
        return LIMIT

    def _select(self):
        """Stop here."""
        self.is_over = True
        return 0.0, 0.0, self.site.machine.lift


class Planner(Greedy):
    """Greedy by simulated outcome instead of by estimate; sees the whole map, and knows the true model."""

    def __init__(self, config: SceneConfig, parameters: GreedyParameters | None = None) -> None:
        """For a scene; ValueError if its terrain is no height field, of which a map shows everything."""
        self._rehearsal = Rehearsal(config, parameters, ImaginedSite(config))
        super().__init__(config, parameters)

    def _choose(self) -> list[Push]:
        """The candidates of both measures, tried out, the best first."""
        found: list[Push] = []
        for worth in (gain_per_second, self._farthest_first):
            pushes = choose(self.site, self.parameters, self._failed, worth, TRIES)
            found += [push for push in pushes if push not in found]
        if len(found) < 2:
            return found
        value = Value(self.site)
        return sorted(found, key=lambda push: self._gain_per_second(push, value), reverse=True)

    def _gain_per_second(self, push: Push, value: Value) -> float:
        """What the push brings, m3 m, by the seconds that it takes until the next one can be chosen."""
        copy = self._rehearsal.site
        copy.copy(self.site)
        steps = self._rehearsal.rehearse(push)
        return (value.left(self.site) - value.left(copy)) / (max(steps, 1) * self.site.period)

    @staticmethod
    def _farthest_first(site: Site, numbers: GreedyParameters, found):
        """Candidates at the far end of the soil, which the paper takes first."""
        return farthest_first(site, Parameters(), found)


def make(config: SceneConfig) -> Planner:
    """The behaviour for a scene."""
    return Planner(config)
