"""A training run as one file that is either the old or the new one, and from which it goes on to the same last bit.

Weights, optimisers, the buffer of SAC, running statistics, random generators, worlds in mid-episode, curriculum and
counters; with the settings, versions and seed. A .npz without pickles, so that reading one runs no code.
"""

import json
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from stable_baselines3.common.vec_env import VecNormalize

from dirt_env import __version__
from dirt_env.render.atomic import write_atomically

from .algorithms import Model, under
from .archive import packed, unpacked
from .course import Course
from .settings import Settings, flattened

FORMAT = "dirt-push checkpoint 1"
RUNNING = ("mean", "var", "count")
NEEDED = ("settings", "versions", "steps", "updates", "stage", "judged", "numpy", "notes")  # of the metadata
KEPT = ("begins", "torch", "numpy")  # arrays, beside those that are kept under the names of what they belong to


def versions() -> dict[str, str]:
    """Versions of what computes."""
    libraries = ("numpy", "numba", "gymnasium", "torch", "stable_baselines3")
    return {
        "python": platform.python_version(),
        "dirt_env": __version__,
        **{name: version(name) for name in libraries},
    }


class Checkpoint(NamedTuple):
    """What a file holds: `metadata` as plain values, and arrays by name."""

    metadata: dict[str, Any]
    arrays: dict[str, np.ndarray]

    def other_versions(self) -> list[str]:
        """What has another version here than where the file was written, as `torch 2.13.0 (2.12.0 there)`."""
        here, there = versions(), self.metadata["versions"]
        return [f"{name} {here[name]} ({there.get(name)} there)" for name in here if here[name] != there.get(name)]


def save(path: Path, settings: Settings, model: Model, env: VecNormalize, course: Course, notes: Mapping) -> None:
    """Write the run's state; `notes` are plain values of the trainer's own."""
    generator = np.random.get_state(legacy=False)  # noqa: NPY002  stable-baselines3 draws from it
    state = course.state()
    metadata = {
        "format": FORMAT,
        "settings": settings.to_dict(),
        "versions": versions(),
        "seed": settings.seed,
        "steps": model.num_timesteps,
        "updates": model._n_updates,
        "scene": course.scene,
        "stage": course.number,
        "judged": state.pop("judged"),
        "numpy": {**generator, "state": {"pos": generator["state"]["pos"]}},
        "notes": dict(notes),
    }
    arrays = {f"policy/{name}": tensor.cpu().numpy() for name, tensor in model.policy.state_dict().items()}
    for owner, optimiser in model.optimisers().items():
        for index, moments in optimiser.state_dict()["state"].items():
            arrays |= {f"{owner}/{index}/{name}": value.cpu().numpy() for name, value in moments.items()}
    arrays |= {f"own/{name}": array for name, array in model.own_state().items()}
    arrays |= {f"worlds/{name}": array for name, array in state.items()}
    arrays |= {f"seen/{name}": array for name, array in model._last_obs.items()}
    arrays |= {f"running/{name}": array for name, array in _running(env).items()}
    arrays["begins"] = model._last_episode_starts
    arrays["torch"] = torch.get_rng_state().numpy()
    arrays["numpy"] = generator["state"]["key"]
    if torch.cuda.is_available() and model.device.type == "cuda":
        arrays["cuda"] = torch.cuda.get_rng_state(model.device).numpy()
    write_atomically(path, packed(arrays, metadata))


def read(path: Path) -> Checkpoint:
    """What the file holds; raises ValueError where it is damaged or of another version."""
    try:
        arrays, metadata = unpacked(path, FORMAT)
        if missing := [name for name in NEEDED if name not in metadata] + [name for name in KEPT if name not in arrays]:
            raise ValueError(f"it has no {' and no '.join(missing)}")
        if not 0 <= metadata["stage"] < len(metadata["settings"]["stage"]):
            raise ValueError(f"its stage is {metadata['stage']}, of {len(metadata['settings']['stage'])}")
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"checkpoint {path} is damaged: {error}; allowed: --fresh, or another --out") from error
    return Checkpoint(metadata, arrays)


def agree(found: Checkpoint, settings: Settings, path: Path) -> None:
    """Raise ValueError that names what differs, if the checkpoint is of a run with other settings."""
    here = json.loads(json.dumps(settings.to_dict()))
    wanted, kept = flattened(here), flattened(found.metadata["settings"])
    other = [key for key in {**wanted, **kept} if kept.get(key) != wanted.get(key)]
    if other:
        differences = "; ".join(f"{key} is {wanted.get(key)!r} here and {kept.get(key)!r} there" for key in other[:4])
        differences += f"; and {len(other) - 4} more" if len(other) > 4 else ""
        raise ValueError(
            f"{path} is of a run with other settings: {differences}; allowed: the same, --fresh to begin anew, "
            "or another --out"
        )


def agree_on_scene(found: Checkpoint, course: Course, path: Path) -> None:
    """Raise ValueError that names what has changed, if the scene or a file that it names is another one by now."""
    here = course.scene
    there = found.metadata.get("scene", here)  # files from before it was kept do not say
    if changed := [name for name in {**here, **there} if here.get(name) != there.get(name)]:
        raise ValueError(
            f"{path} is of a run in another scene: {', '.join(changed)} has changed since; allowed: as it was, --fresh "
            "to begin anew, or another --out"
        )


def restore(found: Checkpoint, model: Model, env: VecNormalize, course: Course) -> None:
    """Let a model and worlds that were made by the same settings, at the same stage, go on from a checkpoint."""
    metadata, arrays = found
    worlds = under(arrays, "worlds/")
    course.set_state({**worlds, "judged": metadata["judged"]})
    model.policy.load_state_dict({name: torch.from_numpy(array) for name, array in under(arrays, "policy/").items()})
    for owner, optimiser in model.optimisers().items():
        _restore_optimiser(optimiser, under(arrays, f"{owner}/"))
    model.set_own_state(under(arrays, "own/"))
    model.num_timesteps, model._n_updates = metadata["steps"], metadata["updates"]
    model._last_obs, model._last_episode_starts = under(arrays, "seen/"), arrays["begins"]
    for name, array in under(arrays, "running/").items():
        where, _, part = name.partition(".")
        holder = {"env": env, "returns": env.ret_rms, "pose": getattr(env, "obs_rms", {}).get("pose")}[where]
        setattr(holder, part, float(array) if array.ndim == 0 else array)
    kept = metadata["numpy"]
    np.random.set_state({**kept, "state": {"key": arrays["numpy"], "pos": kept["state"]["pos"]}})  # noqa: NPY002
    torch.set_rng_state(torch.from_numpy(arrays["torch"]))
    if "cuda" in arrays and model.device.type == "cuda":
        torch.cuda.set_rng_state(torch.from_numpy(arrays["cuda"]), model.device)


def _restore_optimiser(optimiser: torch.optim.Optimizer, arrays: Mapping[str, np.ndarray]) -> None:
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name, array in arrays.items():
        index, _, moment = name.partition("/")
        state.setdefault(int(index), {})[moment] = torch.from_numpy(array)
    optimiser.load_state_dict({"state": state, "param_groups": optimiser.state_dict()["param_groups"]})


def _running(env: VecNormalize) -> dict[str, np.ndarray]:
    """The running statistics, by owner and name."""
    owners = {"returns": env.ret_rms, **({"pose": env.obs_rms["pose"]} if env.norm_obs else {})}
    found = {f"{name}.{part}": np.asarray(getattr(owner, part)) for name, owner in owners.items() for part in RUNNING}
    return {**found, "env.returns": env.returns}
