"""A trained policy in a file, and its network in numpy: nothing of what trained it is needed to run it.

The file is a .npz without pickles: the weights, and a JSON text `metadata` that says what observation they are for and
where they come from. The network: convolutions over the patch (ReLU); what they give, the pose and the overview (if it
is looked at) side by side through dense layers (tanh), the last of them the mean action, squashed to [-1, 1] as
`squash` says. It sees the last `frames` patches and poses, with `roots` the square roots of what is to do,
too, and with `mirror` all of it turned over where the goal lies to the right (agents/mirror.py).
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dirt_env.config import SceneConfig
from dirt_env.config.terrain import HeightField
from dirt_env.policy import Observation
from dirt_env.task.observation import POSE_ENTRIES
from dirt_env.task.site_map import OVERVIEW

from .archive import packed, unpacked
from .fineness import to_blade
from .frames import Frames, channel_places
from .mirror import Mirror
from .settings import LEAST_LEFT, MOST_FINENESS, OVERVIEW_GAIN, ROOT_GAIN

FORMAT = "dirt-push policy 1"
ACTIONS = 3
SQUASHES = {"clip": lambda values: np.clip(values, -1.0, 1.0), "tanh": np.tanh}  # PPO's mean action, and SAC's
# By files from before there was anything else.
MEANT = {"frames": 1, "squash": "clip", "roots": False, "mirror": False, "fineness": 0.0}


@dataclass(frozen=True)
class Convolution:
    """weight f4[filters, channels, k, k], bias f4[filters]; every `stride`-th window, no padding."""

    weight: np.ndarray
    bias: np.ndarray
    stride: int

    def __call__(self, images: np.ndarray) -> np.ndarray:
        """ReLU(weight * images + bias): f4[n, channels, rows, cols] to f4[n, filters, rows', cols']."""
        filters, _, size, _ = self.weight.shape
        windows = sliding_window_view(images, (size, size), axis=(2, 3))[:, :, :: self.stride, :: self.stride]
        count, _, rows, cols = windows.shape[:4]
        columns = windows.transpose(0, 2, 3, 1, 4, 5).reshape(count * rows * cols, -1)
        seen = np.maximum(columns @ self.weight.reshape(filters, -1).T + self.bias, 0.0)
        return seen.reshape(count, rows, cols, filters).transpose(0, 3, 1, 2)


@dataclass(frozen=True)
class Dense:
    """weight f4[out, in], bias f4[out]."""

    weight: np.ndarray
    bias: np.ndarray

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """weight values + bias: f4[n, in] to f4[n, out]."""
        return values @ self.weight.T + self.bias


@dataclass(frozen=True)
class Network:
    """Convolutions, hidden layers and the layer of actions; pose entries become (pose - mean) / scale, clipped.

    `roots` are the channels of the patch whose square roots are seen too, and if there are any, the overview's soil as
    `root_overview` has it.
    """

    convolutions: tuple[Convolution, ...]
    hidden: tuple[Dense, ...]
    action: Dense
    pose_mean: np.ndarray
    pose_scale: np.ndarray
    clip: float
    squash: str = "clip"
    roots: tuple[int, ...] = ()

    def actions(self, patch: np.ndarray, pose: np.ndarray, overview: np.ndarray | None) -> np.ndarray:
        """Actions f4[n, 3] in [-1, 1] for patches f4[n, f channels, P, P], poses f4[n, 15 f], overviews f4[n, 2, K, K].

        f is the number of frames.
        """
        if self.roots:
            patch = append_roots(patch, self.roots)
            overview = None if overview is None else root_overview(overview)
        for convolution in self.convolutions:
            patch = convolution(patch)
        pose = np.clip((pose - self.pose_mean) / self.pose_scale, -self.clip, self.clip)
        seen = [patch.reshape(len(patch), -1), pose]
        if overview is not None:
            seen.append(np.float32(OVERVIEW_GAIN) * overview.reshape(len(overview), -1))
        values = np.concatenate(seen, axis=1)
        for layer in self.hidden:
            values = np.tanh(layer(values))
        return SQUASHES[self.squash](self.action(values))


class LearnedPolicy:
    """Acts by a network that was trained; the same observations since `reset` give the same actions."""

    sees = "patch"

    def __init__(self, network: Network, metadata: Mapping[str, Any]) -> None:
        """`metadata["observation"]` and `["action"]`: the keys of the scene's tables that it was trained with."""
        self.network, self.metadata = network, metadata
        self.observation, self.action = dict(metadata["observation"]), dict(metadata["action"])
        self._frames, self._mirror = Frames(metadata["frames"]), Mirror(metadata["mirror"])

    def reset(self, seed: int | None = None) -> None:
        """Forget what was seen; nothing is drawn."""
        self._frames.forget()

    def act(self, observation: Observation) -> np.ndarray:
        """Action (3,) in [-1, 1]."""
        return self.act_all({name: array[None] for name, array in observation.items()})[0]

    def act_all(self, observations: Observation, begins: np.ndarray | None = None) -> np.ndarray:
        """Actions (n, 3) in [-1, 1] for the observations of a batch, the same n worlds until `reset`.

        `begins` bool[n] are the worlds in which an episode has ended and these are the first observations of the next.
        """
        self._check(observations)
        seen = self._mirror.show(self._frames.add(observations, begins))
        overview = seen["overview"] if self.observation.get("overview") else None
        actions = self.network.actions(seen["patch"], seen["pose"], overview)
        return to_blade(self._mirror.steer(actions), self.metadata["fineness"])

    def _check(self, observations: Observation) -> None:
        """Raise ValueError where this is not what it was trained with."""
        size, channels = self.observation["size"], len(self.observation["channels"])
        seen = {"patch": (channels, size, size)}
        if self.observation.get("overview"):
            seen["overview"] = (2, OVERVIEW, OVERVIEW)
        for name, shape in seen.items():
            found = observations[name].shape[1:] if name in observations else None
            if found != shape:
                raise ValueError(
                    f"{name} of the observation is {found or 'missing'}; allowed for this policy: {shape}, as in "
                    "DirtPushEnv(..., **dirt_env.policy.needed(policy))"
                )


