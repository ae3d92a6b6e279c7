"""Volume and steepest slope of ground where both are known."""

import numpy as np
import pytest

from dirt_env.sim.diagnostics import steepest, volume


def test_the_volume_is_the_sum_times_the_cell():
    assert volume(np.full((3, 4), 0.25, np.float32), 2.0) == 12.0


def test_the_steepest_slope_of_a_plane_is_its_gradient():
    y, x = np.mgrid[0:9, 0:9] * 0.5
    assert steepest(0.3 * x + 0.4 * y, 0.5) == pytest.approx(0.5)
    assert steepest(np.zeros((1, 1)), 0.5) == 0.0
