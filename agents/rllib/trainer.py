"""A run of RLlib's PPO from its settings to the policy file, on the machines of a Ray cluster."""

import csv
import io
import json
import logging
import os
import shutil
from math import isnan
from pathlib import Path
from time import perf_counter
from typing import Any

import ray
from ray.rllib.algorithms.ppo import PPO, PPOConfig
from ray.rllib.core import DEFAULT_MODULE_ID
from ray.rllib.core.rl_module import RLModuleSpec
from ray.tune.registry import register_env

from dirt_env import __version__
from dirt_env.progress import Progress
from dirt_env.render.atomic import write_atomically

from ..signals import caught_signals
from .module import PatchAndPose, policy_file
from .settings import ClusterSettings
from .worlds import env_config, make_worlds

CHECKPOINT = "checkpoint-{:012d}"
WORLDS = "dirt-push-training"  # RLlib's name for them
POLICY, LOG, SETTINGS = "policy.npz", "training.csv", "settings.json"
MAY_CHANGE = ("steps", "save_every", "cluster", "description")  # between the parts of a run
NOTED = ("share_in_goal", "is_success")  # of the last info of every episode
COLUMNS = ("steps", "seconds", "runners", "return", "length", "share_in_goal", "success", "entropy", "vf_explained_var")
PATIENCE = 600.0  # s for a rollout; on a new machine the kernels are compiled first


class ClusterTrainer:
    """One run in a folder. It goes on from the newest checkpoint there."""

    def __init__(self, settings: ClusterSettings, out: Path, address: str, fresh: bool = False) -> None:
        """Join the cluster at that address ("auto", "local", host:port).

        ValueError if there is none, or if the folder holds a run of other settings. With `fresh`, what it holds of a
        run is removed when all else is ready.
        """
        if not fresh:
            _agree(settings, out / SETTINGS)
        try:
            ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
        except (ConnectionError, ValueError) as error:
            raise ValueError(f"--address is {address!r}: {' '.join(str(error).split())}") from None
        self.settings, self.out = settings, out.absolute()
        self.algorithm: PPO = ppo_config(settings).build_algo()
        if fresh:
            _clear(self.out)
        write_atomically(self.out / SETTINGS, (json.dumps(settings.to_dict(), indent=2) + "\n").encode())
        self.steps = 0
        saved = sorted(self.out.glob("checkpoint-" + "[0-9]" * 12))
        if saved:
            self.algorithm.restore_from_path(str(saved[-1]))
            self.steps = int(saved[-1].name.partition("-")[2])
        self.resumed = bool(saved)
        self.seconds = _cut_log(self.out / LOG, self.steps)  # of the parts of the run before this one

    def run(self) -> int | None:
        """Train to the end; returns None, or the number of the signal that stopped it, after a save."""
        progress, begun, first = Progress(self.settings.steps), perf_counter(), self.steps
        progress.show(self.steps, "starting; the first run compiles the kernels")
        updates = 0
        with caught_signals() as stopped:
            try:
                while self.steps < self.settings.steps and not stopped:
                    row = self._iterate(self.seconds + perf_counter() - begun)
                    updates += 1
                    if updates % self.settings.save_every == 0:
                        self.save()
                    rate = (self.steps - first) / (perf_counter() - begun)
                    share = "-" if row["share_in_goal"] is None else f"{row['share_in_goal']:.0%}"
                    progress.show(self.steps, f"{self.steps:,} steps, {rate:,.0f} a second, {share} in the goal")
                self.save()
            finally:
                progress.clear()
        return stopped[0] if stopped and self.steps < self.settings.steps else None

    def save(self) -> None:
        """Write policy and checkpoint; the older checkpoint goes when the new one is there as a whole."""
        place = self.out / CHECKPOINT.format(self.steps)
        if place.exists():
            return
        part = self.out / f".{place.name}.part"
        shutil.rmtree(part, ignore_errors=True)
        self.algorithm.save_to_path(str(part))
        module = self.algorithm.get_module(DEFAULT_MODULE_ID)
        origin = {"versions": {"ray": ray.__version__, "dirt-push": __version__}, "steps": self.steps}
        write_atomically(self.out / POLICY, policy_file(module, self.settings, origin))
        older = [path for path in self.out.glob("checkpoint-*") if path != place]
        os.replace(part, place)
        for path in older:
            shutil.rmtree(path)

    def close(self) -> None:
        """Stop the runners and leave the cluster."""
        self.algorithm.stop()
        ray.shutdown()

    def _iterate(self, seconds: float) -> dict[str, Any]:
        """One rollout and update, begun after so many seconds; its line in the log, None where nothing is known."""
        result = self.algorithm.train()
        runners, learner = result["env_runners"], result.get("learners", {}).get(DEFAULT_MODULE_ID, {})
        self.steps = int(runners["num_env_steps_sampled_lifetime"])
        found = (
            self.steps,
            round(seconds + result["time_this_iter_s"], 3),
            self.algorithm.env_runner_group.num_healthy_remote_workers(),
            runners.get("episode_return_mean"),
            runners.get("episode_len_mean"),
            *(runners.get(name) for name in NOTED),
            *(learner.get(name) for name in ("entropy", "vf_explained_var")),
        )
        known = (None if value is None or isnan(value) else float(value) for value in found)
        row = dict(zip(COLUMNS, known, strict=True))
        with (self.out / LOG).open("a", newline="") as file:
            csv.DictWriter(file, COLUMNS, lineterminator="\n").writerow(row)
        return row


