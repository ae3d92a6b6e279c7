"""The scenes of a batch: one for each world, different in their numbers, alike in what the arrays are made of."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dirt_env.config import SceneConfig, load
from dirt_env.config.loading import merge
from dirt_env.config.terrain import HeightField


def configs_for(count: int, scene: Any, variants: Any, overrides: Mapping[str, Any]) -> tuple[SceneConfig, ...]:
    """The scene of each of `count` worlds; ValueError where they cannot be in one batch.

    World i has the scene i of the list `scene` (or the only one), with `overrides` and then those of variant i merged
    over it; both lists begin anew where they end.
    """
    scenes = scene if isinstance(scene, list | tuple) else [scene]
    others = [{}] if variants is None else variants
    for name, values in (("scene", scenes), ("variants", others)):
        if not isinstance(values, Sequence) or isinstance(values, str) or not 1 <= len(values) <= count:
            raise ValueError(f"{name} is {values!r:.100}; allowed: a list of 1 to {count} (num_envs) entries")
    for index, variant in enumerate(others):
        if not isinstance(variant, Mapping):
            raise ValueError(
                f"variants[{index}] is {variant!r:.100}; allowed: tables and keys of a scene, in a mapping"
            )
    pairs = [(i % len(scenes), i % len(others)) for i in range(count)]
    known = {(s, v): load(scenes[s], **merge(overrides, others[v])) for s, v in dict.fromkeys(pairs)}
    check_alike([(f"world {i} (scene {_name(scenes[s])})", known[s, v]) for i, (s, v) in enumerate(pairs)])
    return tuple(known[pair] for pair in pairs)


def check_alike(named: Sequence[tuple[str, SceneConfig]]) -> None:
    """Raise ValueError that names both, if two scenes differ in what the arrays of a batch are made of."""
    first_name, first = named[0]
    expected = features(first)
    for config in dict.fromkeys(config for _, config in named):
        if not isinstance(config.terrain, HeightField):
            raise ValueError(
                f'terrain is "{config.terrain.kind}"; allowed in a native batch: "{HeightField.kind}", and any with '
                'gymnasium.make_vec(..., vectorization_mode="sync")'
            )
        for feature, value in features(config).items():
            if value != expected[feature]:
                name = next(name for name, other in named if other == config)
                raise ValueError(
                    f"{name} has {feature} {value}, and {first_name} has {expected[feature]}; allowed in one batch: "
                    "the same in all worlds, or a gymnasium.vector.SyncVectorEnv of single environments"
                )


def features(config: SceneConfig) -> dict[str, Any]:
    """What all worlds of a batch have in common: shapes of arrays, and what is left out."""
    seen = config.observation
    return {
        "rows and columns": (config.grid.rows, config.grid.cols),
        "site.border": config.site.border,
        "obstacles": config.has_walls,
        "a design": config.design is not None,
        "traction": config.traction is not None,
        "action.blade": config.action.blade,
        "zones": bool(config.zones),
        "soil.swell": config.soil.swell > 0.0,
        "observation.size": seen.size,
        "observation.channels": config.channels,
        "observation.height_limit": seen.height_limit,
        "observation.overview": seen.overview,
        "observation.map": seen.map,
        "observation.noise": seen.noise is not None,
    }


def _name(scene: Any) -> str:
    """A scene's name for people."""
    return str(scene) if isinstance(scene, str | Path) else "of its own"
