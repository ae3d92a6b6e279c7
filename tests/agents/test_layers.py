"""The layers that both frameworks' networks are built from: their order, their width, and their names as arrays."""

import numpy as np
import pytest

pytest.importorskip("torch")

import torch
from dirt_env.agents import layers, network
from dirt_env.agents.layers import arrays_of, convolutions_over, weighted
from dirt_env.agents.settings import Network
from torch import nn


def test_convolutions_are_those_of_the_settings_and_their_width_is_what_they_give():
    network = Network(filters=(4, 8), kernels=(3, 2), strides=(2, 1))
    convolutions, width = convolutions_over((2, 9, 9), network)
    assert [type(layer) for layer in convolutions] == [nn.Conv2d, nn.ReLU, nn.Conv2d, nn.Flatten, nn.ReLU]
    assert [(layer.out_channels, layer.kernel_size[0], layer.stride[0]) for layer in convolutions[:3:2]] == [
        (4, 3, 2),
        (8, 2, 1),
    ]
    assert convolutions(torch.zeros(5, 2, 9, 9)).shape == (5, width)
    assert width == 8 * 3 * 3


def test_arrays_have_the_names_that_the_network_reads():
    convolutions, width = convolutions_over((2, 8, 8), Network())
    dense, hidden, action = nn.Linear(width, 6), nn.Sequential(nn.Linear(6, 5), nn.Tanh()), nn.Linear(5, 3)
    arrays = arrays_of(weighted(convolutions, nn.Conv2d), [dense, *weighted(hidden, nn.Linear)], action)
    named = {
        "conv0": convolutions[0],
        "conv1": convolutions[2],
        "hidden0": dense,
        "hidden1": hidden[0],
        "action": action,
    }
    assert list(arrays) == [f"{name}.{part}" for name in named for part in ("weight", "bias")]
    assert all((arrays[f"{name}.weight"] == layer.weight.detach().numpy()).all() for name, layer in named.items())


def test_square_roots_are_those_of_numpy():
    generator = np.random.default_rng(0)
    patch = (generator.standard_normal((4, 6, 5, 5)) * [[[[1e-30]]], [[[1e-3]]], [[[1.0]]], [[[1e3]]]]).astype(
        np.float32
    )
    expected = network.append_roots(patch, (1, 3))
    np.testing.assert_allclose(layers.append_roots(torch.from_numpy(patch), (1, 3)).numpy(), expected, rtol=1e-6)
    np.testing.assert_allclose(expected[:, 6:] * np.abs(expected[:, 6:]), patch[:, [1, 3]], rtol=1e-5)
    overview = generator.uniform(-0.1, 1.0, (4, 2, 12, 12)).astype(np.float32)
    overview[1, 0], overview[2, 0] = 0.0, 1e-7
    expected = network.root_overview(overview)
    np.testing.assert_allclose(layers.root_overview(torch.from_numpy(overview)).numpy(), expected, rtol=1e-5)
    assert np.isfinite(expected).all()
    np.testing.assert_allclose((4.0 * expected[[0, 3], 0] ** 2).sum(axis=(1, 2)), 1.0, rtol=1e-5)


def test_quick_tanh_has_the_values_and_the_gradient_of_tanh():
    values = torch.linspace(-30.0, 30.0, 2001, requires_grad=True)
    results = [tanh(values) for tanh in (layers.Tanh(), torch.tanh)]
    torch.testing.assert_close(*results, rtol=0.0, atol=3e-7)
    gradients = [torch.autograd.grad((result * torch.arange(2001.0)).sum(), values)[0] for result in results]
    torch.testing.assert_close(*gradients, rtol=0.0, atol=2e-3)
