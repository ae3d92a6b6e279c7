"""What the settings of a training run have to have in common, beyond the rules of each key."""

from collections.abc import Mapping

from dirt_env.config import SceneConfig, load
from dirt_env.config.loading import merge
from dirt_env.policy import load_policy, needed
from dirt_env.task.observation import POSE_ENTRIES
from dirt_env.task.site_map import OVERVIEW
from dirt_env.variety import check_alike

from .hyperparameters import MUON_FROM, Sac
from .settings import NO_TEACHER, Network, Settings, Stage, Teacher, overrides_of


def check(settings: Settings) -> None:
    """Raise ValueError where values do not go together."""
    ppo = settings.ppo
    if ppo is not None and settings.rollout % ppo.batch_size:
        raise ValueError(
            f"ppo.batch_size is {ppo.batch_size}; allowed: what divides worlds.count x ppo.n_steps = {settings.rollout}"
        )
    if ppo is not None and ppo.optimizer == "muon" and settings.network.features < MUON_FROM:
        raise ValueError(
            f'network.features is {settings.network.features} with ppo.optimizer "muon"; allowed: at least {MUON_FROM}'
        )
    _check_stages(settings)
    _check_scene_keys(settings)
    configs = _scenes(settings)
    for config in configs.values():
        if config.observation.map:
            raise ValueError("worlds.set.observation.map is True; allowed: False, with patch, pose and overview")
        check_network(settings.network, config.observation.size)
        if settings.network.roots and "todo" not in config.channels:
            raise ValueError(
                f"network.roots is True with the channels {list(config.channels)} of the scene's observation; "
                'allowed: with "todo" among them'
            )
    _check_variants(settings, configs)
    if settings.sac is not None:
        _check_sac(settings, settings.sac, step_bytes(next(iter(configs.values())), settings.worlds.frames))
    _check_teacher(settings)


def _check_scene_keys(settings: Settings) -> None:
    """Raise ValueError for keys of the scene that are said elsewhere in the settings."""
    worlds = settings.worlds
    tables = {"worlds.set": worlds.set} | {f"worlds.variants[{i}]": table for i, table in enumerate(worlds.variants)}
    for key, table in tables.items():
        for name, elsewhere in (("scene", "worlds.scene"), ("level", "levels in [[stage]] and [record]")):
            if name in table:
                raise ValueError(f"{key}.{name} is {table[name]!r}; allowed: {elsewhere} alone")
    for number, variant in enumerate(worlds.variants):
        seen = variant.get("observation", {})
        if other := [name for name in seen if name != "noise"] if isinstance(seen, Mapping) else []:
            raise ValueError(
                f"worlds.variants[{number}].observation has {', '.join(other)}; allowed: noise alone, for the policy "
                "sees all worlds alike (worlds.set.observation)"
            )


def _scenes(settings: Settings) -> dict[int | None, SceneConfig]:
    """The scene at each level of the stages and the record; ValueError that names the table of a level it lacks."""
    tables = {f"stage[{number}].levels": stage.levels for number, stage in enumerate(settings.stages)}
    found: dict[int | None, SceneConfig] = {}
    for key, levels in {**tables, "record.levels": settings.record.levels}.items():
        for level in levels or (None,):
            if level in found:
                continue
            try:
                found[level] = load(settings.worlds.scene, **overrides_of(settings, level))
            except ValueError as error:
                if level is None or not str(error).startswith(("level ", "layout.level ")):
                    raise
                none = "--set record.levels=[]" if key == "record.levels" else "--set 'stage=[{}]'"
                raise ValueError(f"{key} has {level}: {error}, or no levels ({none})") from error
    return found


def _check_sac(settings: Settings, sac: Sac, size: int) -> None:
    """Raise ValueError where SAC cannot do what is asked for; `size` is that of a step in the buffer [bytes]."""
    if settings.teacher.policy:
        raise ValueError(
            f'teacher.policy is {settings.teacher.policy!r} with algorithm "sac", which begins from nothing; '
            'allowed: no teacher, or algorithm = "ppo"'
        )
    taken, room = sac.buffer_size * size / 1e9, int(sac.memory * 1e9 / size)
    if taken > sac.memory:
        raise ValueError(
            f"sac.buffer_size is {sac.buffer_size}, which takes {taken:.2f} GB ({size:,} bytes a step); allowed: at "
            f"most {room} in sac.memory = {sac.memory:g} GB, or more memory"
        )
    least = max(settings.rollout, sac.batch_size)
    if sac.buffer_size < least:
        raise ValueError(
            f"sac.buffer_size is {sac.buffer_size}; allowed: at least {least}, a batch and "
            "worlds.count x sac.train_freq"
        )
    if sac.learning_starts >= settings.steps:
        raise ValueError(f"sac.learning_starts is {sac.learning_starts}; allowed: less than steps = {settings.steps}")