def load(path: str | Path, config: SceneConfig) -> LearnedPolicy:
    """The policy of a file for a scene; raises ValueError where there is none, or where it is damaged or does not fit.

    Warns where the scene can have obstacles and the policy does not see them.
    """
    path = Path(path).expanduser()
    if not path.is_file():
        raise ValueError(f"policy {path} is no file; allowed: a policy.npz that training has written")
    try:
        policy = read(*unpacked(path, FORMAT))
        blade = policy.action["blade"]
    except (ValueError, TypeError, KeyError, ArithmeticError) as error:
        raise ValueError(f"policy {path} is damaged or no policy: {error}") from error
    if blade == "grade" and not isinstance(config.terrain, HeightField):
        raise ValueError(
            f'terrain is "{config.terrain.kind}"; allowed with policy {path.stem}, which needs grade control: '
            f'"{HeightField.kind}"'
        )
    if config.has_walls and "walls" not in policy.observation["channels"]:
        warnings.warn(f"{config.name} can have obstacles, and policy {path.stem} does not see them", stacklevel=2)
    return policy


def describe(path: Path) -> str:
    """What a policy's file says of itself, in a line."""
    training = unpacked(path, FORMAT)[1]["training"]
    settings = training["settings"]
    algorithm = settings.get("algorithm", "ppo").upper()  # files from before there was another do not say
    how = f"{algorithm}, {training['steps'] / 1e6:.1f} million steps, seed {training['seed']}"
    return f"Learned by {how}: {settings['description']}"


