"""The environment under actions that nobody sensible would give."""

from itertools import product

import numpy as np

from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import MACHINE, SLOPE, Driven, rough, total
from dirt_env.env import DirtPushEnv

PUSH, DIG = np.array([0.0, 1.0, 0.0]), np.array([0.2, 1.0, -1.0])


def started(seed=1, **options) -> DirtPushEnv:
    """An environment after its reset."""
    env = DirtPushEnv(**options)
    env.reset(seed=seed)
    return env


def sound(env, seen, reward, info) -> bool:
    """Whether what a step returned is finite and inside the spaces."""
    numbers = [reward, *info["reward"].values(), *(v for v in info.values() if isinstance(v, float))]
    return (
        env.observation_space.contains(seen)
        and bool(np.isfinite(numbers).all())
        and env.episode.remaining.potential >= 0
    )


@case("all 27 actions of -1, 0, 1, 60 steps each: observations inside, numbers finite, volume equal")
def the_corners_of_the_action_space():
    env = started(level=2)
    before, good = total(env.episode.world), True
    for action in product((-1.0, 0.0, 1.0), repeat=3):
        for _ in range(60):
            seen, reward, _, _, info = env.step(action)
            good &= sound(env, seen, reward, info)
    return f"all sound: {good}", good and total(env.episode.world) == before


@case("5000 random and extreme actions, up to 1e300: observations inside, volume equal")
def actions_beyond_the_space():
    env = started(level=5, observation={"overview": True, "map": True})
    before, good = total(env.episode.world), True
    rng = np.random.default_rng(0)
    for _ in range(5000):
        action = rng.choice([-1e300, -5.0, -1.0, 0.0, 1e-300, 1.0, 5.0, 1e300], 3)
        seen, reward, _, _, info = env.step(action)
        good &= sound(env, seen, reward, info)
    return f"all sound: {good}", good and total(env.episode.world) == before


@case("NaN, infinity, four numbers, text as actions: refused, and not a byte of the state changes")
def actions_that_are_none():
    env = started()
    env.step(PUSH)
    state, refused = env.get_state(), 0
    bad = ([np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf], [0, 0], [0, 0, 0, 0], "push", None, [[0, 0, 0]], 1.0)
    for action in bad:
        try:
            env.step(action)
        except ValueError as error:
            refused += "action" in str(error)
    same = env.get_state() == state
    return f"{refused} of {len(bad)} refused, state unchanged: {same}", refused == len(bad) and same


@case("2000 steps against the wall with the blade down: held, volume equal, no growth of the work")
def against_the_wall():
    drive = Driven(np.full((40, 40), 0.2), 10.0, 10.0).go(edge=-0.1, dt=2.0).go(speed=2.0, edge=-0.1, steps=20)
    before, sweeps = total(drive.world), []
    for _ in range(2):
        start = drive.sweeps
        drive.go(speed=2.0, edge=-0.1, steps=1000)
        sweeps.append(drive.sweeps - start)
    held = float(drive.world.tally[0].blocked)
    ok = total(drive.world) == before and abs(held - 1) < 1e-9 and sweeps[1] <= sweeps[0] + 10
    return f"held for {held:g} of a step, {sweeps} sweeps in both halves", ok


@case("a reset in mid-push: the same, to the last bit, as an environment that never pushed")
def a_reset_in_mid_push():
    used, fresh = started(3), DirtPushEnv()
    for _ in range(40):
        used.step(DIG)
    used.reset(seed=11)
    fresh.reset(seed=11)
    for _ in range(20):
        used.step(DIG)
        fresh.step(DIG)
    return "states compared", used.get_state() == fresh.get_state()


@case("set_state in mid-push: the same way again, to the last bit, in another environment too")
def a_state_in_mid_push():
    env, other = started(3, level=4), DirtPushEnv(level=4)
    for _ in range(30):
        env.step(DIG)
    state = env.get_state()
    ends = []
    for one in (env, env, other):
        one.set_state(state)
        for _ in range(30):
            one.step(DIG)
        ends.append(one.get_state())
    return "three ways compared", ends[0] == ends[1] == ends[2]


