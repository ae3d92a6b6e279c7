"""What acts: the protocol of policies, and how they are named.

Scripted ones and the trained ones that are shipped (ppo, ppo_seed0 and so on) have names; a scripted one with numbers
of your own is `NAME@FILE.toml`, one that you trained its .npz file, one of your own `module:attribute`.
"""

import sys
import traceback
from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from inspect import signature
from os import getcwd
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, Literal, Protocol

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.config.loading import merge

PACKAGE = "dirt_env.baselines"
NETWORK = "dirt_env.agents.network"  # reads what training has written
AGENTS, TRAINED = "dirt_env.agents", ".npz"
SEES = ("map", "patch", "nothing")
OWN_NUMBERS = "@"  # between a behaviour's name and the file with its numbers
OTHERS = "NAME@FILE.toml with numbers of your own; a .npz file of training; or your own as module:attribute"
FORM = "allowed: module:attribute, a class or function that is called with the scene's config, as in my_rules:MyPush"
Observation = Mapping[str, np.ndarray]


class Policy(Protocol):
    """Anything that acts.

    `sees` says what it looks at, so that comparisons stay honest: "patch" (what the machine sees itself: `patch`,
    `pose`, `overview`), "map" (the whole site; made with observation={"map": True}), or "nothing".

    `observation` and `action`, if it has them, are mappings with the keys of the scene's tables of these names that it
    needs, such as {"size": 24}; `dirt-push run` and `evaluate` give it what it needs.

    A policy of your own is named `module:attribute`: a class, or a function such as `make`, that is called with the
    `SceneConfig` and gives the policy. The module may be a file in the current folder. An evaluation makes a new
    policy for every episode.
    """

    sees: Literal["map", "patch", "nothing"]

    def reset(self, seed: int | None = None) -> None:
        """Start an episode; all that is random in it follows from the seed."""

    def act(self, observation: Observation) -> np.ndarray:
        """Action (3,) in [-1, 1] for an observation of `DirtPush-v0`."""


def load_policy(name: str, config: SceneConfig) -> Policy:
    """The policy of that name for a scene.

    That is a scripted behaviour, one with numbers from a file (`NAME@FILE.toml`), a trained policy that is shipped,
    such as ppo, or one in a .npz file, or `module:attribute`.

    Raises ValueError for a name that is not known, or something that is no policy, and ImportError for a module that
    cannot be imported, with a sentence that helps.
    """
    if (file := trained_file(name)) is not None:
        return import_module(NETWORK).load(file, config)
    if OWN_NUMBERS in name:
        return _with_own_numbers(name, config)
    if ":" not in name:
        return _module(name).make(config)
    maker = _maker(name)
    try:
        signature(maker).bind(config)
    except (TypeError, ValueError) as error:
        raise ValueError(f"policy {name} cannot be called with a config: {error}; {FORM}") from None
    try:
        policy = maker(config)
    except Exception as error:
        raise ValueError(f"policy {name} cannot be made: {complaint(error)}") from error
    return _checked(name, policy)


def needed(policy: Policy) -> dict[str, dict[str, Any]]:
    """The scene's tables that make an environment show what the policy looks at, and take its actions as it means them.

    `DirtPushEnv(scene="heap", **needed(policy))` is the environment for it.
    """
    seen = {**getattr(policy, "observation", {}), **({"map": True} if policy.sees == "map" else {})}
    tables = {"observation": seen, "action": dict(getattr(policy, "action", {}))}
    return {name: table for name, table in tables.items() if table}


