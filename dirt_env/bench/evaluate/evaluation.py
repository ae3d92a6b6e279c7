"""An evaluation from the question to the answer: what is to be played, what is left of it, and what came of it."""

import json
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from dirt_env.bench.evaluate import aggregate, pool
from dirt_env.bench.evaluate.episode import LostWorkerError, PolicyFailureError, Trial
from dirt_env.bench.evaluate.journal import RESULT, Journal
from dirt_env.bench.evaluate.origin import code_digest, origin
from dirt_env.bench.evaluate.plots import can_plot, write_plots
from dirt_env.bench.evaluate.suite import Suite
from dirt_env.bench.evaluate.summary import by_key, summarise
from dirt_env.config.data import data_digests
from dirt_env.policy import load_policy
from dirt_env.progress import Progress
from dirt_env.render.atomic import write_atomically
from dirt_env.split import layouts

Play = Callable[[Sequence[Trial]], pool.Records]


class Evaluation:
    """Policies on the held-out layouts of a suite; `play` as often as it takes, then `write`.

    All figures depend on the arguments of the constructor alone: not on how many workers there are, in which order
    episodes are finished, or how often the evaluation was interrupted.
    """

    def __init__(self, policies: Sequence[str], suite: Suite, count: int, split: str = "evaluation") -> None:
        """Check everything: `policies` by name, `count` layouts of each task. Raises ValueError or ImportError."""
        if not policies or len(set(policies)) < len(policies):
            raise ValueError(f"policies are {list(policies)}; allowed: one or more, each once")
        self.policies, self.suite = tuple(policies), suite
        self.split, self.layouts = split, layouts(split, count)
        self.trials = [
            Trial(policy, task, layout) for layout in self.layouts for task in suite.tasks for policy in self.policies
        ]
        for policy in self.policies:
            load_policy(policy, suite.tasks[0].config())
        self.interrupted = False

    def settings(self) -> dict[str, Any]:
        """What all figures depend on, as plain values: a folder with an evaluation of others is refused."""
        found = origin()
        tasks = [{**task.written(), "overrides": None, "config": task.config().to_dict()} for task in self.suite.tasks]
        return {
            "policies": list(self.policies),
            "suite": self.suite.name,
            "tasks": tasks,
            "files": data_digests(tasks),
            "split": self.split,
            "layouts": list(self.layouts),
            "versions": found["versions"],
            "code": code_digest(self.policies),
        }

    def left(self, journal: Journal) -> list[Trial]:
        """Trials of which there is no record yet."""
        done = by_key(journal.records)
        return [trial for trial in self.trials if trial.key not in done]

    def play(self, journal: Journal, play: Play) -> None:
        """Play what is left; Ctrl-C ends it, and what was finished is kept.

        Raises PolicyFailureError, LostWorkerError, or ValueError and ImportError for policies that cannot be made.
        """
        left = self.left(journal)
        if not left:
            return
        done, progress = len(self.trials) - len(left), Progress(len(self.trials))
        try:
            progress.show(done, f"{done} of {len(self.trials)} episodes; the first run compiles the kernels")
            with closing(_closable(play(left))) as records:
                for record in records:
                    journal.add(record)
                    done += 1
                    where = record["job"] if record["level"] is None else f"{record['job']} {record['level']}"
                    progress.show(done, f"{done} of {len(self.trials)} episodes, {record['policy']} in {where}")
        except KeyboardInterrupt:
            self.interrupted = True
        finally:
            progress.clear()

    def result(self, journal: Journal) -> dict[str, Any]:
        """The content of evaluation.json; ValueError while episodes are missing."""
        if left := len(self.left(journal)):
            raise ValueError(f"{left} of {len(self.trials)} episodes are missing; allowed: a finished evaluation")
        tasks = [
            {"job": task.job, "level": task.level, "steps": task.steps or task.config().steps}
            for task in self.suite.tasks
        ]
        return {
            "suite": self.suite.name,
            "description": self.suite.description,
            "split": self.split,
            "layouts": list(self.layouts),
            "tasks": tasks,
            "bootstrap": {"resamples": aggregate.RESAMPLES, "seed": aggregate.SEED, "level": aggregate.LEVEL},
            "code": code_digest(self.policies),
            **origin(),
            **summarise(by_key(journal.records), self.policies, self.suite.tasks, self.layouts),
        }

    def write(self, journal: Journal) -> tuple[dict[str, Any], list[Path]]:
        """Write evaluation.json, and plots where matplotlib is; returns the figures and the files."""
        result, path = self.result(journal), journal.folder / RESULT
        write_atomically(path, (json.dumps(result, indent=1, allow_nan=False) + "\n").encode())
        return result, [path, *(write_plots(result, journal.folder) if can_plot() else [])]


def player(workers: int, ray: str | None) -> Play:
    """What plays trials: this process, `workers` processes, or the machines of a Ray cluster."""
    if ray is not None:
        from dirt_env.bench.evaluate.cluster import check_ray, run_on_ray

        check_ray()
        return lambda trials: run_on_ray(trials, ray)
    if workers == 1:
        return pool.run_here
    return lambda trials: pool.run_in_processes(trials, workers)


def _closable(records: pool.Records) -> Any:
    """A generator of the records, which can be closed."""
    yield from records


FAILURES = (PolicyFailureError, LostWorkerError)
