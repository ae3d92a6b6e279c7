"""Greedy: of all pushes the one that brings most soil times way per second, done as the adaptive push does it."""

from dirt_env.config import SceneConfig

from .adaptive_push import AdaptivePush
from .pushing.parameters import GreedyParameters
from .pushing.site import Site
from .pushing.worth import Worth, gain_per_second


class Greedy(AdaptivePush):
    """Values a push by volume, way and time instead of by how far its soil is; sees the whole map."""

    worth: Worth = staticmethod(gain_per_second)

    def __init__(
        self, config: SceneConfig, parameters: GreedyParameters | None = None, site: Site | None = None
    ) -> None:
        """For a scene; the numbers are those of `GreedyParameters`, the site is what is observed, unless given."""
        super().__init__(config, parameters or GreedyParameters(), site)


def make(config: SceneConfig) -> Greedy:
    """The behaviour for a scene."""
    return Greedy(config)
