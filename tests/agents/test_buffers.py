"""The rollout's buffer gives every step once, with all that belongs to it, and what it gives is no window into it."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents.buffers import Rollout
from gymnasium import spaces

STEPS, WORLDS = 4, 3


@pytest.fixture
def rollout():
    """A full buffer in which all that belongs to step s of world w carries the number 10 s + w."""
    box = spaces.Box(-100.0, 100.0, (2,))
    buffer = Rollout(STEPS, spaces.Dict({"pose": box}), box, device="cpu", n_envs=WORLDS)
    for step in range(STEPS):
        number = 10.0 * step + np.arange(WORLDS, dtype=np.float32)
        pair, value = np.stack([number, number], axis=1), torch.from_numpy(number)
        buffer.add({"pose": pair}, pair, number, np.zeros(WORLDS), value, value)
    buffer.compute_returns_and_advantage(torch.zeros(WORLDS), np.zeros(WORLDS))
    return buffer


def test_every_step_is_drawn_once_with_all_that_belongs_to_it(rollout):
    advantages = {10.0 * s + w: rollout.advantages[s, w] for s in range(STEPS) for w in range(WORLDS)}
    drawn = []
    for batch in rollout.get(5):
        numbers = batch.old_values
        pairs = numbers[:, None].expand(-1, 2)
        assert torch.equal(batch.observations["pose"], pairs)
        assert torch.equal(batch.actions, pairs)
        assert torch.equal(batch.old_log_prob, numbers)
        found = torch.tensor([advantages[number] for number in numbers.tolist()])
        assert torch.equal(batch.advantages, found)
        torch.testing.assert_close(batch.returns, found + numbers)
        drawn += numbers.tolist()
    assert sorted(drawn) == sorted(advantages)


def test_what_is_drawn_can_be_changed_without_harm(rollout):
    for batch in rollout.get(STEPS * WORLDS):
        batch.observations["pose"].zero_()
        batch.actions.zero_()
    batch = next(rollout.get(STEPS * WORLDS))
    assert batch.observations["pose"].abs().sum() > 0.0
    assert batch.actions.abs().sum() > 0.0
