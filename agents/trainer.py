"""A training run from its settings to the policy file: PPO or SAC of stable-baselines3 on the native batch."""

import sys
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.vec_env import VecNormalize

from dirt_env.progress import Progress
from dirt_env.render.atomic import write_atomically

from . import checkpoint
from .algorithms import make_model
from .course import Course
from .export import actor_arrays, actor_metadata
from .hyperparameters import Ppo
from .imitation import imitate, let_learn
from .logbook import LOGS, Logbook
from .network import read, written
from .selection import Selection
from .settings import Settings
from .signals import caught_signals

SPENT = ("seconds", "cpu_seconds")  # wall time and time of the processor, imitation included
CHECKPOINT, LATEST, BEST = "checkpoint.npz", "policy.npz", "best.npz"
OUTPUT = (CHECKPOINT, LATEST, BEST, *LOGS)


def check_device(name: str) -> None:
    """Raise ValueError for a device that is not there."""
    if name == "cuda" and not torch.cuda.is_available():
        raise ValueError('device is "cuda", and torch sees no GPU; allowed: "cpu", or "auto" for one if there is one')


class Trainer:
    """One run in a folder. It goes on from the checkpoint there, and gives the same as if it had never stopped."""

    def __init__(self, settings: Settings, out: Path, fresh: bool = False) -> None:
        """Make worlds and model, or take up the checkpoint; ValueError if that is of other settings, or damaged, or
        missing where the folder holds something else of a run.

        With `fresh`, what the folder holds of a run goes when the new one has something to put there.
        """
        torch.set_num_threads(settings.worlds.threads)
        self.settings, self.out = settings, out
        path = out / CHECKPOINT
        if not fresh and not path.exists() and (left := [name for name in OUTPUT if (out / name).exists()]):
            raise ValueError(
                f"{out} has {', '.join(left)} and no {CHECKPOINT} to go on from; allowed: --fresh to begin anew, which "
                "removes them, or another --out"
            )
        found = checkpoint.read(path) if path.exists() and not fresh else None
        if found is not None:
            checkpoint.agree(found, settings, path)
        self.course = Course(settings, 0 if found is None else found.metadata["stage"])
        normalise, gamma = settings.normalise, settings.learner.gamma
        self.env = VecNormalize(
            self.course,
            norm_obs=normalise.pose,
            norm_obs_keys=["pose"] if normalise.pose else None,
            norm_reward=normalise.returns,
            clip_obs=normalise.clip,
            clip_reward=normalise.clip,
            gamma=gamma,
        )
        self.model = make_model(settings, self.env, self.course.native.envs[0].config)
        self.notes: dict[str, Any] = {
            **dict.fromkeys(SPENT, 0.0),
            "stage_began": 0,
            "evaluated": -1,
            "best": None,
            "scores": [],
        }
        self.resumed = found is not None
        self.other_versions = [] if found is None else found.other_versions()
        if found is None:
            self.model.begin_episodes(self.env)
        else:
            checkpoint.agree_on_scene(found, self.course, path)
            checkpoint.restore(found, self.model, self.env, self.course)
            self.notes = found.metadata["notes"]
        self._selection = Selection(settings)
        self._saved = self._state_of_save() if self.resumed else None

    @property
    def steps(self) -> int:
        """Steps of the environment so far."""
        return self.model.num_timesteps

    @property
    def is_saved(self) -> bool:
        """Whether there is a checkpoint of this run to go on from."""
        return self._saved is not None

    @property
    def is_done(self) -> bool:
        """Whether all steps have been taken; a run ends with a whole rollout."""
        return self.steps >= self.settings.steps

    def run(self) -> int | None:
        """Train to the end; returns None, or the number of the signal that stopped it, after a save.

        ValueError where a teacher fails, and where training diverges.
        """
        progress = Progress(self.settings.steps)
        logbook = self._open_logbook() if self.resumed else None
        with caught_signals() as stopped:
            try:
                begins = not self.resumed and bool(self.settings.teacher.policy)
                if begins and not self._imitate(progress, stopped):
                    return stopped[0]
                if logbook is None:
                    _clear(self.out)
                    self._save()
                    logbook = self._open_logbook()
                while not (self.is_done or stopped):
                    judged = self.notes["evaluated"]
                    self._iterate(logbook)
                    progress.show(self.steps, self._words())
                    if not progress.on and self.notes["evaluated"] != judged:
                        sys.stderr.write(f"train: {self._words()}\n")
                if not stopped and self.notes["evaluated"] < self.steps:
                    self._evaluate(logbook)
                self._save()
            finally:
                progress.clear()
                if logbook is not None:
                    logbook.close()
        return stopped[0] if stopped and self.notes["evaluated"] < self.settings.steps else None

    def close(self) -> None:
        """Let the worlds go."""
        self.env.close()
        self._selection.close()

    def _open_logbook(self) -> Logbook:
        return Logbook(self.out, self.steps, self.settings.algorithm)

    def _imitate(self, progress: Progress, stopped: list[int]) -> bool:
        """Begin from the teacher; False if that was stopped: then the next run begins it anew."""

        def tell(share: float, words: str) -> bool:
            progress.show(share * self.settings.steps, f"imitation: {words}")
            return bool(stopped)

        begun, busy = perf_counter(), process_time()
        if not imitate(self.settings, self.model, self.env, tell):
            return False
        self.model.begin_episodes(self.env)
        wall = perf_counter() - begun
        self.notes |= {"seconds": wall, "cpu_seconds": process_time() - busy}
        return True

    def _iterate(self, logbook: Logbook) -> None:
        """One rollout and update, and what is due after it: log, evaluation, next stage, save."""
        begun, environment, update = perf_counter(), self.course.seconds, self.model.update_seconds
        busy = process_time()
        if self.settings.ppo is not None:
            self._guide(self.settings.ppo)
        try:
            self.model.learn(self.settings.rollout, log_interval=None, reset_num_timesteps=False)
        except ValueError as error:
            if not str(error).startswith("Expected parameter"):  # torch's words for a distribution that is none
                raise
            raise self._diverged() from error
        if not all(torch.isfinite(one).all() for one in self.model.policy.parameters()):
            raise self._diverged()
        wall = perf_counter() - begun
        self.notes["seconds"] += wall
        self.notes["cpu_seconds"] += process_time() - busy
        shares = {
            "environment": (self.course.seconds - environment) / wall,
            "update": (self.model.update_seconds - update) / wall,
        }
        shares |= {"inference": 1.0 - sum(shares.values()), "steps_per_s": self.settings.rollout / wall}
        shares |= {"cpu_seconds": self.notes["cpu_seconds"]}
        ended, self.course.ended = self.course.ended, []
        logged = self.model.logger.name_to_value
        logbook.note(self.steps, self.notes["seconds"], self.course.number, ended, logged, shares)
        record = self.settings.record
        if self._is_due(record.evaluate_every):
            self._evaluate(logbook)
        if self.course.is_passed(self.steps - self.notes["stage_began"]):
            self.notes["stage_began"] = self.steps
            self.course.next_stage()
            self.model.begin_episodes(self.env)
        if self._is_due(record.save_every):
            self._save()

    def _diverged(self) -> ValueError:
        return ValueError(
            f"training diverged after {self.steps:,} steps: the actions are no finite numbers any more; "
            f"allowed: a smaller {self.settings.algorithm}.learning_rate"
        )

    def _guide(self, ppo: Ppo) -> None:
        """Let what is to learn by now learn, and the actions' deviation be what it is to be, unless it is learned."""
        teacher, done = self.settings.teacher, min(self.steps / self.settings.steps, 1.0)
        let_learn(self.model, critic_only=bool(teacher.policy) and self.steps < teacher.critic_steps)
        if ppo.log_std_final is not None:
            deviation = self.model.policy.log_std.requires_grad_(False)
            deviation.fill_(ppo.log_std_init + done * (ppo.log_std_final - ppo.log_std_init))

    def _is_due(self, every: int) -> bool:
        """Whether the last rollout has passed a multiple of so many steps."""
        return self.steps // every > (self.steps - self.settings.rollout) // every

    def _evaluate(self, logbook: Logbook) -> None:
        """Export the policy, play it on selection layouts by numpy, and keep it if it is the best so far."""
        config = self.course.native.envs[0].config
        arrays = actor_arrays(self.model.policy, self.env)
        settings = self.settings
        metadata = actor_metadata(self.model.policy, config, settings.worlds, settings.normalise.clip)
        scores = self._selection.score(read(arrays, metadata))
        logbook.judge(self.steps, self.notes["seconds"], scores)
        self.notes |= {"evaluated": self.steps, "scores": [score._asdict() for score in scores]}
        origin = {"versions": checkpoint.versions(), "seed": self.settings.seed, "steps": self.steps}
        training = {**origin, "settings": self.settings.to_dict(), "selection": self.notes["scores"]}
        content = written(arrays, {**metadata, "training": training})
        write_atomically(self.out / LATEST, content)
        rate = float(np.mean([score.volume_distance_m4_per_min for score in scores]))
        if self.notes["best"] is None or rate > self.notes["best"]:
            self.notes["best"] = rate
            write_atomically(self.out / BEST, content)

    def _save(self) -> None:
        """Write the checkpoint, if there is anything new."""
        if self._state_of_save() != self._saved:
            self._saved = self._state_of_save()
            checkpoint.save(self.out / CHECKPOINT, self.settings, self.model, self.env, self.course, self.notes)

    def _state_of_save(self) -> tuple[int, int]:
        """What tells one save from the next: steps taken, and steps at the last evaluation."""
        return self.steps, self.notes["evaluated"]

    def _words(self) -> str:
        """What the progress bar says."""
        rate = self.steps / max(self.notes["seconds"], 1e-9)
        shares = [f"{score['share_end']:.0%}" for score in self.notes["scores"]]
        judged = f", {' '.join(shares)} in the goal" if shares else ""
        return f"{self.steps:,} steps, {rate:,.0f} a second, stage {self.course.number + 1}{judged}"


def _clear(out: Path) -> None:
    """Remove what a run has written into the folder."""
    for path in [*(out / name for name in OUTPUT), *(out / "tensorboard").glob("events.out.tfevents.*")]:
        path.unlink(missing_ok=True)
