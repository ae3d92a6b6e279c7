"""What the trainer changes in the course of a run."""

import json
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents.buffers import Rollout
from dirt_env.agents.checkpoint import Checkpoint, agree
from dirt_env.agents.layers import Tanh
from dirt_env.agents.settings import flattened
from dirt_env.agents.trainer import Trainer

from .conftest import smoke

STEPS = {"steps": 1024, "stage": [{"levels": [0]}]}
# The keys of the first checkpoints that there were, by table; never to be added to.
FIRST = {
    "": "description device name seed stage steps",
    "worlds.": "count scene threads set.observation.resolution set.observation.size set.task.time",
    "network.": "features filters hidden kernels strides",
    "teacher.": "batch_size critic_steps epochs learning_rate noise policy steps worlds",
    "ppo.": "batch_size clip_range ent_coef final_rate gae_lambda gamma learning_rate log_std_init max_grad_norm "
    "n_epochs n_steps target_kl vf_coef",
    "normalise.": "clip pose returns",
    "record.": "evaluate_every layouts levels save_every",
}


def deviations(tmp_path, **ppo):
    """Logarithm of the actions' deviation after each update."""
    trainer, found = Trainer(smoke(**STEPS, ppo=ppo), tmp_path), []
    learn = trainer.model.learn

    def watched(*arguments, **options):
        learn(*arguments, **options)
        found.append(trainer.model.policy.log_std.detach().clone())

    trainer.model.learn = watched
    assert trainer.run() is None
    trainer.close()
    return found


def test_the_deviation_falls_evenly_where_that_is_asked_for(tmp_path):
    found = deviations(tmp_path, log_std_init=-1.0, log_std_final=-3.0)
    assert [one.tolist() for one in found] == [pytest.approx([value] * 3) for value in (-1.0, -1.5, -2.0, -2.5)]


def test_else_it_is_learned(tmp_path):
    found = deviations(tmp_path, log_std_init=-1.0)
    assert not torch.equal(found[0], found[-1])
    assert not torch.allclose(found[-1], found[-1].mean(), atol=1e-6)


def test_weights_that_are_no_numbers_stop_a_run_before_anything_is_made_of_them(tmp_path):
    trainer = Trainer(smoke(**STEPS), tmp_path)
    learn = trainer.model.learn

    def diverge(*arguments, **options):
        learn(*arguments, **options)
        trainer.model.policy.value_net.bias.data.fill_(float("nan"))

    trainer.model.learn = diverge
    with pytest.raises(
        ValueError, match=r"training diverged after 256 steps: .* allowed: a smaller ppo\.learning_rate"
    ):
        trainer.run()
    trainer.close()
    assert not (tmp_path / "policy.npz").exists()


def test_the_quick_ways_are_taken(tmp_path):
    model = Trainer(smoke(), tmp_path).model
    assert isinstance(model.rollout_buffer, Rollout)
    assert model.policy.optimizer.defaults["fused"]
    assert any(isinstance(layer, Tanh) for layer in model.policy.modules())
    assert not any(isinstance(layer, torch.nn.Tanh) for layer in model.policy.modules())


def test_a_run_has_a_checkpoint_before_its_first_step(tmp_path):
    """So that a folder tells whose it is, whenever the run in it is killed."""
    trainer = Trainer(smoke(**STEPS), tmp_path)
    (tmp_path / "best.npz").write_bytes(b"of an earlier run")
    trainer.model.learn = lambda *_, **__: pytest.fail("killed")
    with pytest.raises(pytest.fail.Exception, match="killed"):
        trainer.run()
    trainer.close()
    assert not (tmp_path / "best.npz").exists()
    with pytest.raises(ValueError, match=r"run with other settings: ppo\.gamma is 0\.5 here"):
        Trainer(smoke(**STEPS, ppo={"gamma": 0.5}), tmp_path)
    assert Trainer(smoke(**STEPS), tmp_path).steps == 0


def test_a_checkpoint_from_before_a_setting_goes_on_where_that_is_as_it_was_then():
    told = json.loads(json.dumps(smoke().to_dict()))
    first = {table + name for table, names in FIRST.items() for name in names.split()}
    for key in set(flattened(told)) - first:
        *tables, name = key.split(".")
        del (told[tables[0]] if tables else told)[name]
    found = Checkpoint({"settings": told}, {})
    agree(found, smoke(), Path("checkpoint.npz"))
    with pytest.raises(ValueError, match=r"network\.roots is True here and False there"):
        agree(found, smoke(network={"roots": True}), Path("checkpoint.npz"))
