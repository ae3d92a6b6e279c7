"""What the actor and the critic see: convolutions over the small patch; the pose and the overview beside them."""

import math

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn
from torch.nn import functional

from .layers import QuickTanh, append_roots, convolutions_over, root_overview
from .settings import OVERVIEW_GAIN, Network


class PatchPoseOverview(BaseFeaturesExtractor):
    """`network.features` numbers of `patch`, `pose` and, if there is one, `overview`; `agents/network.py` is its twin.

    The patch goes in as it is, in metres: heights over the ground under the machine, of the order of the blade's 1 m.
    The overview's shares are small numbers, and are multiplied by OVERVIEW_GAIN. `roots` are the channels of the patch
    whose square roots are seen too, and if there are any, the overview's soil as `root_overview` has it.
    """

    def __init__(self, observation_space: spaces.Dict, network: Network, roots: tuple[int, ...]) -> None:
        """Layers for the shapes of what is observed."""
        super().__init__(observation_space, network.features)
        self.roots = roots
        channels, *pixels = observation_space["patch"].shape
        patch = (channels + len(roots), *pixels)
        beside = [space for name, space in observation_space.spaces.items() if name != "patch"]
        self.convolutions, width = convolutions_over(patch, network)
        self.dense = nn.Linear(width + sum(math.prod(space.shape) for space in beside), network.features)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """f4[n, features]."""
        patch, overview = observations["patch"], observations.get("overview")
        if self.roots:
            patch = append_roots(patch, self.roots)
            overview = None if overview is None else root_overview(overview)
        if torch.is_grad_enabled():
            patch = patch.contiguous(memory_format=torch.channels_last)  # quicker backward, slower forward
        seen = self.convolutions(patch)
        beside = observations["pose"]
        if overview is not None:
            beside = torch.cat([beside, OVERVIEW_GAIN * overview.flatten(1)], dim=1)
        of_patch, of_rest = self.dense.weight.split([seen.shape[1], beside.shape[1]], dim=1)
        rest = functional.linear(beside, of_rest, self.dense.bias)  # by itself: what is observed needs no gradient
        return QuickTanh.apply(torch.addmm(rest, seen, of_patch.T))
