"""What the actor and the critic see: convolutions over the small patch; the pose and the overview beside them."""

import math

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from .layers import convolutions_over
from .settings import OVERVIEW_GAIN, Network


class PatchPoseOverview(BaseFeaturesExtractor):
    """`network.features` numbers of `patch`, `pose` and, if there is one, `overview`; `agents/network.py` is its twin.

    The patch goes in as it is, in metres: heights over the ground under the machine, of the order of the blade's 1 m.
    The overview's shares are small numbers, and are multiplied by OVERVIEW_GAIN.
    """

    def __init__(self, observation_space: spaces.Dict, network: Network) -> None:
        """Layers for the shapes of what is observed."""
        super().__init__(observation_space, network.features)
        patch = observation_space["patch"].shape
        beside = [space for name, space in observation_space.spaces.items() if name != "patch"]
        self.convolutions, width = convolutions_over(patch, network)
        self.dense = nn.Linear(width + sum(math.prod(space.shape) for space in beside), network.features)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """f4[n, features]."""
        seen = [self.convolutions(observations["patch"]), observations["pose"]]
        if "overview" in observations:
            seen.append(OVERVIEW_GAIN * observations["overview"].flatten(1))
        return torch.tanh(self.dense(torch.cat(seen, dim=1)))
