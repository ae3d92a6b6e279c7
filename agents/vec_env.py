"""The native batch as a `VecEnv` of stable-baselines3."""

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from dirt_env.env import DirtPushEnv
from dirt_env.task.reward import TERMS
from dirt_env.task.step import INFO

INFOS = ("all", "end")


class DirtPushVecEnv(VecEnv):
    """`num_envs` worlds of `DirtPush-v0`, equal to the last bit to a `DummyVecEnv` of `gymnasium.make("DirtPush-v0")`.

    Takes the arguments of `dirt_env.vector.DirtPushVectorEnv`, but for `autoreset_mode` and `copy`. `info`: "all" makes
    a dict with all numbers for every world and step, as `DummyVecEnv` has it (2 us each); "end", enough for training,
    makes them for the last step of an episode only. `VecMonitor` and `VecNormalize` go around it as usual::

        env = VecNormalize(VecMonitor(DirtPushVecEnv(256, level=1, info="end")))
        PPO("MultiInputPolicy", env).learn(1_000_000)
    """

    def __init__(self, num_envs: int = 1, info: str = "all", **options: Any) -> None:
        """Make the worlds; raises ValueError that names what is wrong and what is allowed."""
        if info not in INFOS:
            raise ValueError(f"info is {info!r}; allowed: {', '.join(INFOS)}")
        self._info = info
        mode = AutoresetMode.SAME_STEP
        self.native = gymnasium.make_vec("dirt_env:DirtPush-v0", num_envs, autoreset_mode=mode, info=info, **options)
        self._actions: np.ndarray | None = None
        super().__init__(num_envs, self.native.single_observation_space, self.native.single_action_space)
        self.metadata = DirtPushEnv.metadata

    def reset(self) -> VecEnvObs:
        """Start new episodes, with the seeds of `seed` and the options of `set_options`, which are then forgotten."""
        options = self._options if any(self._options) else None
        observations, infos = self.native.reset(seed=self._seeds, options=options)
        self.reset_infos = _dicts(infos, np.arange(self.num_envs)) if infos else [{} for _ in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions (num_envs, 3) of the next `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Observations, rewards f4[n], done bool[n], and a dict for each world.

        Where an episode has ended, the observation is the first of the next one; the last one is in the dict, as
        `terminal_observation`, and `TimeLimit.truncated` says whether it was for want of time alone.
        """
        observations, rewards, terminated, truncated, infos = self.native.step(self._actions)
        done = terminated | truncated
        ended = np.flatnonzero(done)
        dicts = _dicts(infos, np.arange(self.num_envs)) if self._info == "all" else [{} for _ in done]
        if len(ended):
            for world, final in zip(ended.tolist(), _dicts(infos["final_info"], ended), strict=True):
                self.reset_infos[world] = dicts[world]
                dicts[world] = final
        for one, is_late in zip(dicts, (truncated & ~terminated).tolist(), strict=True):
            one["TimeLimit.truncated"] = is_late
        for world in ended.tolist():
            dicts[world]["terminal_observation"] = infos["final_obs"][world]
        return observations, rewards.astype(np.float32), done, dicts

    def close(self) -> None:
        """Close the windows, and let the threads go."""
        self.native.close()

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture of every world."""
        return list(self.native.render())

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of these worlds' `DirtPushEnv`."""
        return [getattr(env, attr_name) for env in self._envs(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of these worlds' `DirtPushEnv`."""
        for env in self._envs(indices):
            setattr(env, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Call a method of these worlds' `DirtPushEnv`."""
        return [getattr(env, method_name)(*args, **kwargs) for env in self._envs(indices)]

    def env_is_wrapped(self, wrapper_class: type[gymnasium.Wrapper], indices: VecEnvIndices = None) -> list[bool]:
        """False for each: no world of a batch has wrappers of its own."""
        return [False for _ in self._envs(indices)]

    def _envs(self, indices: VecEnvIndices) -> list[DirtPushEnv]:
        return [self.native.envs[index] for index in self._get_indices(indices)]


def _dicts(infos: dict[str, Any], worlds: Iterable[int]) -> list[dict[str, Any]]:
    """The infos of these worlds one by one; the reward's terms for those that have them."""
    rows = zip(*(infos[name][worlds].tolist() for name in INFO), strict=True)
    dicts = [dict(zip(INFO, row, strict=True)) for row in rows]
    if "reward" in infos:
        terms = zip(*(infos["reward"][name][worlds].tolist() for name in TERMS), strict=True)
        for one, row, has in zip(dicts, terms, infos["_reward"][worlds].tolist(), strict=True):
            if has:
                one["reward"] = dict(zip(TERMS, row, strict=True))
    return dicts
