"""The adaptive push under traction and noise; where a scene has neither, its actions are those that were recorded.

After a change that is meant to change them: `pytest tests/baselines/test_hardship.py --renew-golden`.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from dirt_env.baselines.adaptive_push import AdaptivePush
from dirt_env.baselines.greedy import Greedy

from dirt_env.env import DirtPushEnv
from dirt_env.rollout import play

GOLDEN = Path(__file__).parents[1] / "golden" / "adaptive_push.json"
SCENES = {"heap": {"level": 1}, "between posts": {"level": 5}, "dig": {"scene": "dig"}, "pad": {"scene": "pad"}}
STEPS = 90
TOLERANCE = 1e-6  # other processors may round sine and cosine differently
SAND = {"soil": {"preset": "dry_sand"}, "traction": {}}
WET = {"soil": {"preset": "wet_sand"}, "traction": {}}
BLUR = {"height": 0.02, "position": 0.05, "heading": 1.0}


def actions(options):
    """The actions of an episode's first steps, [STEPS][3]."""
    env = DirtPushEnv(observation={"map": True}, **options)
    policy, (observation, _) = AdaptivePush(env.config), env.reset(seed=7)
    found = []
    for _ in range(STEPS):
        action = policy.act(observation)
        found.append([round(float(value), 7) for value in action])
        observation = env.step(action)[0]
    return found


@pytest.mark.parametrize("name", SCENES)
def test_without_traction_and_noise_it_acts_as_recorded(name, request):
    kept = json.loads(GOLDEN.read_text()) if GOLDEN.exists() else {}
    found = actions(SCENES[name])
    if request.config.getoption("--renew-golden"):
        rows = {**kept, name: found}
        GOLDEN.write_text(json.dumps({name: rows[name] for name in SCENES if name in rows}) + "\n")
        pytest.skip("recorded")
    assert np.abs(np.array(found) - np.array(kept[name])).max() <= TOLERANCE


def test_a_machine_that_is_held_back_raises_its_blade_and_goes_on():
    """It comes home with wet sand, which stalled it for a third of the time before it gave way."""
    env = DirtPushEnv(level=1, observation={"map": True}, **WET)
    policy, (observation, info) = AdaptivePush(env.config), env.reset(seed=2)
    stalled = raised = 0
    for _ in range(env.config.steps):
        observation, _, done, _, info = env.step(policy.act(observation))
        stalled += info["slip"] > 0.9
        raised += policy._eased > 0.05
        if done:
            break
    assert info["share_in_goal"] >= 0.95
    assert raised > 5
    assert stalled < 0.05 * env.config.steps


def test_the_blade_is_not_raised_where_nothing_holds_the_machine():
    env = DirtPushEnv(level=0, observation={"map": True})
    policy, (observation, _) = AdaptivePush(env.config), env.reset(seed=2)
    for _ in range(80):
        observation, *_ = env.step(policy.act(observation))
        assert policy._eased == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("make", [AdaptivePush, Greedy])
@pytest.mark.parametrize("hardship", [SAND, {}], ids=["dry sand with traction", "as it is"])
@pytest.mark.parametrize("noise", [BLUR, {}], ids=["blurred", "sharp"])
def test_it_finishes_a_heap_under_hardship(make, hardship, noise):
    env = DirtPushEnv(level=1, observation={"map": True, "noise": noise}, **hardship)
    assert play(env, make(env.config), 1, env.config.steps)["is_success"]
