"""Plays a policy in an environment and sums up what came of it."""

from collections.abc import Callable, Mapping, Sequence

from dirt_env.env import DirtPushEnv
from dirt_env.policy import Policy

REPORTED = (
    "share_in_goal",
    "volume_moved_m3",
    "loose_moved_m3",
    "spilled_m3",
    "time_s",
    "distance_m",
    "work_kj",
    "energy_kj",
    "grade_error_m",
)
"""What an episode's last info brings into its summary."""

Summary = dict[str, float | None]
"""Figures by name; None where there is none: the grade error in a scene without a design."""
Watch = Callable[[DirtPushEnv, dict], None]


def play(env: DirtPushEnv, policy: Policy, seed: int, steps: int, watch: Watch | None = None) -> Summary:
    """One episode of at most `steps` control steps, on the layout of that seed.

    `watch` is called with the environment and the info after the reset and after every step.
    """
    observation, info = env.reset(seed=seed)
    policy.reset(seed)
    if watch is not None:
        watch(env, info)
    total, count, done = 0.0, 0, False
    while not done and count < steps:
        observation, reward, done, _, info = env.step(policy.act(observation))
        total += reward
        count += 1
        if watch is not None:
            watch(env, info)
    summary = _summary(info, seed, count, total)
    return summary if env.config.design is not None else {**summary, "grade_error_m": None}


def mean(summaries: Sequence[Summary]) -> Summary:
    """Means of the episodes' figures; m3/h are all the soil over all the time, `success` the share that was done."""
    names = [name for name in summaries[0] if name not in ("seed", "is_success")]
    columns = {name: [summary[name] for summary in summaries] for name in names}
    figures = {name: None if None in column else sum(column) / len(column) for name, column in columns.items()}
    return {**figures, **_rates(figures)}


def _summary(info: dict, seed: int, steps: int, total: float) -> Summary:
    figures = {name: info[name] for name in REPORTED}
    figures |= _rates(info)
    done = bool(info["is_success"])
    return {"seed": seed, "steps": steps, "is_success": done, "success": float(done), "return": total, **figures}


def _rates(figures: Mapping[str, float]) -> dict[str, float]:
    """Soil moved an hour, as bank and as loose soil; the same where no soil swells."""
    volumes = {"m3_per_h": figures["volume_moved_m3"], "loose_m3_per_h": figures["loose_moved_m3"]}
    seconds = figures["time_s"]
    return {name: 3600.0 * volume / seconds if seconds > 0.0 else 0.0 for name, volume in volumes.items()}
