"""Greedy: of all pushes the one that brings most soil times way per second, done as the adaptive push does it."""

from dirt_env.config import SceneConfig

from .adaptive_push import AdaptivePush
from .pushing.choose import Push, choose
from .pushing.numbers import numbers_for
from .pushing.parameters import Earning, GreedyParameters, Parameters, Pushing
from .pushing.site import Site
from .pushing.worth import Worth, farthest_first, gain_per_second


class Earner(AdaptivePush):
    """Values a push by volume, way and time instead of by how far its soil is; sees the whole map."""

    worth: Worth = staticmethod(gain_per_second)

    def __init__(self, config: SceneConfig, parameters: Earning, site: Site | None = None) -> None:
        """For a scene; the site is what is observed, unless another one is given."""
        super().__init__(config, parameters, site)


class Greedy(Earner):
    """Does so until little is left, and then goes on as the adaptive push: the tail is what greed is bad at."""

    def __init__(
        self, config: SceneConfig, parameters: GreedyParameters | None = None, site: Site | None = None
    ) -> None:
        """For a scene; the numbers are the shipped ones, the site is what is observed, unless others are given."""
        self._for_the_tail = numbers_for(Parameters, config)
        super().__init__(config, parameters or numbers_for(GreedyParameters, config), site)

    def forget(self) -> None:
        """Know of nothing that was done so far."""
        super().forget()
        self._finishes = False

    @property
    def numbers(self) -> Pushing:
        """Its own numbers, or in the end those of the adaptive push."""
        return self._for_the_tail if self._finishes else self.parameters

    def _choose(self) -> list[Push]:
        """Pushes worth beginning, the best one first, by the measure of this part of the job."""
        site = self.site
        left = float(site.excess.sum()) * site.grid.cell**2
        self._finishes = left < self.parameters.finish * site.rated
        return choose(site, self.numbers, self._failed, farthest_first if self._finishes else self.worth)


def make(config: SceneConfig, numbers: str | None = None) -> Greedy:
    """The behaviour for a scene, with the numbers of a TOML file if one is given."""
    return Greedy(config, numbers_for(GreedyParameters, config, numbers))
