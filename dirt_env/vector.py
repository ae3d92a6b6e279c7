"""`DirtPush-v0` in a batch: the kernels of the single environment over the arrays of many worlds."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from dirt_env.arguments import check_known, read_count, read_indices, read_mask, read_seeds
from dirt_env.crew import Crew, threads_for
from dirt_env.env import DirtPushEnv
from dirt_env.infos import batch_infos, end_infos
from dirt_env.task.actions import read_actions
from dirt_env.task.observation import Sight
from dirt_env.task.step import ADVANCE, FIGURES, REWARD, SHOW, SUCCESS, TOGETHER, step_worlds
from dirt_env.variety import configs_for
from dirt_env.worlds import Worlds

INFOS = ("all", "end", "none")
Observations = dict[str, np.ndarray]


class DirtPushVectorEnv(VectorEnv):
    """`num_envs` worlds of `DirtPush-v0` that are stepped together, by `gymnasium.make_vec("DirtPush-v0", num_envs=N)`.

    Equal to the last bit to a `SyncVectorEnv` of as many single environments with a `TimeLimit`, in every autoreset
    mode and for any number of threads. Observations, actions, reward, reset options and infos are those of
    `DirtPushEnv`, one row for each world.

    ## Arguments
    `max_episode_steps`: truncate after so many steps; None or -1 never does. `make_vec` passes 600 if you name none.

    `autoreset_mode`: a `gymnasium.vector.AutoresetMode` or its value. "NextStep" (the default) resets a world in the
    step after its episode's last, "SameStep" in the same step (with `final_obs` and `final_info`), "Disabled" leaves
    that to you: `reset(options={"reset_mask": mask})`.

    `copy`: new arrays from every call (the default); with False, observations are overwritten by the next call.

    `info`: "all" (the default), "end" (of worlds whose episode has just ended) or "none". `final_obs` is always there.

    `threads`: over which the worlds are spread; by default the cores at hand, fewer in small batches.

    `render_mode`, `view`, `scene` and any table or key of a scene are as in `DirtPushEnv`.

    ## Worlds that differ
    `scene` may be a list, and `variants` a list of overrides; world i takes entry i of each, from the beginning again
    where a list ends. This is how soils are randomised, without compiling anything anew::

        rng = np.random.default_rng(0)
        soils = [{"soil": {"repose": angle}} for angle in rng.uniform(28, 40, 256)]
        env = gymnasium.make_vec("DirtPush-v0", num_envs=256, level=2, variants=soils)

    All worlds have the same number of cells, border, size and channels of observation, and either all or none of them
    obstacles, a design, traction, or noise; anything else is refused. `terrain="voxel"` needs
    `vectorization_mode="sync"`.

    ## Search
    `copy_worlds(source, targets)` branches a world into others of the batch, as quickly as their arrays are copied;
    `get_state` and `set_state` keep them as bytes, which a single environment of the same scene takes too.
    """

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        info: str = "all",
        threads: int | None = None,
        render_mode: str | None = None,
        view: str = "top",
        scene: Any = "heap",
        variants: Sequence[Mapping[str, Any]] | None = None,
        **overrides: Any,
    ) -> None:
        """Read and check the scenes; raises ValueError that names what is wrong and what is allowed."""
        self.num_envs = read_count("num_envs", num_envs)
        no_limit = max_episode_steps is None or max_episode_steps == -1
        self._most_steps = None if no_limit else read_count("max_episode_steps", max_episode_steps, " or None or -1")
        self.autoreset_mode = _mode(autoreset_mode)
        if info not in INFOS:
            raise ValueError(f"info is {info!r}; allowed: {', '.join(INFOS)}")
        check_known(overrides)
        self._info, self._copy = info, copy
        self._worlds = Worlds(configs_for(self.num_envs, scene, variants, overrides))
        self._crew = Crew(threads_for(num_envs) if threads is None else read_count("threads", threads, " or None"))
        self.envs = DirtPushEnv.all_of(self._worlds, render_mode, view)
        self.render_mode = render_mode
        self.metadata = {**DirtPushEnv.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_action_space = self.envs[0].action_space
        self.single_observation_space = self.envs[0].observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._begun = False
        self._every = np.ones(self.num_envs, bool)
        self._ended = np.zeros(self.num_envs, bool)  # worlds whose last step was their episode's last
        self._kept = None if copy else self._worlds.blanks()

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Any = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start new episodes, in all worlds or in those of `options["reset_mask"]` bool[num_envs].

        `seed`: that of the first world, from which the others count up; or a list. The other options are those of
        `DirtPushEnv.reset`; a list has those of each world. Raises ValueError, and changes nothing, if seeds or options
        are bad.
        """
        mask, options = read_mask(options, self.num_envs)
        seeds = read_seeds(seed, self.num_envs)
        if any(self._worlds.layouts[world] is None for world in np.flatnonzero(~mask)):
            raise ResetNeeded("Cannot reset some of the worlds before calling env.reset() for all of them")
        self._begin(np.flatnonzero(mask).tolist(), seeds, options)
        self._measure(mask)
        self._ended[mask] = False
        seen, sight = self._blanks()
        figures = np.empty((len(FIGURES), self.num_envs))
        self._worlds.step_from(SHOW, sight, figures, 0, self.num_envs, 0)
        infos = batch_infos(figures, mask, np.zeros_like(mask)) if self._info == "all" else {}
        return seen, infos

    def step(self, actions: Any) -> tuple[Observations, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One control step in every world, actions (num_envs, 3).

        Observations by name, reward f8[n], terminated and truncated bool[n], infos. Raises ValueError, and changes
        nothing in any world, if an action is bad; ResetNeeded before the first reset or, where resetting is left to
        you, after an episode's end.
        """
        values = read_actions(actions, self.num_envs)
        self._check_begun()
        mode, ended = self.autoreset_mode, self._ended
        idle = ended if mode == AutoresetMode.NEXT_STEP else np.zeros(self.num_envs, bool)
        busy = ~idle
        self._measure(busy)
        seen, sight = self._blanks()
        figures = np.empty((len(FIGURES), self.num_envs))
        self._run(values, idle, sight, figures)
        if np.count_nonzero(idle):
            self._restart(np.flatnonzero(idle).tolist(), sight, figures)
        terminated, truncated = (figures[SUCCESS] == 1.0) & busy, self._are_out_of_time() & busy
        self._ended = terminated | truncated
        if self.render_mode == "human":
            for world in np.flatnonzero(busy):
                self.envs[world].render()
        if mode == AutoresetMode.SAME_STEP and np.count_nonzero(self._ended):
            return seen, *self._finish(seen, sight, figures, terminated, truncated)
        if self._info == "none":
            return seen, figures[REWARD], terminated, truncated, {}
        present = self._every if self._info == "all" else self._ended
        return seen, figures[REWARD], terminated, truncated, batch_infos(figures, present, present & busy)

    def _finish(
        self, seen: Observations, sight: Sight, figures: np.ndarray, terminated: np.ndarray, truncated: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Reset the worlds that have ended, in the step in which they have; what `step` returns beside observations."""
        ended, self._ended = self._ended, np.zeros_like(self._ended)
        final = figures.copy()
        infos = end_infos(batch_infos(final, ended, ended) if self._info != "none" else {}, seen, ended)
        self._restart(np.flatnonzero(ended).tolist(), sight, figures)
        if self._info == "all":
            infos |= batch_infos(figures, np.ones_like(ended), ~ended)
        return final[REWARD], terminated, truncated, infos

    def _run(self, actions: np.ndarray, idle: np.ndarray, sight: Sight, figures: np.ndarray) -> None:
        """Step all worlds that are not idle, on all threads."""
        worlds, count = self._worlds, self.num_envs
        threads = min(self._crew.threads, -(-count // TOGETHER))
        turns, scratch = np.zeros(threads + 1, np.int64), [worlds.scratch(thread) for thread in range(threads)]

        def work(thread: int) -> bool:
            return worlds.run(
                step_worlds, scratch[thread], actions, idle, sight, figures, 0, count, 0, ADVANCE, turns, thread
            )

        self._crew.run(work, threads)

    def _restart(self, indices: list[int], sight: Sight, figures: np.ndarray) -> None:
        """New episodes in these worlds, with their first observations and infos, and no reward."""
        self._begin(indices, [None] * self.num_envs, None)
        for index in indices:
            self.envs[index].measure()
            self._worlds.step_from(SHOW, sight, figures, index, index + 1, 0)

    def _measure(self, mask: np.ndarray) -> None:
        """Draw anew what the worlds of a mask bool[num_envs] measure wrong."""
        if self._worlds.noise is not None:
            for index in np.flatnonzero(mask):
                self.envs[index].measure()

    def _begin(self, indices: Sequence[int], seeds: Sequence[int | None], options: Any) -> None:
        """New episodes in these worlds; none at all if one of them is refused for its options."""
        if not options:
            for index in indices:
                self.envs[index].put(self.envs[index].begin(seeds[index]))
            return
        each = options if isinstance(options, list) else [options] * self.num_envs
        if len(each) != self.num_envs:
            raise ValueError(f"reset options are a list of {len(each)}; allowed: {self.num_envs}, or one for all")
        with ExitStack() as undo:
            for index in indices:
                undo.enter_context(self.envs[index].generator_kept_on_error())
            episodes = [self.envs[index].begin(seeds[index], each[index]) for index in indices]
        for index, episode in zip(indices, episodes, strict=True):
            self.envs[index].put(episode)

    def _are_out_of_time(self) -> np.ndarray:
        """Which worlds have had all their steps."""
        if self._most_steps is None:
            return np.zeros(self.num_envs, bool)
        return self._worlds.batch.episodes["totals"]["steps"] >= self._most_steps

    def _blanks(self) -> tuple[Observations, Sight]:
        """Arrays for the observations that are to be returned."""
        return self._kept or self._worlds.blanks()

    def _check_begun(self) -> None:
        """Raise ResetNeeded if a world has no episode, or one that is over and that nobody has reset."""
        if not self._begun:  # once all worlds have an episode, they always have one
            if None in self._worlds.layouts:
                raise ResetNeeded("Cannot call env.step() before calling env.reset()")
            self._begun = True
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            worlds = ", ".join(map(str, np.flatnonzero(self._ended)))
            raise ResetNeeded(
                f'the episodes of worlds {worlds} are over; allowed with autoreset_mode "{self.autoreset_mode.value}": '
                'to step after reset(options={"reset_mask": mask}) of those'
            )

    # Worlds one by one

    def copy_worlds(self, sources: int | Iterable[int], targets: int | Iterable[int]) -> None:
        """Let worlds `targets` go on as copies of worlds `sources`, one for one, or all of one; generators included.

            env.copy_worlds(0, [1, 2, 3])  # four ways to go on from world 0

        Ground and machine are copied, and the job too where the target has had another episode. ValueError, and
        nothing changes, for worlds that are not there or whose scenes differ.
        """
        sources, targets = self._read(sources, "sources"), self._read(targets, "targets")
        if len(sources) not in (1, len(targets)) or len(set(targets)) != len(targets):
            raise ValueError(
                f"{len(targets)} targets for {len(sources)} sources, targets {targets!r:.100}; "
                "allowed: one source for all targets or as many as targets, each target once"
            )
        sources = sources * len(targets) if len(sources) == 1 else sources
        self._worlds.copy(sources, targets)
        self._ended[targets] = self._ended[sources]
        twins = [
            (self.envs[source].np_random.bit_generator.state, self.envs[source].np_random_seed) for source in sources
        ]
        for target, (generator, seed) in zip(targets, twins, strict=True):
            self.envs[target].take_over(generator, seed)

    def get_state(self, indices: Iterable[int] | None = None) -> list[bytes]:
        """States of these worlds (all by default), as `DirtPushEnv.get_state` gives them."""
        return [self.envs[index].get_state() for index in self._read(indices, "indices")]

    def set_state(self, states: Sequence[bytes], indices: Iterable[int] | None = None) -> None:
        """Let these worlds (all by default) go on from states; ValueError, and nothing changes, if one is bad.

        A world that was at its episode's end is there again: it is reset next, where that is automatic.
        """
        indices = self._read(indices, "indices")
        if len(states) != len(indices) or len(set(indices)) != len(indices):
            raise ValueError(f"{len(states)} states for {len(indices)} worlds; allowed: one for each")
        read = [self.envs[index].read_state(state) for index, state in zip(indices, states, strict=True)]
        for index, parts in zip(indices, read, strict=True):
            self.envs[index].take_up(*parts)
        episodes = self._worlds.batch.episodes[indices]
        over = (episodes["finished"] == 1) & (episodes["totals"]["steps"] > 0)
        self._ended[indices] = over | self._are_out_of_time()[indices]

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of every world's `DirtPushEnv`, or read an attribute; results in the order of the worlds."""
        found = [getattr(env, name) for env in self.envs]
        return tuple(one(*args, **kwargs) if callable(one) else one for one in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of every world's `DirtPushEnv`."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every world's `DirtPushEnv`: a list or tuple has one value each, all else is for all."""
        each = values if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise ValueError(f"{name} gets {len(each)} values; allowed: {self.num_envs}, or one that is no list")
        for env, value in zip(self.envs, each, strict=True):
            setattr(env, name, value)

    def render(self) -> tuple[np.ndarray | None, ...]:
        """A picture of every world, see `DirtPushEnv.render`."""
        return self.call("render")

    def close_extras(self, **_: Any) -> None:
        """Close the windows, and let the threads go."""
        for env in self.envs:
            env.close()
        self._crew.close()

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """Every world's generator."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:
        """The seed of every world's generator."""
        return self.get_attr("np_random_seed")

    def _read(self, indices: int | Iterable[int] | None, name: str) -> list[int]:
        return read_indices(indices, self.num_envs, name)


def _mode(mode: AutoresetMode | str) -> AutoresetMode:
    """The autoreset mode of that value."""
    allowed = {one.value: one for one in AutoresetMode}
    found = mode if isinstance(mode, AutoresetMode) else allowed.get(mode if isinstance(mode, str) else "")
    if found is None:
        raise ValueError(f"autoreset_mode is {mode!r}; allowed: {', '.join(allowed)}")
    return found
