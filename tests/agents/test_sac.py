"""SAC by the same script: its buffer, its policy file, and that a run which was broken off goes on to the same bits."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents import checkpoint
from dirt_env.agents.consistency import step_bytes
from dirt_env.agents.export import actor_arrays, actor_metadata
from dirt_env.agents.network import load, read
from dirt_env.agents.trainer import Trainer

from dirt_env.config import load as load_scene

from .conftest import broken_and_gone_on, smoke

SAC = {"buffer_size": 512, "learning_starts": 128, "batch_size": 32, "train_freq": 4, "gradient_steps": 2}
RUN = {"steps": 1024, "stage": [{"levels": [0]}], "record": {"evaluate_every": 1024, "save_every": 256}}


def sac(table=(), **overrides):
    """The smoke settings for SAC, which learns after 128 of 1024 steps, and forgets those before the last 512."""
    return smoke(algorithm="sac", ppo=None, **{"sac": {**SAC, **dict(table)}, **RUN, **overrides})


@pytest.fixture
def trainer(tmp_path):
    trainer = Trainer(sac(worlds={"frames": 2, "set": {"observation": {"overview": True}}}), tmp_path)
    yield trainer
    trainer.close()


def test_a_step_takes_as_much_as_is_said(trainer):
    buffer = trainer.model.replay_buffer
    taken = sum(array.nbytes for array in buffer._arrays().values())
    assert taken == 512 * step_bytes(trainer.course.native.envs[0].config, 2)
    assert buffer.observations["patch"].dtype == buffer.next_observations["overview"].dtype == np.float16


def test_the_buffer_keeps_what_was_seen_before_and_after_every_step(trainer):
    model, shown, ended = trainer.model, [trainer.course.frames.kept], {}
    step_wait = trainer.course.step_wait

    def listen():
        seen, rewards, done, infos = step_wait()
        ended.update({(len(shown) - 1, i): infos[i]["terminal_observation"] for i in np.flatnonzero(done).tolist()})
        shown.append(seen)
        return seen, rewards, done, infos

    trainer.course.step_wait = listen
    while len(shown) < 43:  # all episodes end after 40 steps, for want of time
        model.learn(trainer.settings.rollout, log_interval=None, reset_num_timesteps=False)
    rows, buffer = model.replay_buffer.buffer_size, model.replay_buffer
    assert len(ended) == 16
    for step in range(len(shown) - 1 - rows, len(shown) - 1):
        for world in range(16):
            after = ended.get((step, world), {name: array[world] for name, array in shown[step + 1].items()})
            for name in ("patch", "pose"):
                before = shown[step][name][world]
                np.testing.assert_allclose(buffer.observations[name][step % rows, world], before, atol=2e-3)
                np.testing.assert_allclose(buffer.next_observations[name][step % rows, world], after[name], atol=2e-3)
            late = float((step, world) in ended)
            assert buffer.dones[step % rows, world] == buffer.timeouts[step % rows, world] == late
    drawn = buffer.sample(8, env=trainer.env)
    assert {array.dtype for array in [*drawn.observations.values(), *drawn.next_observations.values()]} == {
        torch.float32
    }
    assert drawn.dones.sum() == 0.0  # going on is worth something


def test_numpy_and_torch_act_the_same(trainer):
    generator, policy = np.random.default_rng(0), trainer.model.policy
    with torch.no_grad():
        for parameter in policy.actor.parameters():
            parameter += 0.2 * torch.randn_like(parameter)
    trainer.env.obs_rms["pose"].update(generator.standard_normal((50, 30)))
    seen = {
        "patch": generator.standard_normal((64, 4, 8, 8)).astype(np.float32),
        "pose": generator.uniform(-2, 2, (64, 30)).astype(np.float32),
        "overview": generator.uniform(0, 0.1, (64, 2, 12, 12)).astype(np.float32),
    }
    expected, _ = trainer.model.predict(trainer.env.normalize_obs(seen), deterministic=True)
    config = trainer.course.native.envs[0].config
    learned = read(actor_arrays(policy, trainer.env), actor_metadata(policy, config, trainer.settings.worlds, 10.0))
    acted = learned.network.actions(seen["patch"], seen["pose"], seen["overview"])
    np.testing.assert_allclose(acted, expected, atol=1e-5)
    assert acted.std(axis=0).min() > 0.1
    assert np.abs(acted).max() < 1.0


def test_an_unknown_squash_is_refused(trainer):
    policy, config = trainer.model.policy, trainer.course.native.envs[0].config
    metadata = {**actor_metadata(policy, config, trainer.settings.worlds, 10.0), "squash": "sine"}
    with pytest.raises(ValueError, match="its squash is 'sine'; allowed: clip, tanh"):
        read(actor_arrays(policy, trainer.env), metadata)


@pytest.mark.slow
@pytest.mark.parametrize("broken_at", [64, 576])
@pytest.mark.parametrize("entropy", ["auto", 0.1])
def test_a_run_goes_on_to_the_same_bits(broken_at, entropy, tmp_path):
    """Broken off among the random first actions, and when the buffer is full and overwritten."""
    settings = sac({"ent_coef": entropy}, record={**RUN["record"], "save_every": 64})
    broken_and_gone_on(settings, tmp_path, broken_at, saved_at=broken_at)
    trainers = [Trainer(settings, tmp_path / name) for name in ("begun", "whole")]  # the latter as it ended
    before, after = (list(trainer.model.policy.actor.parameters()) for trainer in trainers)
    moved = sum(not torch.equal(one, other) for one, other in zip(before, after, strict=True))
    assert moved == len(before)
    for trainer in trainers:
        trainer.close()
    ends = [checkpoint.read(tmp_path / name / "checkpoint.npz").arrays for name in ("whole", "broken")]
    assert ends[0].keys() == ends[1].keys()
    assert all(np.array_equal(array, ends[1][name]) for name, array in ends[0].items())
    assert load(tmp_path / "broken" / "policy.npz", load_scene()).network.squash == "tanh"
    header, *rows = (tmp_path / "broken" / "training.csv").read_text().splitlines()
    losses = [dict(zip(header.split(","), row.split(","), strict=True))["critic_loss"] for row in rows]
    assert losses[:2] == ["", ""]
    assert all(losses[2:])
