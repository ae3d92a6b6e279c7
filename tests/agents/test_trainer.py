"""What the trainer changes in the course of a run."""

import json
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents.checkpoint import Checkpoint, agree
from dirt_env.agents.settings import SINCE
from dirt_env.agents.trainer import Trainer

from .conftest import smoke

STEPS = {"steps": 1024, "stage": [{"levels": [0]}]}


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


def test_a_checkpoint_from_before_a_setting_goes_on_where_that_is_as_it_was_then():
    told = json.loads(json.dumps(smoke().to_dict()))
    for key in SINCE:
        *tables, name = key.split(".")
        del (told[tables[0]] if tables else told)[name]
    found = Checkpoint({"settings": told}, {})
    agree(found, smoke(), Path("checkpoint.npz"))
    with pytest.raises(ValueError, match=r"network\.roots is True here and False there"):
        agree(found, smoke(network={"roots": True}), Path("checkpoint.npz"))
