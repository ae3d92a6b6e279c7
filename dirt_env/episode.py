"""One episode: a world, the job in it, and what has been done so far, as a value that can be kept and taken up."""

from typing import Any, NamedTuple, Self

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.scene.layout import Layout
from dirt_env.sim.bank import Bank, bank_of
from dirt_env.task.batch import Totals
from dirt_env.task.goal import Gauge, Remaining
from dirt_env.task.job import Job, make_job
from dirt_env.terrain import AnyWorld, begin_world, check_ranges, tree_of_world, world_form, world_of_tree


class Episode(NamedTuple):
    """A world and its job: how they began, what has been done, what remains."""

    layout: Layout
    world: AnyWorld
    job: Job
    start: Remaining
    totals: Totals
    remaining: Remaining

    @classmethod
    def begin(cls, config: SceneConfig, layout: Layout) -> Self:
        """Start of an episode: ground settled, machine in its place. Raises ValueError where it cannot stand there."""
        grid, blade = config.grid, config.blade
        world = begin_world(config, layout)
        if config.has_walls and layout.solid is None:  # the channel has to be there all the same
            layout = layout._replace(solid=np.zeros(layout.goal.shape, bool))
        limit = config.observation.height_limit
        job = make_job(world.height, layout, grid.cell, min(blade.height, limit), limit, config.soil.swell)
        start = Gauge(job, grid.cell).measure(world.height, bank=_bank(config, world))
        return cls(layout, world, job, start, Totals(), start)

    def to_tree(self) -> dict[str, Any]:
        """Everything that the future depends on, for `dirt_env.snapshot`."""
        return {
            "layout": self.layout._asdict(),
            "world": tree_of_world(self.world),
            "job": self.job._asdict(),
            "start": self.start._asdict(),
            "totals": self.totals._asdict(),
        }

    @classmethod
    def from_tree(cls, config: SceneConfig, tree: dict[str, Any]) -> Self:
        """The episode that `to_tree` described, of a tree that has the `tree_form`; ValueError where it cannot be."""
        layout = Layout(**{**tree["layout"], "pose": tuple(tree["layout"]["pose"])})
        world, job = world_of_tree(config, tree["world"]), Job(**tree["job"])
        check_ranges(config, world, layout)
        remaining = Gauge(job, config.grid.cell).measure(world.height, bank=_bank(config, world))
        return cls(layout, world, job, Remaining(**tree["start"]), Totals(**tree["totals"]), remaining)


def _bank(config: SceneConfig, world: AnyWorld) -> Bank | None:
    """The undisturbed soil of a world in which soil swells."""
    return bank_of(getattr(world, "bank", None), getattr(world, "natural", None), config.soil.swell)


def tree_form(config: SceneConfig) -> dict[str, Any]:
    """What `Episode.to_tree` gives in a scene, as a form for `dirt_env.snapshot.check`."""
    shape = config.grid.rows, config.grid.cols
    ground, mask, f4 = np.empty(shape), np.empty(shape, bool), np.empty(shape, np.float32)
    solid = mask if config.has_walls else None
    design = None if config.design is None else mask
    zone = mask.astype(np.int8) if config.zones else None
    layout = Layout(ground, ground, mask, mask, design, solid, [float] * 3, float, float, ground, zone)
    job = Job(f4, f4, f4, mask.astype(np.uint8), np.empty((0, 2)), *[float] * 6)
    return {
        "layout": layout._asdict(),
        "world": world_form(config),
        "job": job._asdict(),
        "start": dict.fromkeys(Remaining._fields, float),
        "totals": {**dict.fromkeys(Totals._fields, float), "steps": int},
    }
