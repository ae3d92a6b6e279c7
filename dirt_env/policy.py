"""What acts: the protocol of policies, and the scripted ones by name."""

from collections.abc import Mapping
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Literal, Protocol

import numpy as np

from dirt_env.config import SceneConfig

PACKAGE = "dirt_env.baselines"
Observation = Mapping[str, np.ndarray]


class Policy(Protocol):
    """Anything that acts.

    `sees` says what it looks at, so that comparisons stay honest: "patch" (what the machine sees itself: `patch`,
    `pose`, `overview`), "map" (the whole site; made with observation={"map": True}), or "nothing".
    """

    sees: Literal["map", "patch", "nothing"]

    def reset(self, seed: int | None = None) -> None:
        """Start an episode; all that is random in it follows from the seed."""

    def act(self, observation: Observation) -> np.ndarray:
        """Action (3,) in [-1, 1] for an observation of `DirtPush-v0`."""


def load_policy(name: str, config: SceneConfig) -> Policy:
    """The scripted behaviour of that name for a scene: `make(config)` of the module `dirt_env.baselines.NAME`."""
    return _module(name).make(config)


def policy_names() -> tuple[str, ...]:
    """Names of the scripted behaviours."""
    modules = iter_modules(import_module(PACKAGE).__path__)
    return tuple(sorted(module.name for module in modules if not module.ispkg))


def describe_policy(name: str) -> str:
    """What a scripted behaviour does, in a line."""
    return (_module(name).__doc__ or "").strip().partition("\n")[0]


def _module(name: str) -> ModuleType:
    known = policy_names()
    if name not in known:
        raise ValueError(f"policy is {name!r}; known: {', '.join(known)}")
    return import_module(f"{PACKAGE}.{name}")
