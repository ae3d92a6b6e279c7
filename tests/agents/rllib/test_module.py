"""RLlib's network and its twin in numpy, which the policy file is for."""

from pathlib import Path

import numpy as np
import pytest
from dirt_env.agents.rllib.settings import load_cluster_settings, scene_of

from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy

SMOKE = Path(__file__).resolve().parents[3] / "configs" / "rllib" / "smoke.toml"


def test_the_policy_file_acts_as_the_module_does(tmp_path):
    torch = pytest.importorskip("torch")
    pytest.importorskip("ray.rllib")
    from dirt_env.agents.rllib.module import PatchAndPose, policy_file

    settings = load_cluster_settings(SMOKE, {})
    config = scene_of(settings.worlds, {"level": 1})
    env = DirtPushEnv(scene=config.to_dict())
    model = {"network": vars(settings.network), "log_std_init": -0.3}
    module = PatchAndPose(observation_space=env.observation_space, action_space=env.action_space, model_config=model)
    with torch.no_grad():
        module.action.weight *= 100.0  # so that the actions differ, and some are clipped
    path = tmp_path / "policy.npz"
    path.write_bytes(policy_file(module, settings, {}))
    policy = load_policy(str(path), config)
    observation, _ = env.reset(seed=0)
    for action in np.random.default_rng(0).uniform(-1, 1, (20, 3)):
        seen = {name: torch.as_tensor(array[None]) for name, array in observation.items()}
        with torch.no_grad():
            mean = module.forward_inference({"obs": seen})["action_dist_inputs"][0, :3].numpy()
        assert policy.act(observation) == pytest.approx(mean.clip(-1.0, 1.0), abs=1e-5)
        observation = env.step(action)[0]
