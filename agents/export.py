"""A trained model's actor as arrays that `agents/network.py` reads."""

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from dirt_env.config import SceneConfig
from dirt_env.task.observation import POSE_ENTRIES


def actor_arrays(policy: Any, normaliser: VecNormalize) -> dict[str, np.ndarray]:
    """Weights of the actor, f4 by name, with the mean and the scale that its pose entries are normalised by."""
    extractor = policy.features_extractor
    convolutions = [layer for layer in extractor.convolutions if isinstance(layer, nn.Conv2d)]
    hidden = [layer for layer in policy.mlp_extractor.policy_net if isinstance(layer, nn.Linear)]
    named = {f"conv{i}": layer for i, layer in enumerate(convolutions)}
    named |= {f"hidden{i}": layer for i, layer in enumerate([extractor.dense, *hidden])}
    named["action"] = policy.action_net
    arrays = {
        f"{name}.{part}": getattr(layer, part).detach().cpu().numpy().astype(np.float32)
        for name, layer in named.items()
        for part in ("weight", "bias")
    }
    mean, scale = np.zeros(len(POSE_ENTRIES)), np.ones(len(POSE_ENTRIES))
    if normaliser.norm_obs:
        running = normaliser.obs_rms["pose"]
        mean, scale = running.mean, np.sqrt(running.var + normaliser.epsilon)
    return {**arrays, "pose.mean": mean.astype(np.float32), "pose.scale": scale.astype(np.float32)}


def actor_metadata(policy: Any, config: SceneConfig, clip: float) -> dict[str, Any]:
    """What the arrays have to be read with: the observation, the strides, the number of hidden layers, the clip."""
    extractor, seen = policy.features_extractor, config.observation
    hidden = 1 + sum(isinstance(layer, nn.Linear) for layer in policy.mlp_extractor.policy_net)
    return {
        "observation": {
            "size": seen.size,
            "resolution": seen.resolution,
            "ahead": seen.ahead,
            "height_limit": seen.height_limit,
            "channels": list(config.channels),
            "overview": seen.overview,
        },
        "action": {"blade": config.action.blade},
        "strides": [layer.stride[0] for layer in extractor.convolutions if isinstance(layer, nn.Conv2d)],
        "hidden": hidden,
        "clip": clip,
    }
