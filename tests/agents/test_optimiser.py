"""Muon for matrices and Adam for the rest: who takes what, how large their steps are, and that a run goes on."""

import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents.hyperparameters import MUON_FROM
from dirt_env.agents.optimiser import MuonAndAdam
from dirt_env.agents.trainer import Trainer
from torch import nn

from .conftest import broken_and_gone_on, smoke


def stepped(layer, lr):
    """Weight and bias after a step with a gradient whose singular values differ by 1000."""
    torch.manual_seed(1)
    left, right = torch.linalg.qr(torch.randn(16, 16))[0], torch.linalg.qr(torch.randn(16, 16))[0]
    optimiser = MuonAndAdam(layer.parameters(), 1.0, eps=1e-5)
    for group in optimiser.param_groups:
        group["lr"] = lr
    optimiser.zero_grad()
    layer.weight.grad = left @ torch.diag(torch.logspace(-3, 0, 16)) @ right
    layer.bias.grad = torch.linspace(-1.0, 1.0, 16)
    before = [one.detach().clone() for one in (layer.weight, layer.bias)]
    optimiser.step()
    return [(new - old).detach() / lr for new, old in zip((layer.weight, layer.bias), before, strict=True)]


@pytest.mark.parametrize("lr", [1e-3, 1e-2])
def test_muon_moves_a_matrix_in_all_directions_alike_and_adam_a_vector(lr):
    weight, bias = stepped(nn.Linear(16, 16), lr)
    values = torch.linalg.svdvals(weight) / (0.2 * 16**0.5)
    assert values[:12].min() > 0.5  # those of the gradient fall to 0.006 there; the last few take more steps to come up
    assert values.max() < 1.5
    torch.testing.assert_close(bias.abs(), torch.ones(16), rtol=1e-2, atol=1e-2)


def test_steps_are_those_of_the_two_written_out():
    """Muon with momentum 0.95 (Nesterov's) and no decay, scaled by 0.2 sqrt(larger side); Adam with the given eps."""
    torch.manual_seed(2)
    wide, narrow = nn.Parameter(torch.randn(MUON_FROM, 20)), nn.Parameter(torch.randn(MUON_FROM - 1, 20))
    optimiser = MuonAndAdam([wide, narrow], 0.01, eps=0.5)
    plain = narrow.detach().clone().requires_grad_()
    adam = torch.optim.Adam([plain], 0.01, eps=0.5)
    expected, mean = wide.detach().clone().double(), torch.zeros_like(wide)
    for _ in range(3):
        optimiser.zero_grad()
        assert wide.grad is None
        assert narrow.grad is None
        wide.grad, narrow.grad = torch.randn(wide.shape), torch.randn(narrow.shape)
        plain.grad = narrow.grad.clone()
        mean = 0.95 * mean + 0.05 * wide.grad
        expected -= 0.01 * 0.2 * 20**0.5 * orthogonal(0.05 * wide.grad + 0.95 * mean)
        optimiser.step()
        adam.step()
    torch.testing.assert_close(wide.double(), expected, rtol=0.0, atol=2e-4)  # torch works in bfloat16
    assert torch.equal(narrow, plain)


def orthogonal(matrix):
    """Five steps of the quintic iteration of Jordan and others, which brings all singular values near 1."""
    x = matrix.double() / matrix.double().norm()
    for _ in range(5):
        gram = x @ x.T
        x = 3.4445 * x + (-4.7750 * gram + 2.0315 * gram @ gram) @ x
    return x


def test_a_network_without_a_matrix_for_muon_is_refused():
    with pytest.raises(ValueError, match=r'network\.features is 7 with ppo\.optimizer "muon"; allowed: at least 8'):
        smoke(ppo={"optimizer": "muon"}, network={"features": 7})


def test_the_setting_takes_muon_for_all_hidden_matrices_and_adam_for_the_rest(tmp_path):
    trainer = Trainer(smoke(ppo={"optimizer": "muon"}), tmp_path)
    found, policy = trainer.model.optimisers(), trainer.model.policy
    taken = [one.shape for one in found["muon"].param_groups[0]["params"]]
    assert taken == [one.shape for one in policy.parameters() if one.ndim == 2 and min(one.shape) > 3]
    assert len(taken) >= 3
    rest = found["adam"].param_groups[0]["params"]
    assert len(taken) + len(rest) == len(list(policy.parameters()))
    trainer.close()


def test_what_both_remember_goes_through_save_and_load_of_stable_baselines3(tmp_path):
    settings = smoke(steps=256, ppo={"optimizer": "muon"}, record={"evaluate_every": 1000, "save_every": 1000})
    trainer = Trainer(settings, tmp_path / "run")
    trainer.run()
    trainer.model.save(tmp_path / "model.zip")
    again = type(trainer.model).load(tmp_path / "model.zip")
    for model in (trainer.model, again):
        torch.manual_seed(0)
        for one in model.policy.parameters():
            one.grad = torch.randn(one.shape)
        model.policy.optimizer.step()
    for one, other in zip(trainer.model.policy.parameters(), again.policy.parameters(), strict=True):
        assert torch.equal(one, other)
    trainer.close()


@pytest.mark.slow
@pytest.mark.parametrize("share", [True, False])
def test_a_run_with_muon_goes_on_to_the_same_bits(share, tmp_path):
    ppo = {"optimizer": "muon", "share_features": share}
    settings = smoke(steps=1024, ppo=ppo, stage=[{"levels": [0]}], record={"save_every": 512})
    broken_and_gone_on(settings, tmp_path, broken_at=768, saved_at=512)