def read(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> LearnedPolicy:
    """The policy of these arrays; ValueError where they are not what the metadata says."""
    missing = [name for name in ("observation", "action", "strides", "hidden", "clip") if name not in metadata]
    if missing:
        raise ValueError(f"its metadata has no {' and no '.join(missing)}")
    metadata = {**MEANT, **metadata}
    frames, squash = metadata["frames"], metadata["squash"]
    if squash not in SQUASHES:
        raise ValueError(f"its squash is {squash!r}; allowed: {', '.join(SQUASHES)}")
    if metadata["mirror"] not in (False, True):
        raise ValueError(f"its mirror is {metadata['mirror']!r}; allowed: true, false")
    if not (isinstance(metadata["fineness"], int | float) and 0.0 <= metadata["fineness"] <= MOST_FINENESS):
        raise ValueError(f"its fineness is {metadata['fineness']!r}; allowed: a number from 0 to {MOST_FINENESS:g}")
    strides, observation = metadata["strides"], metadata["observation"]
    if metadata["roots"] not in (False, True) or (metadata["roots"] and "todo" not in observation["channels"]):
        raise ValueError(
            f"its roots are {metadata['roots']!r} with channels {observation['channels']}; allowed: true with "
            '"todo" among them, or false'
        )
    channels, size, entries = frames * len(observation["channels"]), observation["size"], frames * len(POSE_ENTRIES)
    roots = channel_places("todo", observation["channels"], frames) if metadata["roots"] else ()
    channels += len(roots)
    convolutions = []
    for number, stride in enumerate(strides):
        weight = _array(arrays, f"conv{number}.weight", (None, channels, None, None))
        channels, kernel = weight.shape[0], weight.shape[2]
        size = (size - kernel) // stride + 1
        convolutions.append(Convolution(weight, _array(arrays, f"conv{number}.bias", (channels,)), stride))
    overview = 2 * OVERVIEW**2 if observation.get("overview") else 0
    width, hidden = channels * size * size + entries + overview, []
    for number in range(metadata["hidden"]):
        weight = _array(arrays, f"hidden{number}.weight", (None, width))
        width = weight.shape[0]
        hidden.append(Dense(weight, _array(arrays, f"hidden{number}.bias", (width,))))
    action = Dense(_array(arrays, "action.weight", (ACTIONS, width)), _array(arrays, "action.bias", (ACTIONS,)))
    mean, scale = (_array(arrays, f"pose.{name}", (entries,)) for name in ("mean", "scale"))
    network = Network(tuple(convolutions), tuple(hidden), action, mean, scale, float(metadata["clip"]), squash, roots)
    return LearnedPolicy(network, metadata)


def written(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> bytes:
    """A file's content: the same arrays and metadata give the same bytes."""
    return packed(arrays, {"format": FORMAT, **metadata}, compressed=True)


def append_roots(patch: np.ndarray, channels: Sequence[int]) -> np.ndarray:
    """f4[n, C, P, P] and behind it, for each of those channels c, sign(c) sqrt(|c|): f4[n, C + len(channels), P, P]."""
    depths = patch[:, list(channels)]
    return np.concatenate([patch, np.sign(depths) * np.sqrt(np.abs(depths))], axis=1)


def root_overview(overview: np.ndarray) -> np.ndarray:
    """f4[n, 2, K, K] with ROOT_GAIN sqrt(s / max(sum of all s, LEAST_LEFT)) for each square's share s of the soil.

    That is the square root of its share of what is left. Negative shares count as 0.
    """
    soil = np.maximum(overview[:, :1], np.float32(0.0))
    left = np.maximum(soil.sum(axis=(2, 3), keepdims=True), np.float32(LEAST_LEFT))
    return np.concatenate([np.float32(ROOT_GAIN) * np.sqrt(soil / left), overview[:, 1:]], axis=1)


def _array(arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """A finite f4 array of that shape, in which None is any size."""
    if name not in arrays:
        raise ValueError(f"{name} is missing")
    array = arrays[name]
    fits = len(array.shape) == len(shape) and all(b in (None, a) for a, b in zip(array.shape, shape, strict=True))
    if not fits or array.dtype != np.float32 or not np.isfinite(array).all():
        raise ValueError(f"{name} is {array.dtype}{list(array.shape)}; allowed: finite float32{list(shape)}")
    return array
