"""One episode: a world, the job in it, and what has been done so far. Everything of `DirtPush-v0` but the API."""

from typing import Any, NamedTuple, Self

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.scene.layout import Layout
from dirt_env.task.actions import decode
from dirt_env.task.goal import Gauge, Remaining
from dirt_env.task.job import Job, make_job
from dirt_env.task.reward import reward_terms, scale_of
from dirt_env.terrain import (
    AnyWorld,
    Stepper,
    begin_world,
    check_ranges,
    tree_of_world,
    world_form,
    world_of_tree,
)


class Totals(NamedTuple):
    """What has been done since the start: control steps, work [J], distance [m], soil lost over the border [m3]."""

    steps: int = 0
    work: float = 0.0
    distance: float = 0.0
    lost: float = 0.0


class Episode:
    """A world and its job, from the start to the end; `act` is one control step."""

    def __init__(
        self, config: SceneConfig, layout: Layout, world: AnyWorld, job: Job, start: Remaining, totals: Totals
    ) -> None:
        """Take up a world as it is; see `begin` for a new one and `from_tree` for a kept one."""
        self.layout, self.world, self.job, self.start, self.totals = layout, world, job, start, totals
        self._config = config
        self._advance = Stepper(config)
        self._gauge = Gauge(job, config.grid.cell)
        self.remaining = self._gauge.measure(world.height)
        self.finished = self._is_finished()
        self._scale = scale_of(start, config.soil, job.soil, config.task.period, config.task.time)

    @classmethod
    def begin(cls, config: SceneConfig, layout: Layout) -> Self:
        """Start of an episode: ground settled, machine in its place. Raises ValueError where it cannot stand there."""
        grid, blade = config.grid, config.blade
        world = begin_world(config, layout)
        if config.has_walls and layout.solid is None:  # the channel has to be there all the same
            layout = layout._replace(solid=np.zeros(layout.goal.shape, bool))
        limit = config.observation.height_limit
        job = make_job(world.height, layout, grid.cell, min(blade.height, limit), limit)
        start = Gauge(job, grid.cell).measure(world.height)
        world.changed[:] = 0
        return cls(config, layout, world, job, start, Totals())

    @property
    def share(self) -> float:
        """Share of the soil that has come to where it belongs."""
        return self.remaining.moved / self.job.soil if self.job.soil > 0.0 else 0.0

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self.totals.steps * self._config.task.period

    def _is_finished(self) -> bool:
        """Whether the job is done: the design surface within its tolerance, or enough of the soil in the goal."""
        if self._config.design is not None:
            return self.remaining.grade_error <= self._config.design.tolerance
        return self.share >= self._config.task.success

    def act(self, action: Any) -> dict[str, float]:
        """One control step; returns the reward's terms. Raises ValueError, and does nothing, if the action is bad."""
        world, period = self.world, self._config.task.period
        before, was_finished = self.remaining, self.finished
        self._advance(world, decode(action, self._config.machine), period)
        self.remaining = after = self._gauge.measure(world.height, world.changed)
        self.finished = finished = self._is_finished()
        world.changed[:] = 0
        distance, work, _, lost, *_ = world.tally.item()
        steps, total_work, total_distance, total_lost = self.totals
        self.totals = Totals(steps + 1, total_work + work, total_distance + distance, total_lost + lost)
        return reward_terms(before, after, work, lost, finished and not was_finished, self._scale)

    def info(self) -> dict[str, Any]:
        """What has been done so far, and what the last step was like; plain numbers."""
        totals, remaining = self.totals, self.remaining
        distance, work, *_ = tally = self.world.tally.item()
        return {
            "share_in_goal": self.share,
            "volume_moved_m3": remaining.moved,
            "misplaced_m3": remaining.misplaced,
            "spilled_m3": max(0.0, remaining.stray - self.start.stray) + totals.lost,
            "lost_m3": totals.lost,
            "grade_error_m": remaining.grade_error,
            "work_kj": 1e-3 * totals.work,
            "distance_m": totals.distance,
            "time_s": self.time,
            "load_m3": self.world.machine.item()[-1],
            "draft_kn": 1e-3 * work / distance if distance > 0.0 else 0.0,
            "blocked": tally[5],
            "is_success": self.finished,
        }

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
        world = world_of_tree(config, tree["world"])
        check_ranges(config, world, layout)
        return cls(config, layout, world, Job(**tree["job"]), Remaining(**tree["start"]), Totals(**tree["totals"]))


def tree_form(config: SceneConfig) -> dict[str, Any]:
    """What `Episode.to_tree` gives in a scene, as a form for `dirt_env.snapshot.check`."""
    shape = config.grid.rows, config.grid.cols
    ground, mask, f4 = np.empty(shape), np.empty(shape, bool), np.empty(shape, np.float32)
    solid = mask if config.has_walls else None
    layout = Layout(ground, ground, mask, mask, (None, mask), solid, [float] * 3, float, float)
    job = Job(f4, f4, f4, mask.astype(np.uint8), np.empty((0, 2)), *[float] * 6)
    return {
        "layout": layout._asdict(),
        "world": world_form(config),
        "job": job._asdict(),
        "start": dict.fromkeys(Remaining._fields, float),
        "totals": {**dict.fromkeys(Totals._fields, float), "steps": int},
    }
