"""Grading: back and forth over a design surface, in the lanes that bring most of the error down per second."""

from math import cos, hypot, sin

from dirt_env.config import SceneConfig

from .adaptive_push import AdaptivePush
from .pushing.choose import Push
from .pushing.edge import edge_behind
from .pushing.numbers import numbers_for
from .pushing.parameters import GradeParameters
from .pushing.passes import choose_passes
from .pushing.site import Site


class Grade(AdaptivePush):
    """Cuts what is too high, drops it into what is too low, and drags the blade back over it; sees the whole map.

    For scenes with a design surface and no goal region.
    """

    def __init__(
        self, config: SceneConfig, parameters: GradeParameters | None = None, site: Site | None = None
    ) -> None:
        """For a scene; raises ValueError for one without a design surface."""
        if config.design is None:
            raise ValueError(f"the scene {config.name} has no design; allowed for grade: scenes with a design surface")
        super().__init__(config, parameters or numbers_for(GradeParameters, config), site)

    def _choose(self) -> list[Push]:
        """Passes worth beginning, the best one first."""
        return choose_passes(self.site, self.numbers, self._failed)

    def _potential(self) -> float:
        """What is left of the error [m4]; what a pass brings is its fall."""
        return squared_error(self.site)

    def _lure(self, x: float, y: float) -> float:
        """A pass keeps to its lane."""
        return 0.0

    def _is_over(self, x: float, y: float) -> bool:
        """Whether the blade has come to the end of its lane."""
        aim, heading = self.push.aim, self.push.heading
        return len(self._way) == 1 and (aim[0] - x) * cos(heading) + (aim[1] - y) * sin(heading) <= 0.0

    def _retreat(self):
        """After a finishing pass back along the lane, the blade dragged at the height of the design; else lifted."""
        site, numbers = self.site, self.numbers
        gone = hypot(self._here[0] - self._start[0], self._here[1] - self._start[1])
        lane = hypot(self.push.aim[0] - self.push.first[0], self.push.aim[1] - self.push.first[1])
        light = self._peak <= numbers.light * site.rated
        if light and gone < min(lane, numbers.back_drag) and self._seconds < numbers.retreat_limit:
            if not self._is_stuck():
                way = numbers.grading_speed * site.machine.speed * site.period
                return 0.0, -numbers.grading_speed, edge_behind(site, numbers, way)
        return super()._retreat()


def squared_error(site: Site) -> float:
    """What is left of the error: its square over the site [m4]."""
    return float((site.excess**2 + site.fill**2).sum()) * site.grid.cell**2


def make(config: SceneConfig, numbers: str | None = None) -> Grade:
    """The behaviour for a scene, with the numbers of a TOML file if one is given."""
    return Grade(config, numbers_for(GradeParameters, config, numbers))