def _cut_log(path: Path, steps: int) -> float:
    """Begin the log anew with its lines up to so many steps, those of the checkpoint; returns the last's seconds."""
    rows = list(csv.DictReader(path.read_text().splitlines())) if path.exists() else []
    kept = [row for row in rows if float(row["steps"]) <= steps]
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(kept)
    write_atomically(path, text.getvalue().encode())
    return float(kept[-1]["seconds"]) if kept else 0.0


def _clear(out: Path) -> None:
    """Remove what a run has written into the folder."""
    for path in [*out.glob("checkpoint-*"), *out.glob(".checkpoint-*")]:
        shutil.rmtree(path)
    for name in (LOG, POLICY, SETTINGS):
        (out / name).unlink(missing_ok=True)


def _agree(settings: ClusterSettings, path: Path) -> None:
    """Raise ValueError that names what differs, if the folder holds a run of other settings."""
    wanted = json.loads(json.dumps(settings.to_dict()))
    found = json.loads(path.read_text()) if path.exists() else wanted
    differ = [name for name in wanted if name not in MAY_CHANGE and found.get(name) != wanted[name]]
    if differ:
        raise ValueError(
            f"{path.parent} holds a run with other {', '.join(differ)}; allowed: the same, or --fresh, or another --out"
        )


def ppo_config(settings: ClusterSettings) -> PPOConfig:
    """RLlib's configuration of a run, on its new API stack."""
    ppo, cluster = settings.ppo, settings.cluster
    last = ppo.learning_rate * ppo.final_rate
    register_env(WORLDS, make_worlds)
    model = {"network": vars(settings.network), "log_std_init": ppo.log_std_init}
    return (
        PPOConfig()
        .environment(WORLDS, env_config=env_config(settings))
        .env_runners(
            num_env_runners=cluster.runners,
            num_cpus_per_env_runner=cluster.cpus,
            num_envs_per_env_runner=settings.worlds.count,
            gym_env_vectorize_mode="vector_entry_point",  # the native batch
            rollout_fragment_length=ppo.n_steps,
            sample_timeout_s=PATIENCE,
        )
        .learners(num_learners=cluster.learners, num_gpus_per_learner=cluster.gpus)
        .rl_module(rl_module_spec=RLModuleSpec(module_class=PatchAndPose, model_config=model))
        .training(
            train_batch_size_per_learner=settings.rollout // max(cluster.learners, 1),
            minibatch_size=ppo.batch_size // max(cluster.learners, 1),
            num_epochs=ppo.n_epochs,
            lr=[[0, ppo.learning_rate], [settings.steps, last]],
            gamma=ppo.gamma,
            lambda_=ppo.gae_lambda,
            clip_param=ppo.clip_range,
            entropy_coeff=ppo.ent_coef,
            vf_loss_coeff=ppo.vf_coef,
            vf_clip_param=float("inf"),
            grad_clip=ppo.max_grad_norm,
            grad_clip_by="global_norm",
            use_kl_loss=ppo.kl_coef > 0.0,
            kl_coeff=ppo.kl_coef,
        )
        .callbacks(on_episode_end=note_end)
        # A runner whose machine is lost is begun anew elsewhere; until then the others go on.
        .fault_tolerance(restart_failed_env_runners=True)
        .debugging(seed=settings.seed, log_level="ERROR")
    )


def note_end(*, episode: Any, metrics_logger: Any, **_: Any) -> None:
    """Note what share of the soil an episode brought into the goal, and whether the job was done."""
    last = episode.get_infos(-1)
    for name in NOTED:
        metrics_logger.log_value(name, float(last[name]), window=100)