@case("standing still, 1e5 steps: not one sweep, not a bit of the ground changes", counts=(100_000, 10_000))
def standing_still(count):
    drive = Driven(rough(64, 64, 0.05), 16.0, 16.0).go(edge=0.75, steps=4)
    before, sweeps = drive.world.height.copy(), drive.sweeps
    drive.go(edge=0.75, steps=count)
    same = np.array_equal(before, drive.world.height)
    return f"{drive.sweeps - sweeps} sweeps, ground unchanged: {same}", same and drive.sweeps == sweeps


@case("driving and digging on a ramp of exactly the slope of repose, 1000 steps: finite, volume equal, bounded work")
def on_a_critical_ramp():
    ramp = np.tile(SLOPE * 0.5 * np.arange(64.0), (64, 1))
    drive = Driven(ramp, 16.0, 16.0)
    before = total(drive.world)
    for speed, yaw_rate, edge in np.random.default_rng(5).uniform((-2, -0.6, -0.2), (2, 0.6, 0.1), (1000, 3)):
        drive.go(speed, yaw_rate, edge)
    ok = total(drive.world) == before and np.isfinite(drive.world.machine.item()).all()
    return f"at most {drive.most_sweeps} sweeps in a step", ok and drive.most_sweeps <= drive.soil.max_sweeps


@case("driving over towers and shafts of 5 m, 1000 steps: machine finite and on the site, volume equal")
def over_rough_ground():
    drive = Driven(rough(64, 64, 5.0), 16.0, 16.0)
    before, inside = total(drive.world), True
    for speed, yaw_rate, edge in np.random.default_rng(6).uniform((-2, -0.6, -0.25), (2, 0.6, 0.5), (1000, 3)):
        drive.go(speed, yaw_rate, edge)
        inside &= 0 <= drive.pose.x <= 32 and 0 <= drive.pose.y <= 32
    ok = inside and total(drive.world) == before and np.isfinite(drive.world.machine.item()).all()
    return f"pitch {drive.pose.pitch:.2f}, inside: {inside}", ok


@case("more than a full load at grade: the machine porpoises, but no deeper than its blade is high; volume equal")
def an_overload_at_grade():
    ground = np.zeros((40, 90))
    ground[16:24, 18:22] = 0.6
    drive = Driven(ground, 4.0, 10.0).go(edge=0.0, dt=4.0)
    before = total(drive.world)
    drive.go(speed=2.0, steps=24)
    low = float(drive.world.height.min())
    return f"4.8 m3 pushed, deepest {low:.2f} m", total(drive.world) == before and low > -1.0


@case("control steps of 1e-9 s, 1e-3 s and 10 s: 20 s of driving end at the same place, volume equal")
def any_control_period():
    places, equal = [], True
    for dt, steps in ((1e-3, 20_000), (0.5, 40), (10.0, 2)):
        drive = Driven(np.full((64, 64), 0.2), 8.0, 16.0).go(edge=-0.1, dt=2.0)
        before = total(drive.world)
        drive.go(speed=0.5, edge=-0.1, dt=dt, steps=steps).go(speed=0.5, edge=-0.1, dt=1e-9)
        places.append(float(drive.pose.x))
        equal &= total(drive.world) == before
    return f"x {', '.join(f'{x:.6f}' for x in places)} m", equal and np.ptp(places) < 1e-6


@case("the edge told to go to 1e300 m: it goes at its own rate, numbers finite")
def an_edge_command_beyond_all_bounds():
    drive = Driven(np.full((40, 40), 0.2), 10.0, 10.0, machine=MACHINE).go(edge=1e300).go(edge=-1e300)
    ok = np.isfinite(drive.world.machine.item()).all() and abs(drive.pose.edge - 0.75) < 1e-9
    return f"edge {drive.pose.edge:g} m", ok
