"""What callers pass to environments, read and checked: ValueError names what is wrong and what is allowed."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from dirt_env.config.loading import TOP_LEVEL
from dirt_env.config.rules import known_keys

RESET_OPTIONS = ("layout_seed", "pose")


class UnknownArgumentError(ValueError, TypeError):
    """No scene has this argument: bad input, and what Python says of it to those who try arguments out, as TorchRL."""


def check_known(overrides: Mapping[str, Any]) -> None:
    """Raise UnknownArgumentError for keyword arguments that no scene has as a table or key."""
    try:
        known_keys(overrides, "", dict.fromkeys(TOP_LEVEL))
    except ValueError as error:
        name = next(name for name in overrides if name not in TOP_LEVEL)
        raise UnknownArgumentError(f"{error} (unexpected keyword argument '{name}')") from None


def read_options(options: dict[str, Any] | None) -> tuple[int | None, tuple[float, float, float] | None]:
    """The reset options layout_seed and pose; raises ValueError for any other."""
    if options is None:
        return None, None
    if not isinstance(options, Mapping):
        raise ValueError(f"reset options are {options!r}; allowed: None or a mapping of {', '.join(RESET_OPTIONS)}")
    _check_known(options, RESET_OPTIONS)
    seed, pose = options.get("layout_seed"), options.get("pose")
    if seed is not None and (not _is_whole(seed) or seed < 0):
        raise ValueError(f"reset option layout_seed is {seed!r}; allowed: an integer >= 0")
    return seed, None if pose is None else _read_pose_option(pose)


def _check_known(options: Mapping[str, Any], known: Sequence[str]) -> None:
    for name in options:
        if name not in known:
            raise ValueError(f"reset option {name!r} is unknown; known: {', '.join(known)}")


def _read_pose_option(pose: Any) -> tuple[float, float, float]:
    """The reset option pose; raises ValueError if it is not three finite numbers."""
    try:
        values = np.asarray(pose, np.float64)
    except (ArithmeticError, TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"reset option pose is {pose!r}; allowed: x m, y m, heading rad")
    return tuple(values.tolist())


def read_mask(options: Any, worlds: int) -> tuple[np.ndarray, Any]:
    """Which worlds of a batch to reset, bool[worlds], from the reset option reset_mask; and the other options."""
    if isinstance(options, Mapping):
        _check_known(options, (*RESET_OPTIONS, "reset_mask"))
    if not isinstance(options, Mapping) or "reset_mask" not in options:
        return np.ones(worlds, bool), options
    mask = options["reset_mask"]
    fine = isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (worlds,) and mask.any()
    if not fine:
        raise ValueError(f"reset option reset_mask is {mask!r:.100}; allowed: an array bool[{worlds}], not all False")
    return mask.copy(), {name: value for name, value in options.items() if name != "reset_mask"}


def read_seeds(seed: Any, worlds: int) -> list[int | None]:
    """The seed of every world of a batch: of one number, that and the next ones."""
    if seed is None:
        return [None] * worlds
    seeds = [seed + index for index in range(worlds)] if _is_whole(seed) else seed
    fine = isinstance(seeds, Sequence | np.ndarray) and not isinstance(seeds, str) and len(seeds) == worlds
    if not fine or not all(one is None or (_is_whole(one) and one >= 0) for one in seeds):
        raise ValueError(f"seed is {seed!r:.100}; allowed: None, an integer >= 0, or a list of {worlds} of them")
    return [None if one is None else int(one) for one in seeds]


def read_indices(indices: int | Iterable[int] | None, worlds: int, name: str) -> list[int]:
    """Numbers of worlds, of a number, of several or of a mask bool[worlds]; None is all."""
    if indices is None:
        return list(range(worlds))
    found = np.asarray(list(indices) if isinstance(indices, Iterable) else [indices])
    if found.dtype == np.bool_ and found.shape == (worlds,):
        return np.flatnonzero(found).tolist()
    if found.size and (found.ndim != 1 or found.dtype.kind not in "iu" or found.min() < 0 or found.max() >= worlds):
        allowed = f"numbers from 0 to {worlds - 1}, or a mask bool[{worlds}]"
        raise ValueError(f"{name} are {found.tolist()!r:.100}; allowed: {allowed}")
    return found.tolist()


def read_count(name: str, value: Any, more: str = "") -> int:
    """A whole number from 1."""
    if not _is_whole(value) or value < 1:
        raise ValueError(f"{name} is {value!r}; allowed: a whole number from 1{more}")
    return int(value)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)
