"""Slot dozing: pass after pass in the same lane, whose windrows are left standing and hold the load together."""

from math import cos, sin

from dirt_env.config import SceneConfig

from .adaptive_push import AdaptivePush
from .pushing.choose import Push
from .pushing.numbers import numbers_for
from .pushing.parameters import SlotParameters
from .pushing.site import Site
from .pushing.slots import Slot, lay_slots, loads_in, next_pass


class SlotDozing(AdaptivePush):
    """Empties one lane after another from its front to its rear, then pushes what is left; sees the whole map.

    For scenes with a goal region. What lies outside of the lanes, windrows above all, is pushed as the adaptive push
    does it, once the lanes are empty.
    """

    def __init__(self, config: SceneConfig, parameters: SlotParameters | None = None, site: Site | None = None) -> None:
        """For a scene; raises ValueError for one without a goal."""
        if config.layout is None and not config.goals:
            raise ValueError(f"the scene {config.name} has no goal; allowed for slot: scenes with a goal region")
        super().__init__(config, parameters or numbers_for(SlotParameters, config), site)

    def forget(self) -> None:
        """Know of nothing that was done so far."""
        super().forget()
        self._slots: list[Slot] | None = None
        self._in: Slot | None = None  # where the last pass was

    def _choose(self) -> list[Push]:
        """The next pass in the lane that is being emptied, or in the fullest one; else whatever push is best."""
        site, numbers = self.site, self.numbers
        if self._slots is None:
            self._slots = lay_slots(site, numbers)
        if self._in is None or loads_in(site, self._in) < numbers.least_load or self._failed:
            left = [slot for slot in self._slots if slot is not self._in or not self._failed]
            self._in = max(left, key=lambda slot: loads_in(site, slot), default=None)
        if self._in is not None and loads_in(site, self._in) >= numbers.least_load:
            found = next_pass(site, numbers, self._in)
            if found is not None:
                return [found]
        self._slots, self._in = [], None
        return super()._choose()

    def _lure(self, x: float, y: float) -> float:
        """A pass keeps to its lane."""
        return super()._lure(x, y) if self._in is None else 0.0

    def _is_over(self, x: float, y: float) -> bool:
        """A pass goes on into the goal, whatever it loses: the next one finds it in the lane."""
        if self._in is None:
            return super()._is_over(x, y)
        site, aim, heading = self.site, self.push.aim, self.push.heading
        return bool(site.depth[site.cell_at(x, y)] >= self.numbers.enter) or (
            (aim[0] - x) * cos(heading) + (aim[1] - y) * sin(heading) <= 0.0
        )


def make(config: SceneConfig, numbers: str | None = None) -> SlotDozing:
    """The behaviour for a scene, with the numbers of a TOML file if one is given."""
    return SlotDozing(config, numbers_for(SlotParameters, config, numbers))
