"""The convolutions are really used: what the patch shows reaches the actions, and gradients reach every layer."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents.extractor import PatchPoseOverview
from dirt_env.agents.settings import LEAST_LEFT, OVERVIEW_GAIN, ROOT_GAIN, Network
from dirt_env.agents.trainer import Trainer
from gymnasium import spaces

from .conftest import smoke


@pytest.fixture
def trainer(tmp_path):
    trainer = Trainer(smoke(network={"filters": [4, 8], "kernels": [3, 2], "strides": [2, 1]}), tmp_path)
    yield trainer
    trainer.close()


def seen(patch):
    return {"patch": torch.as_tensor(patch, dtype=torch.float32), "pose": torch.zeros(len(patch), 15)}


def test_what_the_patch_shows_matters(trainer):
    policy, generator = trainer.model.policy, np.random.default_rng(0)
    patch = generator.standard_normal((1, 2, 8, 8))
    shifted = np.roll(patch, 1, axis=3)
    features = [policy.extract_features(seen(one)) for one in (patch, shifted, np.zeros_like(patch))]
    assert not torch.allclose(features[0], features[1], atol=1e-3)
    assert not torch.allclose(features[0], features[2], atol=1e-3)


def test_gradients_reach_every_convolution(trainer):
    policy = trainer.model.policy
    assert sum(isinstance(layer, torch.nn.Conv2d) for layer in policy.features_extractor.convolutions) == 2
    values, log_prob, _ = policy.evaluate_actions(
        seen(np.random.default_rng(0).standard_normal((32, 2, 8, 8))), torch.ones(32, 3)
    )
    for loss in (values.mean(), log_prob.mean()):  # the critic's and the actor's
        policy.zero_grad()
        loss.backward(retain_graph=True)
        for name, parameter in policy.features_extractor.named_parameters():
            assert parameter.grad.abs().max() > 0.0, name


def test_without_shared_features_actor_and_critic_have_their_own(tmp_path):
    trainer = Trainer(smoke(ppo={"share_features": False}), tmp_path)
    policy, patch = trainer.model.policy, np.random.default_rng(0).standard_normal((32, 2, 8, 8))
    values, log_prob, _ = policy.evaluate_actions(seen(patch), torch.ones(32, 3))
    actor, critic = policy.pi_features_extractor, policy.vf_features_extractor
    for loss, own, other in ((values.mean(), critic, actor), (log_prob.mean(), actor, critic)):
        policy.zero_grad()
        loss.backward()
        for parameter in own.parameters():
            assert parameter.grad.abs().max() > 0.0
        assert all(parameter.grad is None for parameter in other.parameters())
    trainer.close()


def test_an_update_moves_the_convolutions(trainer):
    before = [value.clone() for value in trainer.model.policy.features_extractor.convolutions.parameters()]
    trainer.model.learn(trainer.settings.rollout, reset_num_timesteps=False)
    after = trainer.model.policy.features_extractor.convolutions.parameters()
    assert all(not torch.equal(one, other) for one, other in zip(before, after, strict=True))


def plainly(extractor, observations):
    """What the extractor is to give, in the order in which its documentation says it."""
    patch, pose, overview = (observations[name] for name in ("patch", "pose", "overview"))
    todo = patch[:, 1:2]
    image = torch.cat([patch, todo.sign() * todo.abs().sqrt()], dim=1)
    for layer in extractor.convolutions:
        if isinstance(layer, torch.nn.Conv2d):
            image = torch.relu(layer(image))
    soil = overview[:, :1]
    share = soil / soil.sum(dim=(2, 3), keepdim=True).clamp(min=LEAST_LEFT)
    squares = OVERVIEW_GAIN * torch.cat([ROOT_GAIN * share.sqrt(), overview[:, 1:]], dim=1)
    return torch.tanh(extractor.dense(torch.cat([image.flatten(1), pose, squares.flatten(1)], dim=1)))


def test_features_and_gradients_are_those_of_the_plain_order():
    shapes = {"patch": (2, 12, 12), "pose": (15,), "overview": (2, 12, 12)}
    space = spaces.Dict({name: spaces.Box(-1.0, 1.0, shape) for name, shape in shapes.items()})
    torch.manual_seed(0)
    extractor = PatchPoseOverview(space, Network(filters=(4, 8), kernels=(4, 3), strides=(2, 2), features=7), (1,))
    observations = {name: torch.rand(5, *shape) for name, shape in shapes.items()}
    observations["patch"][:, 1, :6] = 0.0
    expected = plainly(extractor, observations)
    torch.testing.assert_close(extractor(observations), expected)
    with torch.no_grad():
        torch.testing.assert_close(extractor(observations), expected)
    weights = torch.rand(5, 7)
    gradients = [
        torch.autograd.grad((features * weights).sum(), list(extractor.parameters()))
        for features in (extractor(observations), expected)
    ]
    for one, other in zip(*gradients, strict=True):
        torch.testing.assert_close(one, other)
