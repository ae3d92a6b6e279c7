"""Beginning from a teacher: what it shows, what the actor takes from it, and that the rest of a run is as before."""

import sys
from io import StringIO

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from dirt_env.agents.demonstrations import demonstrate
from dirt_env.agents.imitation import imitate, let_learn
from dirt_env.agents.loading import load_settings
from dirt_env.agents.trainer import Trainer

from dirt_env.config import load
from dirt_env.policy import load_policy

from .conftest import SMOKE, smoke

TEACHER = {"policy": "adaptive_push", "worlds": 4, "steps": 240, "epochs": 20, "batch_size": 60, "critic_steps": 300}


def heard(*_):
    """Let it go on."""
    return False


def taught(**teacher):
    return smoke(teacher=TEACHER | teacher, worlds={"count": 16, "set": {"observation": {"overview": True}}})


def test_a_teacher_shows_what_the_network_sees_and_what_it_would_do_there():
    shown = [step for _, step in demonstrate(taught(noise=0.0))]
    assert len(shown) == 60
    assert {name: array.shape for name, array in shown[0].observations.items()} == {
        "patch": (4, 2, 8, 8),
        "pose": (4, 15),
        "overview": (4, 2, 12, 12),
    }
    assert all(np.abs(step.actions).max() <= 1.0 for step in shown)
    again = [step for _, step in demonstrate(taught(noise=0.0))]
    assert all(np.array_equal(one.actions, other.actions) for one, other in zip(shown, again, strict=True))
    other = [step for _, step in demonstrate(smoke(seed=1, teacher=TEACHER))]
    assert not np.array_equal(shown[-1].observations["pose"], other[-1].observations["pose"])


def test_the_actor_comes_to_act_as_its_teacher_and_the_critic_is_left_alone(tmp_path):
    settings, errors = taught(epochs=60), []
    trainer = Trainer(settings, tmp_path)
    policy = trainer.model.policy
    critic = {name: value.clone() for name, value in policy.named_parameters() if "value" in name}

    def tell(share, words):
        if "error" in words:
            errors.append(float(words.rpartition(" ")[2]))
        return False

    assert imitate(settings, trainer.model, trainer.env, tell)
    assert np.mean(errors[-8:]) < 0.6 * np.mean(errors[:8])
    assert all(torch.equal(critic[name], value) for name, value in policy.named_parameters() if "value" in name)
    assert trainer.env.obs_rms["pose"].count > 200  # the spread of what the teacher saw
    trainer.close()


@pytest.mark.parametrize("asked", [1, 30])
def test_imitation_that_is_stopped_says_so(asked, tmp_path):
    settings, calls = taught(), []
    trainer = Trainer(settings, tmp_path)

    def tell(*_):
        calls.append(1)
        return len(calls) >= asked

    assert not imitate(settings, trainer.model, trainer.env, tell)
    assert len(calls) == asked
    trainer.close()


@pytest.mark.parametrize("share", [True, False])
def test_the_critic_learns_alone_at_first(share, tmp_path):
    settings = smoke(steps=512, teacher=TEACHER | {"critic_steps": 256}, ppo={"share_features": share})
    trainer = Trainer(settings, tmp_path)
    policy, seen = trainer.model.policy, []
    learn = trainer.model.learn

    def watched(*arguments, **options):
        before = {name: value.clone() for name, value in policy.named_parameters()}
        learn(*arguments, **options)
        seen.append({name for name, value in policy.named_parameters() if not torch.equal(before[name], value)})

    trainer.model.learn = watched
    assert trainer.run() is None
    trainer.close()
    everything = {name for name, _ in policy.named_parameters()}
    of_critic = {name for name in everything if name.removeprefix("mlp_extractor.").startswith(("value", "vf"))}
    assert any(name.startswith("vf_features_extractor.convolutions") for name in of_critic) == (not share)
    assert seen[0] == of_critic
    assert seen[1] == everything


def test_let_learn_gives_everything_back(tmp_path):
    trainer = Trainer(smoke(), tmp_path)
    let_learn(trainer.model, critic_only=True)
    let_learn(trainer.model, critic_only=False)
    assert all(value.requires_grad for value in trainer.model.policy.parameters())
    trainer.close()


def test_a_teacher_that_needs_another_environment_is_refused(pusher):
    for teacher, complaint in (
        ({"policy": str(pusher)}, r"teacher.policy is .*pusher.npz.*, which needs"),
        ({"policy": "nobody"}, r"teacher.policy is 'nobody': policy is 'nobody'; known: adaptive_push"),
        ({"policy": ""}, r"teacher.policy is ''; allowed: a scripted behaviour"),
        ({"critic_steps": 4096}, r"teacher.critic_steps is 4096; allowed: less than steps 4096"),
    ):
        with pytest.raises(ValueError, match=complaint):
            smoke(teacher=TEACHER | teacher)


def test_the_default_run_begins_from_the_yardstick():
    settings = load_settings(SMOKE.with_name("ppo_heap.toml"), {})
    assert load_policy(settings.teacher.policy, load("heap")).sees == "map"
    assert settings.worlds.set["action"] == {"blade": "grade"}


def test_a_terminal_shows_how_far_the_imitation_has_come(tmp_path, monkeypatch):
    screen = StringIO()
    screen.isatty = lambda: True
    monkeypatch.setattr(sys, "stderr", screen)
    trainer = Trainer(smoke(steps=512, teacher=TEACHER), tmp_path)
    assert trainer.run() is None
    trainer.close()
    shown = screen.getvalue().split("\r")
    recorded = [line for line in shown if "imitation: " in line and " steps of adaptive_push recorded" in line]
    fitted = [line for line in shown if "imitation: error " in line]
    assert len(recorded) > 10
    assert len(fitted) > 10
    assert "100 %" in fitted[-1]
