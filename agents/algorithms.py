"""PPO and SAC of stable-baselines3 as a training run uses them, and what their future depends on."""

from time import perf_counter
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecNormalize

from dirt_env.config import SceneConfig

from .buffers import Replay, Rollout
from .extractor import PatchPoseOverview
from .frames import channel_places
from .layers import Tanh
from .optimiser import MuonAndAdam
from .settings import Settings

# What of a table is no argument of the algorithm.
OWN = ("optimizer", "share_features", "final_rate", "log_std_init", "log_std_final", "memory")


class WholeRun:
    """An algorithm whose progress is that of the whole run, though `learn` is called for one update at a time."""

    run_steps = 1
    update_seconds = 0.0  # spent in updates

    def train(self, *arguments: Any, **options: Any) -> None:
        """One update, on what was collected."""
        begun = perf_counter()
        super().train(*arguments, **options)
        self.update_seconds += perf_counter() - begun

    def begin_episodes(self, env: VecNormalize) -> None:
        """Start new episodes in all worlds."""
        self._last_obs = env.reset()
        self._last_episode_starts = np.ones(env.num_envs, bool)

    def optimisers(self) -> dict[str, torch.optim.Optimizer]:
        """All optimisers by name."""
        raise NotImplementedError

    def own_state(self) -> dict[str, np.ndarray]:
        """Arrays by name, beside weights, optimisers and what was seen last."""
        return {}

    def set_own_state(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a state of `own_state`."""

    def _update_current_progress_remaining(self, num_timesteps: int, total_timesteps: int) -> None:
        super()._update_current_progress_remaining(min(num_timesteps, self.run_steps), self.run_steps)


class LongPPO(WholeRun, PPO):
    """PPO for a whole run."""

    def optimisers(self) -> dict[str, torch.optim.Optimizer]:
        """That of actor and critic together, or its two parts."""
        optimiser = self.policy.optimizer
        if isinstance(optimiser, MuonAndAdam):
            return {"muon": optimiser.muon, "adam": optimiser.adam}
        return {"optimizer": optimiser}


class LongSAC(WholeRun, SAC):
    """SAC for a whole run. Its buffer keeps what was seen as it is, and normalises it when it is drawn."""

    def begin_episodes(self, env: VecNormalize) -> None:
        """Start new episodes in all worlds."""
        super().begin_episodes(env)
        self._last_original_obs = env.get_original_obs()

    def optimisers(self) -> dict[str, torch.optim.Optimizer]:
        """Those of the actor and the critics, and that of the entropy's weight, if it is learned."""
        found = {"optimizer.actor": self.actor.optimizer, "optimizer.critic": self.critic.optimizer}
        return found if self.ent_coef_optimizer is None else {**found, "optimizer.entropy": self.ent_coef_optimizer}

    def own_state(self) -> dict[str, np.ndarray]:
        """The buffer, the entropy's weight, what was seen last as it was, and the generator of the first actions."""
        state = {f"replay/{name}": array for name, array in self.replay_buffer.state().items()}
        state |= {f"original/{name}": array for name, array in self._last_original_obs.items()}
        if self.log_ent_coef is not None:
            state["entropy"] = self.log_ent_coef.detach().cpu().numpy()
        drawn = self.action_space.np_random.bit_generator.state["state"]
        state["first_actions"] = np.frombuffer(
            b"".join(drawn[name].to_bytes(16) for name in ("state", "inc")), np.uint8
        )
        return state

    def set_own_state(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a state of `own_state`."""
        self.replay_buffer.set_state(under(state, "replay/"))
        self._last_original_obs = under(state, "original/")
        if self.log_ent_coef is not None:
            self.log_ent_coef.data.copy_(torch.from_numpy(state["entropy"]))
        generator, drawn = self.action_space.np_random.bit_generator, state["first_actions"].tobytes()
        numbers = {"state": int.from_bytes(drawn[:16]), "inc": int.from_bytes(drawn[16:])}
        generator.state = {**generator.state, "state": numbers, "has_uint32": 0, "uinteger": 0}


Model = LongPPO | LongSAC


def make_model(settings: Settings, env: VecNormalize, config: SceneConfig) -> Model:
    """The algorithm of the settings, with the network for patch, pose and overview of that scene."""
    table, network = vars(settings.learner), settings.network
    roots = channel_places("todo", config.channels, settings.worlds.frames) if network.roots else ()
    same = {name: value for name, value in table.items() if name not in OWN}
    shape = {
        "features_extractor_class": PatchPoseOverview,
        "features_extractor_kwargs": {"network": network, "roots": roots},
        "net_arch": list(network.hidden),
        "activation_fn": Tanh,
        "normalize_images": False,
    }
    common = {"seed": settings.seed, "device": settings.device}
    if settings.ppo is not None:
        first, final = settings.ppo.learning_rate, settings.ppo.final_rate
        same["learning_rate"] = lambda left: first * (left + final * (1.0 - left))  # falls evenly over the run
        shape["log_std_init"] = settings.ppo.log_std_init
        shape["share_features_extractor"] = settings.ppo.share_features
        shape["optimizer_kwargs"] = {"eps": 1e-5, "fused": True}  # in one pass over the weights
        if settings.ppo.optimizer == "muon":
            shape["optimizer_class"] = MuonAndAdam
        options = {"rollout_buffer_class": Rollout, "policy_kwargs": shape}
        model: Model = LongPPO("MultiInputPolicy", env, **same, **common, **options)
    else:
        options = {"replay_buffer_class": Replay, "policy_kwargs": shape}
        model = LongSAC("MultiInputPolicy", env, **same, **common, **options)
    model.run_steps = settings.steps
    model.set_logger(Logger(None, []))
    return model


def under(arrays: dict[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """The arrays whose names begin so, by the rest of their names."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
