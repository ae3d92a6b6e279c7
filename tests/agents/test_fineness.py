"""The blade on a curve: fine near grade, its ends where they were, and the same in training and in the file."""

import numpy as np
import pytest
from dirt_env.agents.fineness import BLADE, from_blade, to_blade
from dirt_env.agents.network import read

from .conftest import METADATA, smoke, weights

LEVELS = np.linspace(-1.0, 1.0, 41)


def actions(blade):
    """Actions with these blades, and something else beside them."""
    return np.stack([np.full(len(blade), 0.3), np.full(len(blade), -0.7), blade], axis=1)


@pytest.mark.parametrize("fineness", [0.5, 5.0, 10.0])
def test_the_blade_goes_by_the_curve_and_back_and_nothing_else_changes(fineness):
    asked = actions(LEVELS)
    bent = to_blade(asked, fineness)
    np.testing.assert_allclose(bent[:, BLADE], np.sinh(fineness * LEVELS) / np.sinh(fineness), rtol=1e-12)
    assert bent[[0, 20, 40], BLADE].tolist() == pytest.approx([-1.0, 0.0, 1.0])
    assert (np.diff(bent[:, BLADE]) > 0.0).all()
    np.testing.assert_array_equal(bent[:, :BLADE], asked[:, :BLADE])
    np.testing.assert_allclose(from_blade(bent, fineness), asked, atol=1e-12)
    np.testing.assert_array_equal(asked, actions(LEVELS))


def test_without_it_all_stays_as_it_is():
    asked = actions(LEVELS)
    assert to_blade(asked, 0.0) is asked
    assert from_blade(asked, 0.0) is asked


def test_a_step_near_grade_is_fine_and_one_above_it_coarse():
    low, high = np.diff(to_blade(actions(np.array([0.0, 0.1, 0.9, 1.0])), 5.0)[:, BLADE])[[0, 2]]
    assert low < 0.01
    assert high > 0.3


def test_a_policy_moves_the_blade_by_its_fineness():
    generator = np.random.default_rng(0)
    arrays = weights(generator)
    arrays["action.weight"] *= 0.1
    seen = {
        "patch": generator.standard_normal((8, 2, 8, 8)).astype(np.float32),
        "pose": generator.standard_normal((8, 15)).astype(np.float32),
    }
    plain, fine = (read(arrays, {**METADATA, **more}).act_all(seen) for more in ({}, {"fineness": 5.0}))
    np.testing.assert_array_equal(fine, to_blade(plain, 5.0))
    assert np.abs(fine - plain).max() > 0.1


@pytest.mark.usefixtures("stable_baselines3")
class TestTraining:
    """With stable-baselines3."""

    def test_the_worlds_are_driven_by_the_curve(self):
        """Beside the same worlds as they are, driven by actions that were bent by hand."""
        from dirt_env.agents.course import Course

        fine, plain = (
            Course(smoke(worlds={"count": 8, "mirror": True, "fineness": fineness}, ppo={"batch_size": 64}))
            for fineness in (5.0, 0.0)
        )
        fine.reset()
        plain.reset()
        for asked in np.random.default_rng(0).uniform(-1, 1, (10, 8, 3)).astype(np.float32):
            shown, rewards, *_ = fine.step(asked)
            seen, expected, *_ = plain.step(to_blade(asked, 5.0))
            np.testing.assert_array_equal(rewards, expected)
            for name, array in seen.items():
                np.testing.assert_array_equal(shown[name], array, err_msg=name)

    def test_the_teacher_is_imitated_on_the_curve(self):
        from dirt_env.agents.demonstrations import demonstrate

        teacher = {"policy": "adaptive_push", "worlds": 4, "steps": 40, "critic_steps": 0}
        settings = [smoke(worlds={"fineness": fineness}, teacher=teacher) for fineness in (5.0, 0.0)]
        for (_, fine), (_, plain) in zip(*map(demonstrate, settings), strict=True):
            np.testing.assert_array_equal(fine.actions, from_blade(plain.actions, 5.0))
            assert np.abs(fine.actions).max() <= 1.0
            np.testing.assert_array_equal(fine.observations["pose"], plain.observations["pose"])

    def test_a_run_writes_it_into_its_policy(self, tmp_path):
        from dirt_env.agents.network import load
        from dirt_env.agents.trainer import Trainer

        from dirt_env.config import load as load_scene

        trainer = Trainer(smoke(steps=256, worlds={"fineness": 3.0}), tmp_path)
        assert trainer.run() is None
        trainer.close()
        assert load(tmp_path / "policy.npz", load_scene()).metadata["fineness"] == 3.0
