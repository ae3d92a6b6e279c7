"""Imitation of a teacher: the actor's mean action is fitted to what the teacher would have done."""

from collections.abc import Callable

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from .demonstrations import Demonstrations, demonstrate
from .settings import Settings

Told = Callable[[float, str], bool]  # how far the whole has come (0 to 1) and what is being done; True stops it
CRITIC = ("mlp_extractor.value_net", "value_net", "vf_features_extractor")  # its parameters' names begin so
RECORDING = 0.7  # of the whole, about


def imitate(settings: Settings, model: PPO, env: VecNormalize, tell: Told) -> bool:
    """Record the teacher and fit the actor to it; False if `tell` stopped it, and then the model is no good."""
    shown = _record(settings, tell)
    if shown is None:
        return False
    if env.norm_obs:
        env.obs_rms["pose"].update(shown.observations["pose"])
    return _fit(settings, model, env, shown, tell)


def _record(settings: Settings, tell: Told) -> Demonstrations | None:
    """All demonstrations, what is large as f2."""
    steps: list[Demonstrations] = []
    for count, step in demonstrate(settings):
        small = {name: seen if name == "pose" else seen.astype(np.float16) for name, seen in step.observations.items()}
        steps.append(step._replace(observations=small))
        if tell(RECORDING * count / settings.teacher.steps, f"{count:,} steps of {settings.teacher.policy} recorded"):
            return None
    names = steps[0].observations
    seen = {name: np.concatenate([step.observations[name] for step in steps]) for name in names}
    return Demonstrations(seen, np.concatenate([step.actions for step in steps]))


def _fit(settings: Settings, model: PPO, env: VecNormalize, shown: Demonstrations, tell: Told) -> bool:
    """Least squares by Adam, whose rate falls evenly to nothing; what belongs to the critic alone stays."""
    teacher, policy = settings.teacher, model.policy
    wanted = torch.from_numpy(shown.actions)
    optimiser = torch.optim.Adam(policy.parameters(), teacher.learning_rate)
    batches = [batch for _ in range(teacher.epochs) for batch in torch.randperm(len(wanted)).split(teacher.batch_size)]
    for number, batch in enumerate(batches):
        for group in optimiser.param_groups:
            group["lr"] = teacher.learning_rate * (1.0 - number / len(batches))
        rows = batch.numpy()
        seen = env.normalize_obs({name: array[rows].astype(np.float32) for name, array in shown.observations.items()})
        tensors = {name: torch.as_tensor(array, device=model.device) for name, array in seen.items()}
        loss = (policy.get_distribution(tensors).mode() - wanted[batch].to(model.device)).square().mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        if tell(RECORDING + (1.0 - RECORDING) * (number + 1) / len(batches), f"error {loss.item():.3f}"):
            return False
    return True


def let_learn(model: PPO, critic_only: bool) -> None:
    """Let the next updates change all of the model, or only what belongs to the critic alone."""
    for name, parameter in model.policy.named_parameters():
        parameter.requires_grad_(not critic_only or name.startswith(CRITIC))
