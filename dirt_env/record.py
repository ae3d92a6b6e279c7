"""`dirt-push record`: episodes of a policy as a data set of Minari, which plays again to the same last bit."""

import os
import shutil
import signal
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, NamedTuple, Self

import gymnasium
import minari
import numpy as np
from minari.data_collector.episode_buffer import EpisodeBuffer
from minari.dataset.minari_dataset import parse_dataset_id
from minari.dataset.minari_storage import MinariStorage

from dirt_env import __version__
from dirt_env.config import load
from dirt_env.config.loading import merge
from dirt_env.env import DirtPushEnv
from dirt_env.policy import check_needs, load_policy, needed
from dirt_env.progress import Progress
from dirt_env.task.reward import TERMS

FORM = "[NAMESPACE/]NAME-vNUMBER, of letters, digits, _ and -, the namespace of two or more: heap/adaptive_push-v0"


class Told(NamedTuple):
    """What came of one recorded episode."""

    seed: int
    steps: int
    share_in_goal: float
    is_success: bool


class DataSet:
    """A data set under way, in a hidden folder beside its place; it is either moved there as a whole, or goes.

    Used in a `with`: what is not kept by its end is removed.
    """

    def __init__(self, root: Path, name: str, env: gymnasium.Env) -> None:
        """Begin the data set `name` in the folder `root`, of what `env` shows; ValueError for a bad or taken name."""
        self.name, self.place = name, place_of(root, name)
        self._folder = Path(mkdtemp(dir=root.absolute(), prefix=".recording-"))  # Minari loses files of relative ones
        spaces = env.observation_space, env.action_space
        self._storage = MinariStorage.new(self._folder / "data", *spaces, env_spec=env.spec)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: Any) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)

    def add(self, episode: EpisodeBuffer) -> None:
        """Write an episode."""
        self._storage.update_episodes([episode])

    def keep(self, notes: Mapping[str, Any]) -> float:
        """Give the data set its notes and move it to its place; returns its size in MB."""
        with _undisturbed():
            named = {"dataset_id": self.name, "minari_version": minari.__version__}
            self._storage.update_metadata({**notes, **named})
            self._storage.update_episode_metadata(self._storage.apply(_return_of))
            size = float(self._storage.get_size())
            self._folder.chmod(0o755)
            self.place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(self._folder, self.place)
        return size


class Recording:
    """Episodes of a policy in a scene, on the layouts `seeds`, at most `steps` each (default: the job's time).

    What is recorded is the observation of the scene. What the policy sees besides, such as the map, is not, unless
    the scene itself shows it: `overrides` with observation.map. Actions are what the policy means by them: where it
    needs another table `action`, the data set's environment has that.
    """

    def __init__(
        self,
        scene: str,
        policy: str,
        seeds: Sequence[int],
        steps: int | None = None,
        overrides: Mapping[str, Any] | None = None,
    ) -> None:
        """Read scene and policy; raises ValueError or ImportError with a sentence that helps.

        ValueError, too, where `overrides` ask for another table `action` than the policy needs.
        """
        given, self.policy_name, self.seeds = overrides or {}, policy, seeds
        self.policy = load_policy(policy, load(scene, **given))
        tables = needed(self.policy)
        meant = {name: table for name, table in tables.items() if name == "action"}
        check_needs(policy, self.policy, {name: given[name] for name in meant if name in given})
        self.config, seen = (load(scene, **merge(given, changes)) for changes in (meant, tables))
        self.steps = steps or self.config.steps
        # All of the scene goes into the data set, so it can be played again where the scene's file has changed.
        options = {"scene": self.config.to_dict(), "max_episode_steps": self.steps}
        self.env = gymnasium.make("dirt_env:DirtPush-v0", disable_env_checker=True, **options)
        # The same world, as the policy sees it.
        self._eyes = None if seen == self.config else DirtPushEnv(scene=scene, **merge(given, tables))
        self.told: list[Told] = []
        self.interrupted = False

    def play(self, data: DataSet) -> None:
        """Play the episodes into the data set; Ctrl-C drops the one that is being played."""
        progress = Progress(len(self.seeds) * self.steps)
        try:
            progress.show(0, "starting; the first run compiles the kernels")
            for seed in self.seeds:
                episode, told = self._episode(seed, progress)
                with _undisturbed():
                    data.add(episode)
                    self.told.append(told)
        except KeyboardInterrupt:
            self.interrupted = True
        finally:
            progress.clear()

    def notes(self) -> dict[str, Any]:
        """What the data set says of its origin."""
        return {
            "algorithm_name": self.policy_name,
            "description": f"{self.policy_name} in {self.config.name}: {self.config.description}",
            "requirements": [f"dirt-push=={__version__}"],
        }

    def _episode(self, seed: int, progress: Progress) -> tuple[EpisodeBuffer, Told]:
        """One episode, and what came of it. Actions are played as they are kept: clipped, as float32."""
        observation, info = self.env.reset(seed=seed)
        seen = observation if self._eyes is None else self._eyes.reset(seed=seed)[0]
        self.policy.reset(seed)
        observations, infos = [observation], [{**info, "reward": dict.fromkeys(TERMS, 0.0)}]
        actions, rewards, ends = [], [], []
        done, label = False, f"episode {len(self.told) + 1} of {len(self.seeds)}"
        while not done:
            words = f"{label}, {info['share_in_goal']:.0%} in the goal"
            progress.show(len(self.told) * self.steps + len(actions), words)
            action = np.clip(np.asarray(self.policy.act(seen), np.float32), -1.0, 1.0)
            observation, reward, terminated, truncated, info = self.env.step(action)
            seen = observation if self._eyes is None else self._eyes.step(action)[0]
            observations.append(observation)
            infos.append(info)
            actions.append(action)
            rewards.append(reward)
            ends.append((terminated, truncated))
            done = terminated or truncated
        columns = [np.array(column) for column in (actions, rewards, *zip(*ends, strict=True))]
        told = Told(seed, len(rewards), info["share_in_goal"], info["is_success"])
        return EpisodeBuffer(None, seed, None, _stacked(observations), *columns, _stacked(infos)), told


def place_of(root: Path, name: str) -> Path:
    """Where the data set `name` lies in the folder `root`; ValueError for what is no name, or is taken."""
    try:
        parse_dataset_id(name)
    except (TypeError, ValueError):  # a TypeError for a name without a version
        raise ValueError(f"--dataset is {name!r}; allowed: {FORM}") from None
    if (root / name).exists():
        raise ValueError(f"--dataset is {name!r}, and {root / name} is there; allowed: a new name, or a next version")
    return root / name


def _stacked(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Arrays with a row for each of the mappings, by name."""
    first = rows[0]
    return {
        name: _stacked([row[name] for row in rows])
        if isinstance(first[name], Mapping)
        else np.array([row[name] for row in rows])
        for name in first
    }


def _return_of(episode: Mapping[str, Any]) -> dict[str, float]:
    """What Minari keeps of each episode beside its arrays."""
    rewards = episode["rewards"]
    figures = {"sum": rewards.sum(), "mean": rewards.mean(), "std": rewards.std()}
    figures |= {"max": rewards.max(), "min": rewards.min()}
    return {f"rewards_{name}": float(value) for name, value in figures.items()}


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Meanwhile Ctrl-C waits."""
    caught = []
    before = signal.signal(signal.SIGINT, lambda *_: caught.append(True))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if caught:
        raise KeyboardInterrupt
