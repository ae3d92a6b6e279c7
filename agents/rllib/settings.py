"""The settings of a run on a cluster: read from a TOML file, checked key by key, and written back as plain data."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from dirt_env.config import SceneConfig, load
from dirt_env.config.rules import Number, Table, Text, known_keys

from ..consistency import check_network
from ..hyperparameters import FROM_ONE, POSITIVE, PPO
from ..loading import read_file, settings_file
from ..settings import TRAINING, Network, SceneKeys, SceneName, Whole

NOT_NEGATIVE = Number(0)
FROM_ZERO = Number(0, whole=True)


@dataclass(frozen=True)
class Worlds:
    """`count` worlds of a scene in every env runner, at these `levels` in turn, with keys of the scene `set` anew."""

    count: int = 64
    scene: str = "heap"
    levels: tuple[int, ...] = ()
    set: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Cluster:
    """Env runners and learners of `cpus` and `gpus` each, placed by Ray; with none, the driver does it itself."""

    runners: int = 2
    cpus: float = 1.0
    learners: int = 0
    gpus: float = 0.0


@dataclass(frozen=True)
class Ppo:
    """Hyperparameters of PPO, under the names that `agents/hyperparameters.py` has; `kl_coef` is RLlib's penalty."""

    n_steps: int = 32
    batch_size: int = 2048
    n_epochs: int = 4
    learning_rate: float = 5e-4
    final_rate: float = 0.1
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5
    kl_coef: float = 0.0
    log_std_init: float = -0.3


@dataclass(frozen=True)
class ClusterSettings:
    """One run. Made by `load_cluster_settings`, which checks it."""

    name: str = "training"
    description: str = ""
    steps: int = 10_000_000
    seed: int = 0
    save_every: int = 20
    worlds: Worlds = Worlds()
    cluster: Cluster = Cluster()
    network: Network = field(default_factory=Network)
    ppo: Ppo = Ppo()

    @property
    def rollout(self) -> int:
        """Steps of the environment from one update to the next, of all runners together."""
        return max(self.cluster.runners, 1) * self.worlds.count * self.ppo.n_steps

    def to_dict(self) -> dict[str, Any]:
        """Plain data (numbers, texts, lists, dicts), as a file has it."""
        return {"name": self.name, **CLUSTER.write(self)}


SHARED = [name for name in Ppo.__dataclass_fields__ if name != "kl_coef"]  # with the other training script
CLUSTER = Table(
    ClusterSettings,
    {
        "description": Text(),
        "steps": FROM_ONE,
        "seed": FROM_ZERO,
        "save_every": FROM_ONE,
        "worlds": Table(
            Worlds, {"count": FROM_ONE, "scene": SceneName(), "levels": Whole(FROM_ZERO, 0), "set": SceneKeys()}
        ),
        "cluster": Table(
            Cluster, {"runners": FROM_ZERO, "cpus": POSITIVE, "learners": FROM_ZERO, "gpus": NOT_NEGATIVE}
        ),
        "network": TRAINING.rules["network"],
        "ppo": Table(Ppo, {**{name: PPO.rules[name] for name in SHARED}, "kl_coef": NOT_NEGATIVE}),
    },
)


def load_cluster_settings(path: Path, overrides: Mapping[str, Any]) -> ClusterSettings:
    """The checked settings of a file, or of a shipped one by its name, with `overrides` merged over it.

    Raises ValueError that names the key, its value and what is allowed.
    """
    path = settings_file(path, "rllib")
    written = read_file(path, overrides)
    known_keys(written, "", CLUSTER.rules)
    settings = replace(CLUSTER.read(written, "", path.parent), name=path.stem)
    batch, rollout = settings.ppo.batch_size, settings.rollout
    if batch > rollout:
        raise ValueError(
            f"ppo.batch_size is {batch}; allowed: at most cluster.runners x worlds.count x ppo.n_steps = {rollout}"
        )
    if settings.network.roots:
        raise ValueError("network.roots is True; allowed: False, which is what this network can do")
    for variant in variants_of(settings.worlds):
        config = scene_of(settings.worlds, variant)
        if config.observation.overview or config.observation.map:
            raise ValueError("worlds.set.observation has overview or map True; allowed: patch and pose")
        check_network(settings.network, config.observation.size)
    return settings


def variants_of(worlds: Worlds) -> list[dict[str, Any]]:
    """What differs between the worlds of a runner, in turn."""
    return [{"level": level} for level in worlds.levels] or [{}]


def scene_of(worlds: Worlds, variant: Mapping[str, Any]) -> SceneConfig:
    """The scene of the worlds of a variant; ValueError if it cannot be."""
    return load(worlds.scene, **worlds.set, **variant)
