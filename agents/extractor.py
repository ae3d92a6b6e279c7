"""What the actor and the critic see of an observation: convolutions over the small patch, the pose beside them."""

from itertools import pairwise

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from .settings import Network


class PatchAndPose(BaseFeaturesExtractor):
    """`network.features` numbers of a `patch` and a `pose`; `agents/network.py` is its twin in numpy.

    The patch goes in as it is, in metres: heights over the ground under the machine, of the order of the blade's 1 m.
    """

    def __init__(self, observation_space: spaces.Dict, network: Network) -> None:
        """Layers for the patch's shape and the pose's length."""
        super().__init__(observation_space, network.features)
        patch, pose = observation_space["patch"].shape, observation_space["pose"].shape
        channels, layers = pairwise((patch[0], *network.filters)), []
        for (before, after), kernel, stride in zip(channels, network.kernels, network.strides, strict=True):
            layers += [nn.Conv2d(before, after, kernel, stride), nn.ReLU()]
        self.convolutions = nn.Sequential(*layers, nn.Flatten())
        with torch.no_grad():
            width = self.convolutions(torch.zeros(1, *patch)).shape[1]
        self.dense = nn.Linear(width + pose[0], network.features)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """f4[n, features]."""
        seen = self.convolutions(observations["patch"])
        return torch.tanh(self.dense(torch.cat([seen, observations["pose"]], dim=1)))
