"""Random search for the numbers of a behaviour: `python -m dirt_env.baselines.pushing.tune --policy greedy --out FILE`.

Plays on training layouts only (see `dirt_env.split`), and writes what differs from the shipped numbers as TOML:
`dirt-push run --policy greedy@FILE` drives with it.
"""

import argparse
import sys
from dataclasses import asdict, fields, replace
from pathlib import Path

import numpy as np

from dirt_env.config import load
from dirt_env.env import DirtPushEnv
from dirt_env.policy import OWN_NUMBERS, Policy, load_policy
from dirt_env.render.atomic import write_atomically
from dirt_env.split import training_seeds
from dirt_env.terminal import end, whole

from .numbers import write
from .parameters import Pushing, range_of

JOBS = ({"level": 1}, {"level": 3}, {"level": 5}, {"scene": "dig"}, {"scene": "posts"}, {"scene": "several_goals"})
SPREAD = 0.12  # of a number's range; how far a trial goes from the best so far
CHANGED = 4  # numbers that a trial changes


def cost(env: DirtPushEnv, policy, seed: int) -> float:
    """Mean over the job's nominal time of what is not done yet, 0 to 1: low is fast and complete."""
    steps = round(env.config.task.time / env.config.task.period)
    observation, info = env.reset(seed=seed)
    policy.reset(seed)
    left, start = 0.0, max(info["grade_error_m"], 1e-9)
    for _ in range(steps):
        observation, _, done, _, info = env.step(policy.act(observation))
        if done:
            break
        left += 1.0 - info["share_in_goal"] if env.config.design is None else min(1.0, info["grade_error_m"] / start)
    return left / steps


def trial(best: Pushing, generator: np.random.Generator) -> Pushing:
    """The best so far with a few numbers changed."""
    entries = fields(best)
    changes = {}
    for i in generator.choice(len(entries), CHANGED, replace=False):
        least, most = range_of(entries[i])
        step = SPREAD * (most - least) * generator.standard_normal()
        changes[entries[i].name] = round(float(np.clip(getattr(best, entries[i].name) + step, least, most)), 3)
    return replace(best, **changes)


def numbers_of(name: str, policy: Policy) -> Pushing:
    """The numbers of the policy of that name; ValueError for one that has none."""
    numbers = getattr(policy, "parameters", None)
    if not isinstance(numbers, Pushing):
        raise ValueError(
            f"--policy is {name}, which has no numbers; allowed: adaptive_push, greedy, planner, slot, "
            "or one of these with a file, NAME@FILE.toml"
        )
    return numbers


def search(trials: int, episodes: int, seed: int, say=sys.stdout.write, policy: str = "adaptive_push") -> Pushing:
    """The best of some trials; every job is played on the same training layouts each time."""
    generator = np.random.default_rng(seed)
    seeds = training_seeds(generator, episodes)
    envs = [DirtPushEnv(observation={"map": True}, **job) for job in JOBS]
    policies = [load_policy(policy, env.config) for env in envs]

    def total(numbers: Pushing) -> float:
        costs = []
        for env, like in zip(envs, policies, strict=True):
            driver = type(like)(env.config, numbers)
            played = seeds if env.config.layout is not None else seeds[:1]
            costs.append(np.mean([cost(env, driver, s) for s in played]))
        return float(np.mean(costs))

    best = numbers_of(policy, policies[0])
    least = total(best)
    say(f"as it is: {least:.4f}\n")
    for i in range(trials):
        tried = trial(best, generator)
        value = total(tried)
        if value < least:
            changed = {k: v for k, v in asdict(tried).items() if v != asdict(best)[k]}
            best, least = tried, value
            say(f"trial {i + 1}: {least:.4f} with {changed}\n")
    return best


def main(arguments: list[str] | None = None) -> int:
    """Search, write what was found, and say what has changed."""
    parser = argparse.ArgumentParser("tune", description="Random search for the numbers of a behaviour.")
    parser.add_argument(
        "--policy",
        default="adaptive_push",
        metavar="NAME",
        help="adaptive_push, greedy, planner or slot; NAME@FILE.toml begins from the numbers of a file",
    )
    parser.add_argument("--trials", type=whole(1), default=60, metavar="N", help="how many (default: 60)")
    parser.add_argument(
        "--episodes", type=whole(1), default=6, metavar="N", help="layouts of each random job (default: 6)"
    )
    parser.add_argument("--seed", type=whole(0), default=0, metavar="S", help="of layouts and changes (default: 0)")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="file for the numbers, TOML")
    options = parser.parse_args(arguments)
    return end("tune", lambda: _tune(options.policy, options.trials, options.episodes, options.seed, options.out))


def _tune(policy: str, trials: int, episodes: int, seed: int, out: Path) -> int:
    if out.suffix != ".toml" or not out.parent.is_dir():
        raise ValueError(f"--out is {out}; allowed: a .toml file in a folder that is there")
    before = asdict(numbers_of(policy, load_policy(policy, load())))
    found = search(trials, episodes, seed, policy=policy)
    about = (
        f"Found by tune --policy {policy} --trials {trials} --episodes {episodes} --seed {seed}, on training layouts"
    )
    own = policy.partition(OWN_NUMBERS)[2] or None
    write_atomically(out, write(found, about, own).encode())
    for name, value in asdict(found).items():
        if value != before[name]:
            sys.stdout.write(f"{name} = {value:g} (was {before[name]:g})\n")
    sys.stdout.write(f"wrote {out}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
