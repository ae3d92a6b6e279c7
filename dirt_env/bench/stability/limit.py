"""The stability limit from both sides: a <= 1/4, a_x + a_y <= 1/2, RKL1 up to (s^2 + s) / 8. See docs/stability.md."""

import numpy as np

from dirt_env.bench.stability import twin
from dirt_env.bench.stability.registry import case
from dirt_env.bench.stability.worlds import SOIL, one_sweep, rough, world_of
from dirt_env.sim.laws import RATE

SIZE = 48


def growth(rate_x: float, rate_y: float, start: np.ndarray | None = None, **others) -> float:
    """Largest height after 200 sweeps over that at the start."""
    board = twin.checkerboard(SIZE, 1.0) if start is None else start
    return float(np.abs(twin.after(board, 200, rate_x, rate_y, **others)).max() / np.abs(board).max())


@case("RATE is under 1/4: a checkerboard without friction shrinks to |1 - 8 a| in a sweep of the library")
def the_rate_is_under_its_limit():
    world, grid = world_of(twin.checkerboard(SIZE, 1.0))
    one_sweep(world, grid, SOIL._replace(slope=0.0))
    found = float(np.abs(world.height[4:-4, 4:-4]).max())
    return f"a = {RATE}, factor {found:.5f}, |1 - 8 a| = {abs(1 - 8 * RATE):.5f}", abs(found - abs(1 - 8 * RATE)) < 2e-5


@case("the library's sweep is the scheme that the limit is derived for: equal to the plain twin within rounding")
def the_sweep_is_the_twins():
    ground = rough(24, 30, 0.5)
    world, grid = world_of(ground, cell=1.0, dtype=np.float64)
    plain = world.height.copy()
    for _ in range(20):
        one_sweep(world, grid, SOIL._replace(tolerance=0.0))
        plain = twin.slump(plain, RATE, RATE, SOIL.slope)
    off = float(np.abs(world.height - plain).max() / world.quantum)
    return f"at most {off:.1f} quanta apart after 20 sweeps", off < 100


@case("a cosine without friction decays by (1 - 4 a (sin^2 + sin^2))^N, to 1e-13")
def a_linear_mode_decays_as_it_should():
    n, m, sweeps = 32, (2, 1), 100
    wave = [np.cos(np.pi * m_ * (np.arange(n) + 0.5) / n) for m_ in m]
    board = np.outer(*wave)
    decay = (1 - 4 * RATE * sum(np.sin(np.pi * m_ / (2 * n)) ** 2 for m_ in m)) ** sweeps
    error = float(np.abs(twin.after(board, sweeps, RATE, RATE) - decay * board).max())
    return f"error {error:.1e}, decay to {decay:.3f}", error < 1e-13 and 0.1 < decay < 0.9


@case("a = 0.25: the checkerboard without friction does not grow")
def rate_025_holds():
    found = growth(0.25, 0.25)
    return f"times {found:.6f} in 200 sweeps", found <= 1 + 1e-12


@case("a = 0.26: it diverges")
def rate_026_diverges():
    found = growth(0.26, 0.26)
    return f"times {found:.1e} in 200 sweeps", found > 1e5


@case("a = 0.26 on rough ground without friction: it diverges; 0.25 does not")
def rate_026_diverges_from_noise():
    noise = rough(SIZE, SIZE, 1.0)
    stable, unstable = (growth(rate, rate, noise) for rate in (0.25, 0.26))
    return f"times {stable:.2f} and {unstable:.1e} in 200 sweeps", stable <= 1 and unstable > 1e3


@case("a = 0.26 with friction: a difference d becomes |1 - 8 a share(d)| d: 3 T dies away, 30 T grows; equal to 1e-9")
def friction_moves_the_limit_to_an_amplitude():
    sweeps, found, off = 20, [], 0.0
    for start in (3.0, 30.0):
        board = twin.after(twin.checkerboard(SIZE, 0.5 * start), sweeps, 0.26, 0.26, slope=1.0)
        found.append(2 * abs(float(board[SIZE // 2, SIZE // 2])))
        difference = start
        for _ in range(sweeps):
            difference *= abs(1 - 8 * 0.26 * float(twin.excess(np.float64(difference), 1.0)))
        off = max(off, abs(found[-1] - difference))
    text = f"3 T becomes {found[0]:.2f} T, 30 T becomes {found[1]:.2f} T; {off:.0e} off"
    return text, off < 1e-9 and found[0] < 3.0 and found[1] > 30.0


@case("cells of 1000 : 1 with a_x + a_y = 1/2: no growth")
def rectangular_cells_hold():
    found = growth(0.4999, 0.0001, dx=1.0, dy=1000.0)
    rough_ = growth(0.4999, 0.0001, rough(SIZE, SIZE, 1.0), dx=1.0, dy=1000.0)
    return f"times {found:.4f}; rough ground {rough_:.2f}", found <= 1 + 1e-12 and rough_ <= 1


@case("cells of 1000 : 1 with a_x + a_y = 0.51: it diverges")
def rectangular_cells_diverge():
    found = growth(0.5099, 0.0001, dx=1.0, dy=1000.0)
    return f"times {found:.1e} in 200 sweeps", found > 1e3


@case("RKL1 with s stages is stable up to a span of (s^2 + s) / 8 for s from 1 to 12, not 5 % beyond")
def rkl1_holds_up_to_its_span():
    inside = beyond = 0.0
    board = twin.checkerboard(SIZE, 1.0)
    for stages in range(1, 13):
        span = (stages**2 + stages) / 8
        inside = max(inside, float(np.abs(twin.rkl1(board, span, stages)).max()))
        past = float(np.abs(twin.rkl1(board, 1.05 * span, stages)).max())
        beyond = past if stages == 1 else min(beyond, past)
    return f"times at most {inside:.6f} inside, at least {beyond:.3f} beyond", inside <= 1 + 1e-9 and beyond > 1.05


@case("stages for a span of 1, 10, 100: 3, 9, 28, in place of 4, 40, 400 sweeps of a = 1/4")
def rkl1_needs_few_stages():
    stages = [twin.rkl1_stages(span) for span in (1.0, 10.0, 100.0)]
    noise = rough(SIZE, SIZE, 1.0)
    worst = max(
        float(np.abs(twin.rkl1(noise, span, s)).max() / np.abs(noise).max())
        for span, s in zip((1.0, 10.0, 100.0), stages, strict=True)
    )
    return f"stages {stages}, rough ground times {worst:.2f}", stages == [3, 9, 28] and worst <= 1
