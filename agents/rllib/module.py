"""The network for patch and pose as RLlib's new API stack has it: an RLModule, and its actor in a policy file."""

from itertools import pairwise
from typing import Any

import numpy as np
import torch
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.apis.value_function_api import ValueFunctionAPI
from ray.rllib.core.rl_module.torch.torch_rl_module import TorchRLModule
from torch import nn

from dirt_env.config import SceneConfig
from dirt_env.task.observation import POSE_ENTRIES

from ..layers import arrays_of, convolutions_over, weighted
from ..network import written
from ..settings import Network
from .settings import ClusterSettings, scene_of, variants_of

CLIP = 10.0  # farther out than any entry of the pose: nothing is clipped


class PatchAndPose(TorchRLModule, ValueFunctionAPI):
    """Convolutions over the patch (ReLU), then dense layers with the pose (tanh); `agents/network.py` is its twin.

    Actor and critic share the convolutions and the first dense layer. `model_config`: `network`, the table of that
    name, and `log_std_init`, where the actions' standard deviation begins, which does not depend on what is seen.
    """

    def setup(self) -> None:
        """Layers for the patch's shape and the pose's length."""
        network = Network(**self.model_config["network"])
        patch, pose = (self.observation_space[name].shape for name in ("patch", "pose"))
        self.convolutions, width = convolutions_over(patch, network)
        self.dense = nn.Linear(width + pose[0], network.features)
        sizes = network.features, *network.hidden
        self.actor, self.critic = _layers(sizes), _layers(sizes)
        actions = self.action_space.shape[0]
        self.action, self.value = nn.Linear(sizes[-1], actions), nn.Linear(sizes[-1], 1)
        with torch.no_grad():
            self.action.weight *= 0.01  # at first all actions are near 0: stand, straight, blade at grade
        self.log_std = nn.Parameter(torch.full((actions,), float(self.model_config["log_std_init"])))

    def _forward(self, batch: dict[str, Any], **_: Any) -> dict[str, Any]:
        """Mean and log of the standard deviation of the actions, f4[n, 6]."""
        return self._act(self._features(batch))

    def _forward_train(self, batch: dict[str, Any], **_: Any) -> dict[str, Any]:
        """The same, with the features, so that the values need not compute them anew."""
        features = self._features(batch)
        return {**self._act(features), Columns.EMBEDDINGS: features}

    def compute_values(self, batch: dict[str, Any], embeddings: Any = None) -> torch.Tensor:
        """What the critic expects, f4[n]."""
        features = self._features(batch) if embeddings is None else embeddings
        return self.value(self.critic(features)).squeeze(-1)

    def _features(self, batch: dict[str, Any]) -> torch.Tensor:
        seen = batch[Columns.OBS]
        return torch.tanh(self.dense(torch.cat([self.convolutions(seen["patch"]), seen["pose"]], dim=1)))

    def _act(self, features: torch.Tensor) -> dict[str, torch.Tensor]:
        mean = self.action(self.actor(features))
        return {Columns.ACTION_DIST_INPUTS: torch.cat([mean, self.log_std.expand_as(mean)], dim=1)}


def policy_file(module: PatchAndPose, settings: ClusterSettings, origin: dict[str, Any]) -> bytes:
    """The actor as a policy.npz, which `dirt-push run` and `evaluate` play without torch and ray."""
    hidden = [module.dense, *weighted(module.actor, nn.Linear)]
    arrays = arrays_of(weighted(module.convolutions, nn.Conv2d), hidden, module.action)
    arrays["pose.mean"] = np.zeros(len(POSE_ENTRIES), np.float32)
    arrays["pose.scale"] = np.ones(len(POSE_ENTRIES), np.float32)
    config = scene_of(settings.worlds, variants_of(settings.worlds)[0])
    metadata = {
        "observation": _observation(config),
        "action": {"blade": config.action.blade},
        "strides": list(settings.network.strides),
        "hidden": len(hidden),
        "clip": CLIP,
        "training": {**origin, "settings": settings.to_dict()},
    }
    return written(arrays, metadata)


def _observation(config: SceneConfig) -> dict[str, Any]:
    """The keys of the scene's table `observation` that the network is for."""
    seen = config.observation
    named = {name: getattr(seen, name) for name in ("size", "resolution", "ahead", "height_limit")}
    return {**named, "channels": list(config.channels), "overview": False}


def _layers(sizes: tuple[int, ...]) -> nn.Sequential:
    """Dense layers of those sizes, with tanh after each."""
    pairs = [(nn.Linear(before, after), nn.Tanh()) for before, after in pairwise(sizes)]
    return nn.Sequential(*(layer for pair in pairs for layer in pair))
