"""Random scenes, actions, resets, teleports and states: what has to hold after every one of them.

`HYPOTHESIS_PROFILE=long` plays 500 games of 60 moves, new ones each time; the normal suite a few, the same each time.
"""

from functools import cache
from math import cos, sin

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from scipy.ndimage import label

from dirt_env.env import DirtPushEnv
from dirt_env.sim.advance import fits, place

LONG = settings.get_current_profile_name() == "long"
HEAPS = {"layout": {"heaps": 1, "volume": [0.5, 2.0], "haul": [4.0, 9.0]}}
POSTS = {"layout": {**HEAPS["layout"], "obstacles": 3, "obstacle_radius": 0.5}}
DIVIDED = {  # by a wall one cell thick, which cells that touch at a corner make tight
    "start": [{"region": {"kind": "circle", "center": [4.0, 7.0], "radius": 2.0}, "depth": 0.2}],
    "goal": [{"region": {"kind": "circle", "center": [9.0, 12.0], "radius": 2.0}}],
    "obstacle": [{"kind": "wall", "from": [9.5, 0.0], "to": [20.0, 10.5], "width": 1.0}],
}
DESIGN = {
    "design": {"region": {"kind": "rectangle", "center": [9.0, 8.0], "size": [5.0, 4.0]}, "height": "balance"},
    "ground": {"kind": "mounds", "count": 3, "height": 0.2, "radius": 3.0, "seed": 1},
}
JOBS = {"heaps": HEAPS, "posts": POSTS, "divided": DIVIDED, "design": DESIGN}
SHARE = st.floats(-1, 1, width=32)
ANYTHING = st.floats(allow_nan=True, allow_infinity=True)


@cache
def env_of(job, repose, cell, border, more):
    """One environment for each scene; every game begins with its reset."""
    soil = {"repose": repose, "tolerance": 0.02 if repose < 20 else 0.004}
    site = {"size": [20.0, 16.0], "cell": cell, "border": border}
    observation = {"size": 16, "overview": more, "map": more}
    return DirtPushEnv(scene={**JOBS[job], "soil": soil, "site": site, "observation": observation})


