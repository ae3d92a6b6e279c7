"""What the networks of stable-baselines3 and of RLlib share: the convolutions, and an actor's weights as arrays."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import nn

from .settings import LEAST_LEFT, ROOT_GAIN, Network

TINY = 1e-36  # its root is finite, and nothing observed is smaller but 0


def convolutions_over(patch: tuple[int, ...], network: Network) -> tuple[nn.Sequential, int]:
    """The convolutions (ReLU after each) over a patch of that shape [channels, rows, cols], flattened; their width."""
    channels, layers = pairwise((patch[0], *network.filters)), []
    for (before, after), kernel, stride in zip(channels, network.kernels, network.strides, strict=True):
        layers += [nn.Conv2d(before, after, kernel, stride), nn.ReLU()]
    layers.insert(-1, nn.Flatten())  # before the last ReLU, whose gradient is slow where images lie channels last
    convolutions = nn.Sequential(*layers)
    with torch.no_grad():
        return convolutions, convolutions(torch.zeros(1, *patch)).shape[1]


def append_roots(patch: torch.Tensor, channels: Sequence[int]) -> torch.Tensor:
    """As `append_roots` of agents/network.py."""
    depths = patch[:, list(channels)]
    return torch.cat([patch, _root(depths)], dim=1)


def root_overview(overview: torch.Tensor) -> torch.Tensor:
    """As `root_overview` of agents/network.py."""
    soil = overview[:, :1].clamp(min=0.0)
    left = soil.sum(dim=(2, 3), keepdim=True).clamp(min=LEAST_LEFT)
    return torch.cat([ROOT_GAIN * _root(soil / left), overview[:, 1:]], dim=1)


def _root(values: torch.Tensor) -> torch.Tensor:
    """sign(v) sqrt(|v|), five times as quick as torch's square root on a CPU."""
    return values * values.abs().clamp_(min=TINY).rsqrt_()


class QuickTanh(torch.autograd.Function):
    """tanh(x) = 2 sigmoid(2 x) - 1, four times as quick as torch's own on a CPU."""

    @staticmethod
    def forward(context: Any, values: torch.Tensor) -> torch.Tensor:
        """To rounding of 1."""
        result = (values + values).sigmoid_().mul_(2.0).sub_(1.0)
        context.save_for_backward(result)
        return result

    @staticmethod
    def backward(context: Any, gradient: torch.Tensor) -> torch.Tensor:
        """(1 - tanh(x)**2) times what comes."""
        (result,) = context.saved_tensors
        return torch.ops.aten.tanh_backward(gradient, result)


class Tanh(nn.Module):
    """The layer of it."""

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        """As large as `values`."""
        return QuickTanh.apply(values)


def weighted(layers: nn.Module, kind: type[nn.Module]) -> list[nn.Module]:
    """The layers of a kind, Conv2d or Linear, in their order."""
    return [layer for layer in layers if isinstance(layer, kind)]


def arrays_of(convolutions: list[nn.Conv2d], hidden: list[nn.Linear], action: nn.Linear) -> dict[str, np.ndarray]:
    """Weights and biases of an actor, f4 by the names that `agents/network.py` reads."""
    named = {
        **{f"conv{i}": layer for i, layer in enumerate(convolutions)},
        **{f"hidden{i}": layer for i, layer in enumerate(hidden)},
        "action": action,
    }
    return {
        f"{name}.{part}": getattr(layer, part).detach().cpu().numpy().astype(np.float32)
        for name, layer in named.items()
        for part in ("weight", "bias")
    }
