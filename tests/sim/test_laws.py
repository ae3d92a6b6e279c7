"""The scalar laws at points where the answer is plain."""

import numpy as np
import pytest

from dirt_env.sim.laws import link_excess, push_work, quantise, slump_share


def test_the_share_that_slumps_grows_with_the_excess_over_repose():
    assert slump_share(2.0, 0.0, 1.0, 1.0) == 0.75
    assert slump_share(3.0, 4.0, 1.0, 1.0) == pytest.approx(0.96)
    assert slump_share(1.0, 0.0, 1.0, 1.001) == 0.0
    assert slump_share(0.0, 0.0, 1.0, 1.0) == 0.0


def test_soil_passes_a_closed_link_over_the_top_or_under_the_edge():
    assert link_excess(2.0, 0.0, 0.0, 1.0, 0.5) == 0.5  # 1 m stands over the top
    assert link_excess(0.8, 0.0, 0.0, 1.0, 0.5) == -0.5  # held
    assert link_excess(2.0, 0.0, 1.5, 3.0, 0.5) == 1.0  # 1.5 m is free under the edge
    assert link_excess(2.0, 1.5, 0.0, 1.0, 0.1) == pytest.approx(0.4)  # both over the top


def test_rounding_gives_multiples_of_the_quantum():
    q = 2.0**-18
    lock = np.float32(1.5 * 2**23 * q)
    for value in np.random.default_rng(0).normal(0, 1, 100).astype(np.float32):
        rounded = quantise(value, lock)
        assert rounded / q == round(rounded / q)
        assert abs(rounded - value) <= q / 2


def test_the_work_of_a_load_is_friction_times_weight_times_way():
    assert push_work(2.0, 1500.0, 0.7, -3.0) == pytest.approx(0.7 * 1500 * 9.81 * 2 * 3)
