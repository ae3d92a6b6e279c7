"""What holds whatever a policy does: volume to the last bit, finite numbers, no slope above repose."""

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from dirt_env.env import DirtPushEnv
from dirt_env.sim.diagnostics import volume

SHARE = st.floats(-1, 1, width=32)


def slopes(height: np.ndarray, cell: float) -> np.ndarray:
    """Slope to the north and to the east of every cell [-], f8[2, rows - 1, cols - 1]."""
    h = height.astype(np.float64)
    return np.abs([h[1:, :-1] - h[:-1, :-1], h[:-1, 1:] - h[:-1, :-1]]) / cell


class Driving(RuleBasedStateMachine):
    """A machine that is driven about a small site with two heaps."""

    def __init__(self):
        super().__init__()
        self.env = DirtPushEnv(
            site={"size": [20.0, 16.0]}, layout={"heaps": 2, "volume": [3.0, 5.0], "haul": [5.0, 9.0]}
        )

    @initialize(seed=st.integers(0, 50))
    def start(self, seed):
        self.env.reset(seed=seed)
        self.volume = self.measure()

    @rule(steering=SHARE, speed=SHARE, blade=SHARE, steps=st.integers(1, 12))
    def drive(self, steering, speed, blade, steps):
        for _ in range(steps):
            _, reward, _, _, info = self.env.step([steering, speed, blade])
            assert np.isfinite(reward)
            assert 0.0 <= info["share_in_goal"] <= 1.0

    @rule()
    def turn_back(self):
        state = self.env.get_state()
        self.env.step([1.0, -1.0, -1.0])
        self.env.set_state(state)

    @rule(seed=st.integers(0, 50))
    def start_again(self, seed):
        self.start(seed)

    @invariant()
    def volume_is_kept(self):
        assert self.measure() == self.volume

    @invariant()
    def everything_is_finite(self):
        world = self.env.episode.world
        assert np.isfinite(world.height).all()
        assert np.isfinite(world.machine.item()).all()

    @invariant()
    def the_machine_stays_inside(self):
        record = self.env.episode.world.machine[0]
        width, depth = self.env.config.site.size
        assert 0 <= record.x <= width
        assert 0 <= record.y <= depth

    @invariant()
    def nothing_is_steeper_than_repose_away_from_the_blade(self):
        world, config = self.env.episode.world, self.env.config
        record, cell = world.machine[0], config.grid.cell
        if world.pending[1] > world.pending[0]:
            return  # an avalanche is under way
        row, col = np.mgrid[: config.grid.rows - 1, : config.grid.cols - 1]
        blade_x = record.x + config.blade.reach * np.cos(record.heading)
        blade_y = record.y + config.blade.reach * np.sin(record.heading)
        far = np.hypot((col + 0.5) * cell - blade_x, (row + 0.5) * cell - blade_y) > config.blade.width / 2 + 3 * cell
        limit = config.soil.slope * (1 + config.soil.tolerance) + 1e-3
        assert slopes(world.height, cell)[:, far].max() <= limit

    def measure(self):
        return volume(self.env.episode.world.height, self.env.config.grid.cell)


TestDriving = Driving.TestCase
TestDriving.settings = settings(max_examples=30, stateful_step_count=20, deadline=None)


@pytest.mark.slow
def test_the_sum_of_heights_is_equal_after_a_hundred_thousand_steps():
    """Random driving with digging, a new direction every few steps; 1e5 control steps."""
    env = DirtPushEnv(level=4)
    env.reset(seed=1)
    height = env.episode.world.height
    before = volume(height, 1.0)
    rng = np.random.default_rng(1)
    for _ in range(12_500):
        action = [rng.uniform(-1, 1), rng.choice([-1, 1, 1]), rng.uniform(-1, 0.3)]
        for _ in range(8):
            env.episode.act(action)
    assert env.episode.totals.steps == 100_000
    assert env.episode.world.tally[0].cut >= 0
    assert volume(height, 1.0) == before


def test_an_open_border_keeps_books():
    """What the site loses is what the ledger says."""
    env = DirtPushEnv(level=1, site={"border": "open"})
    env.reset(seed=3)
    area = env.config.grid.cell**2
    before = volume(env.episode.world.height, 1.0) * area
    rng = np.random.default_rng(0)
    for _ in range(60):
        action = [rng.uniform(-1, 1), 1.0, -0.6]
        for _ in range(10):
            info = env.step(action)[-1]
    left = volume(env.episode.world.height, 1.0) * area
    assert before - left == pytest.approx(info["lost_m3"], abs=1e-9)
