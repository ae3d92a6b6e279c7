"""How good a policy is on selection layouts: what training is watched by, and what its best moment is chosen by."""

from typing import NamedTuple

import gymnasium
import numpy as np

from dirt_env.config import load
from dirt_env.split import layouts

from .network import LearnedPolicy
from .settings import Settings, overrides_of


class Score(NamedTuple):
    """Means over the layouts of a level, as docs/evaluation.md defines them."""

    level: int | None
    share_end: float
    share_area: float
    success: float
    time_s: float
    volume_distance_m4_per_min: float


class Selection:
    """The first `record.layouts` selection layouts of every level of `record.levels`, played in batches."""

    def __init__(self, settings: Settings) -> None:
        """Make the worlds, a batch for each level."""
        record = settings.record
        self._seeds = layouts("selection", record.layouts)
        self._batches = []
        for level in record.levels or (None,):
            overrides = overrides_of(settings, level)
            config = load(settings.worlds.scene, **overrides)
            env = gymnasium.make_vec(
                "dirt_env:DirtPush-v0",
                record.layouts,
                scene=settings.worlds.scene,
                autoreset_mode="SameStep",
                max_episode_steps=config.steps,
                threads=settings.worlds.threads,
                **overrides,
            )
            self._batches.append((level, config.steps, config.task.period, env))

    def score(self, policy: LearnedPolicy) -> list[Score]:
        """Play every layout once; a level each."""
        return [self._play(policy, *batch) for batch in self._batches]

    def close(self) -> None:
        """Let the worlds go."""
        for *_, env in self._batches:
            env.close()

    def _play(
        self, policy: LearnedPolicy, level: int | None, steps: int, period: float, env: gymnasium.vector.VectorEnv
    ) -> Score:
        policy.reset()
        observations, _ = env.reset(seed=list(self._seeds))
        begins = None
        potential = np.array([world.episode.start.potential for world in env.envs])
        count = len(potential)
        over, success = np.zeros(count, bool), np.zeros(count, bool)
        share, area, work, time = np.zeros((4, count))
        for _ in range(steps):
            observations, _, terminated, truncated, infos = env.step(policy.act_all(observations, begins))
            begins = terminated | truncated
            ends = begins & ~over
            plays = ~over & ~ends  # where an episode ends, the batch's infos are of the next one's beginning
            for mask, told in ((plays, infos), (ends, infos.get("final_info"))):
                if mask.any():
                    share[mask] = told["share_in_goal"][mask]
                    work[mask] += told["reward"]["work"][mask]
                    time[mask] = told["time_s"][mask]
            area += share  # an episode that is over counts as it ended
            success |= ends & terminated
            over |= ends
            if over.all():
                break
        area += (steps - round(time.max() / period)) * share
        rate = work * potential / (time / 60.0)
        means = [float(values.mean()) for values in (share, area / steps, success, time, rate)]
        return Score(level, *means)
