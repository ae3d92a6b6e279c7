"""A trained model's actor as arrays that `agents/network.py` reads."""

from typing import Any, NamedTuple

import numpy as np
from stable_baselines3.common.vec_env import VecNormalize
from stable_baselines3.sac.policies import SACPolicy
from torch import nn

from dirt_env.config import SceneConfig

from .layers import arrays_of, weighted
from .settings import Worlds


class Actor(NamedTuple):
    """The layers of a model's actor, how its last values become actions (`network.SQUASHES`), and `network.roots`."""

    convolutions: list[nn.Conv2d]
    hidden: list[nn.Linear]
    action: nn.Linear
    squash: str
    roots: bool


def actor_of(policy: Any) -> Actor:
    """The actor of a policy of PPO or SAC."""
    if isinstance(policy, SACPolicy):
        actor = policy.actor
        extractor, dense, action, squash = actor.features_extractor, actor.latent_pi, actor.mu, "tanh"
    else:
        extractor, dense, action = policy.features_extractor, policy.mlp_extractor.policy_net, policy.action_net
        squash = "clip"
    hidden = [extractor.dense, *weighted(dense, nn.Linear)]
    return Actor(weighted(extractor.convolutions, nn.Conv2d), hidden, action, squash, bool(extractor.roots))


def actor_arrays(policy: Any, normaliser: VecNormalize) -> dict[str, np.ndarray]:
    """Weights of the actor, f4 by name, with the mean and the scale that its pose entries are normalised by."""
    actor = actor_of(policy)
    arrays = arrays_of(actor.convolutions, actor.hidden, actor.action)
    entries = normaliser.observation_space["pose"].shape
    mean, scale = np.zeros(entries), np.ones(entries)
    if normaliser.norm_obs:
        running = normaliser.obs_rms["pose"]
        mean, scale = running.mean, np.sqrt(running.var + normaliser.epsilon)
    return {**arrays, "pose.mean": mean.astype(np.float32), "pose.scale": scale.astype(np.float32)}


def actor_metadata(policy: Any, config: SceneConfig, worlds: Worlds, clip: float) -> dict[str, Any]:
    """What the arrays have to be read with: what is observed and how, strides, hidden layers, clip, squash, roots."""
    actor, seen = actor_of(policy), config.observation
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
        "frames": worlds.frames,
        "mirror": worlds.mirror,
        "fineness": worlds.fineness,
        "strides": [layer.stride[0] for layer in actor.convolutions],
        "hidden": len(actor.hidden),
        "clip": clip,
        "squash": actor.squash,
        "roots": actor.roots,
    }