def overrides_for(name: str, policy: Policy, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """A scene's overrides with what the policy of that name needs; ValueError where they ask for something else."""
    check_needs(name, policy, overrides)
    return merge(overrides, needed(policy))


def check_needs(name: str, policy: Policy, overrides: Mapping[str, Any]) -> None:
    """Raise ValueError where overrides of a scene ask for something else than the policy of that name needs."""
    for table, keys in needed(policy).items():
        given = overrides.get(table)
        for key, value in keys.items():
            if isinstance(given, Mapping) and given.get(key, value) != value:
                raise ValueError(
                    f"{table}.{key} is {given[key]!r}; allowed with policy {name}, which needs it: {value!r}"
                )


def policy_names() -> tuple[str, ...]:
    """Names of the scripted behaviours and of the trained policies that are shipped."""
    modules = iter_modules(import_module(PACKAGE).__path__)
    scripted = (module.name for module in modules if not module.ispkg)
    return tuple(sorted([*scripted, *(path.stem for path in _shelf().glob(f"*{TRAINED}"))]))


def describe_policy(name: str) -> str:
    """What a policy that is shipped does, in a line."""
    if (file := trained_file(name)) is not None:
        return import_module(NETWORK).describe(file)
    return (_module(name).__doc__ or "").strip().partition("\n")[0]


def trained_file(name: str) -> Path | None:
    """The file of a trained policy, by its path or by the name under which it is shipped; None for other policies."""
    if name.endswith(TRAINED):
        return Path(name).expanduser()
    shipped = _shelf() / f"{name}{TRAINED}"
    return shipped if name.isidentifier() and shipped.is_file() else None


def _shelf() -> Path:
    """Where the trained policies lie that are shipped."""
    return Path(import_module(AGENTS).__path__[0]) / "policies"


def policy_file(name: str) -> Path | None:
    """The file that a trained policy, one of somebody's own or its numbers are in; None for what is scripted."""
    if (file := trained_file(name)) is not None:
        return file
    if OWN_NUMBERS in name:
        return Path(name.partition(OWN_NUMBERS)[2]).expanduser()
    if ":" not in name:
        return None
    found = getattr(_own_module(name), "__file__", None)
    return None if found is None else Path(found)


def _with_own_numbers(name: str, config: SceneConfig) -> Policy:
    """The scripted behaviour of `NAME@FILE.toml`."""
    behaviour, _, file = name.partition(OWN_NUMBERS)
    able = [other for other in policy_names() if trained_file(other) is None and _has_numbers(other)]
    if behaviour not in able:
        raise ValueError(f"policy {name}: {behaviour or 'nothing'} has no numbers; allowed: {', '.join(able)}")
    if not file:
        raise ValueError(f"policy {name}: there is no file after {OWN_NUMBERS}; allowed: NAME@FILE.toml")
    return _module(behaviour).make(config, file)


def _has_numbers(behaviour: str) -> bool:
    return "numbers" in signature(_module(behaviour).make).parameters


def _module(name: str) -> ModuleType:
    known = policy_names()
    if name not in known:
        raise ValueError(f"policy is {name!r}; known: {', '.join(known)}; {OTHERS}")
    return import_module(f"{PACKAGE}.{name}")


def _maker(name: str) -> Any:
    """What makes the policy `module:attribute`."""
    module, (_, _, attribute) = _own_module(name), name.partition(":")
    if not hasattr(module, attribute):
        names = [key for key, value in vars(module).items() if callable(value) and key[0] != "_"]
        where = f"{module.__name__} ({getattr(module, '__file__', 'built in')})"
        raise ValueError(
            f"policy {name}: {where} has no {attribute!r}; it has: {', '.join(names) or 'nothing to call'}"
        )
    maker = getattr(module, attribute)
    if not callable(maker):
        raise ValueError(f"policy {name} is a {type(maker).__name__}; {FORM}")
    return maker


def _own_module(name: str) -> ModuleType:
    """The module of `module:attribute`, looked up where Python looks and then in the current folder."""
    module, _, attribute = name.partition(":")
    if module.endswith(".py"):
        raise ValueError(f"policy is {name!r}; allowed: without .py, as in {Path(module).stem}:{attribute or 'MyPush'}")
    if not attribute.isidentifier() or not all(part.isidentifier() for part in module.split(".")):
        raise ValueError(f"policy is {name!r}; {FORM}")
    if getcwd() not in sys.path:
        sys.path.append(getcwd())
    try:
        if find_spec(module) is None:
            raise ImportError(f"policy {name}: no module {module!r}, neither installed nor in {getcwd()}")
        return import_module(module)
    except ModuleNotFoundError as error:
        raise ImportError(f"policy {name}: {error}") from None
    except ImportError:
        raise
    except Exception as error:
        raise ImportError(f"policy {name}: {complaint(error)}") from error


def complaint(error: BaseException) -> str:
    """What went wrong in somebody's code and where, in a line."""
    if isinstance(error, SyntaxError):
        return f"{type(error).__name__}: {error}"
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return " ".join(f"{type(error).__name__}: {error}".split()) + where


def _checked(name: str, policy: Any) -> Policy:
    """The policy, if it is one; else raises ValueError."""
    missing = [method for method in ("reset", "act") if not callable(getattr(policy, method, None))]
    if missing:
        kind = type(policy).__name__
        raise ValueError(
            f"policy {name} gives a {kind} without {' and '.join(missing)}; allowed: reset(seed), act(obs)"
        )
    if (sees := getattr(policy, "sees", None)) not in SEES:
        raise ValueError(f"policy {name}: its `sees` is {sees!r}; allowed: {', '.join(map(repr, SEES))}")
    for table in ("observation", "action"):
        if not isinstance(value := getattr(policy, table, {}), Mapping):
            raise ValueError(f"policy {name}: its `{table}` is {value!r}; allowed: a mapping of keys")
    return policy