class Game(RuleBasedStateMachine):
    """A machine on a site of 20 m x 16 m, with whatever may happen to it."""

    @initialize(
        job=st.sampled_from(sorted(JOBS)),
        soil_and_cell=st.sampled_from([(10.0, 1.0), (35.0, 0.5), (35.0, 1.0), (60.0, 0.5)]),
        border=st.sampled_from(["wall", "open"]),
        more=st.booleans(),
        seed=st.integers(0, 99),
    )
    def begin(self, job, soil_and_cell, border, more, seed):
        self.env = env_of(job, *soil_and_cell, border, more)
        self.start_again(seed)

    @rule(seed=st.integers(0, 99))
    def start_again(self, seed):
        self.seen, _ = self.env.reset(seed=seed)
        self.note()

    def note(self):
        """Take down what may not change until the next reset."""
        world, layout = self.env.episode.world, self.env.episode.layout
        self.solid = np.zeros(world.height.shape, bool) if layout.solid is None else layout.solid
        self.in_walls = world.height[self.solid].copy()
        self.parts, self.count = label(~self.solid)
        self.sums = self.measure()

    @rule(x=st.floats(0, 20), y=st.floats(0, 16), heading=st.floats(-9, 9))
    def start_elsewhere(self, x, y, heading):
        config, state = self.env.config, self.env.get_state()
        try:
            self.seen, _ = self.env.reset(options={"pose": (x, y, heading), "layout_seed": 7})
        except ValueError as error:
            assert "does not fit" in str(error)  # noqa: PT017
            assert self.env.get_state() == state
        else:
            self.note()
            assert (self.env.episode.world.machine[0].x, config.task.period) == (x, config.task.period)

    @rule(x=st.floats(0, 20), y=st.floats(0, 16), heading=st.floats(-9, 9))
    def teleport(self, x, y, heading):
        config, world = self.env.config, self.env.episode.world
        if fits(world, config.grid, config.blade, config.machine, x, y, heading):
            place(world, config.grid, config.soil, config.blade, config.machine, x, y, heading)

    @rule(steering=SHARE, speed=SHARE, blade=SHARE, steps=st.integers(1, 10))
    def drive(self, steering, speed, blade, steps):
        for _ in range(steps):
            self.step([steering, speed, blade])

    @rule(steering=st.sampled_from([-1, 0, 1]), way=st.sampled_from([-1, 1]), blade=st.sampled_from([-1, 0, 1]))
    def drive_on_for_long(self, steering, way, blade):
        for _ in range(25):
            self.step([steering, way, blade])

    def step(self, action):
        self.seen, reward, done, _, info = self.env.step(action)
        assert np.isfinite([reward, *info["reward"].values()]).all()
        assert type(done) is bool
        config = self.env.config
        assert self.env.episode.world.tally[0].sweeps <= config.soil.max_sweeps
        assert 0.0 <= info["share_in_goal"] <= 1.0

    @rule(steps=st.integers(1, 4))
    def go_back_to_a_state(self, steps):
        state = self.env.get_state()
        for _ in range(steps):
            self.env.step([0.7, -1.0, -1.0])
        self.env.set_state(state)
        assert self.env.get_state() == state

    @rule(values=st.tuples(ANYTHING, ANYTHING, ANYTHING))
    def an_action_of_any_numbers(self, values):
        state = self.env.get_state()
        try:
            self.step(list(values))
        except ValueError:
            assert not np.isfinite(values).all()
            assert self.env.get_state() == state

    @rule()
    def lift_and_wait(self):
        for _ in range(4):
            self.step([0.0, 0.0, 1.0])

    @invariant()
    @precondition(lambda self: hasattr(self, "env"))
    def everything_holds(self):
        self.volume_is_kept_to_the_last_bit()
        self.nothing_goes_into_walls()
        self.numbers_are_sound()
        self.nothing_is_steeper_than_repose_away_from_the_blade()

    def measure(self):
        """Sums of heights [m] of the site's parts between walls; all in one, with what was lost, on an open border."""
        world, cell = self.env.episode.world, self.env.config.grid.cell
        heights = world.height.astype(np.float64)
        if world.outside is not None:
            lost = self.env.episode.totals.lost
            return [heights[~self.solid].sum() + lost / cell**2]
        return [heights[self.parts == part].sum() for part in range(1, self.count + 1)]

    def volume_is_kept_to_the_last_bit(self):
        assert self.measure() == self.sums

    def nothing_goes_into_walls(self):
        np.testing.assert_array_equal(self.env.episode.world.height[self.solid], self.in_walls)

    def numbers_are_sound(self):
        episode = self.env.episode
        assert np.isfinite(episode.world.height).all()
        assert np.isfinite(episode.world.machine.item()).all()
        assert self.env.observation_space.contains(self.seen)
        assert episode.remaining.potential >= 0.0
        assert episode.remaining.misplaced >= 0.0
        assert 0 <= episode.world.machine[0].x <= 20.0
        assert 0 <= episode.world.machine[0].y <= 16.0

    def nothing_is_steeper_than_repose_away_from_the_blade(self):
        world, config = self.env.episode.world, self.env.config
        if world.pending[1] > world.pending[0]:
            return  # an avalanche is under way
        cell, pose = config.grid.cell, world.machine[0]
        row, col = np.indices(world.height.shape)
        x = (col + 0.5) * cell - (pose.x + config.blade.reach * cos(pose.heading))
        y = (row + 0.5) * cell - (pose.y + config.blade.reach * sin(pose.heading))
        free = (np.hypot(x, y) > config.blade.width / 2 + 3 * cell) & ~self.solid
        limit = config.soil.slope * (1 + config.soil.tolerance) * cell + 8 * world.quantum
        for axis in (0, 1):
            drop = np.abs(np.diff(world.height.astype(np.float64), axis=axis))
            both = np.delete(free, 0, axis) & np.delete(free, -1, axis)
            assert drop[both].max(initial=0.0) <= limit


TestGame = Game.TestCase
if LONG:
    TestGame.settings = settings(max_examples=500, stateful_step_count=60, deadline=None)
else:
    TestGame.settings = settings(max_examples=40, stateful_step_count=15, deadline=None, derandomize=True)
TestGame = pytest.mark.slow(TestGame)