def step_bytes(config: SceneConfig, frames: int) -> int:
    """What a step takes in the buffer of SAC: what was seen before and after it, action, reward, two marks."""
    seen = config.observation
    pictures = frames * len(config.channels) * seen.size**2 + (2 * OVERVIEW**2 if seen.overview else 0)
    return 2 * (2 * pictures + 4 * frames * len(POSE_ENTRIES)) + 4 * (3 + 1 + 2)


def _check_teacher(settings: Settings) -> None:
    """Raise ValueError where the teacher cannot play what is trained on, or leaves nothing to learn."""
    teacher = settings.teacher
    if not teacher.policy:
        if teacher != Teacher():
            raise ValueError(f"teacher.policy is ''; allowed: a scripted behaviour, or {NO_TEACHER!r}")
        return
    level = (settings.stages[-1].levels or (None,))[0]
    try:
        policy = load_policy(teacher.policy, load(settings.worlds.scene, **overrides_of(settings, level)))
    except (ValueError, ImportError) as error:
        raise ValueError(f"teacher.policy is {teacher.policy!r}: {error}") from error
    if needed(policy) not in ({}, {"observation": {"map": True}}):
        raise ValueError(f"teacher.policy is {teacher.policy!r}, which needs {needed(policy)}; allowed: the map alone")
    kinds = _kinds(settings, settings.stages[-1])
    if teacher.worlds < kinds:
        raise ValueError(
            f"teacher.worlds is {teacher.worlds}; allowed: at least {kinds}, a world for each level of the last stage "
            "with each of worlds.variants"
        )
    if teacher.critic_steps >= settings.steps:
        raise ValueError(f"teacher.critic_steps is {teacher.critic_steps}; allowed: less than steps {settings.steps}")


def _check_variants(settings: Settings, configs: Mapping[int | None, SceneConfig]) -> None:
    """Raise ValueError where a variant cannot be in one batch with the scene as it is (`configs`, by level)."""
    for number, variant in enumerate(settings.worlds.variants):
        key = f"worlds.variants[{number}]"
        for level, plain in configs.items():
            try:
                config = load(settings.worlds.scene, **merge(overrides_of(settings, level), variant))
            except ValueError as error:
                raise ValueError(f"{key}: {error}") from error
            check_alike([("the scene as it is", plain), (key, config)])


def _check_stages(settings: Settings) -> None:
    """Raise ValueError where a stage but the last never ends, or the last one does."""
    if not settings.stages:
        raise ValueError("stage is empty; allowed: one [[stage]] or more")
    for number, stage in enumerate(settings.stages):
        ends, last = stage.success is not None or stage.steps is not None, number == len(settings.stages) - 1
        if ends == last:
            said = "ends" if ends else "never ends"
            raise ValueError(
                f"stage[{number}] {said}; allowed: `success` or `steps` in every stage but the last, which has neither"
            )
        kinds = _kinds(settings, stage)
        if kinds > settings.worlds.count:
            raise ValueError(
                f"worlds.count is {settings.worlds.count}; allowed: at least {kinds}, a world for each level of "
                f"stage[{number}] with each of worlds.variants"
            )


def _kinds(settings: Settings, stage: Stage) -> int:
    """How many worlds of a stage differ: every variant at every level."""
    return max(len(stage.levels), 1) * max(len(settings.worlds.variants), 1)


def check_network(network: Network, size: int) -> None:
    """Raise ValueError where the lists of convolutions differ in length, or one is larger than what is left to see."""
    if not len(network.filters) == len(network.kernels) == len(network.strides):
        raise ValueError(
            f"network.filters, kernels and strides have {len(network.filters)}, {len(network.kernels)} and "
            f"{len(network.strides)} numbers; allowed: as many each, one for each convolution"
        )
    for kernel, stride in zip(network.kernels, network.strides, strict=True):
        if kernel > size:
            raise ValueError(f"network.kernels has {kernel} over {size} pixels; allowed: at most as many")
        size = (size - kernel) // stride + 1
