"""Thrust of tracks: the formula of Janosi and Hanamoto, and its inverse."""

from math import exp

import numpy as np
import pytest

from dirt_env.sim.thrust import SMALL, mobilised_share, slip_at


@pytest.mark.parametrize("z", [SMALL, 0.1, 1.0, 7.0, 300.0])
def test_the_share_is_that_of_the_formula(z):
    assert mobilised_share(z) == pytest.approx(1 - (1 - exp(-z)) / z, rel=1e-12)


def test_little_slip_is_the_mean_of_a_stress_that_grows_along_the_track():
    assert mobilised_share(0.0) == 0.0
    assert mobilised_share(1e-8) == pytest.approx(0.5e-8, rel=1e-7)
    assert mobilised_share(SMALL * (1 - 1e-12)) == pytest.approx(mobilised_share(SMALL), rel=1e-11)


def test_the_share_is_the_mean_of_the_stress_under_the_track():
    length, modulus, slip = 2.5, 0.025, 0.08
    x = (np.arange(100000) + 0.5) / 100000 * length
    mean = (1 - np.exp(-slip * x / modulus)).mean()
    assert mobilised_share(slip * length / modulus) == pytest.approx(mean, rel=1e-8)


@pytest.mark.parametrize("share", [0.0, 1e-12, 1e-4, 0.01, 0.3, 0.5, 0.9, 0.99, 0.9999, 1 - 1e-9])
def test_the_slip_is_the_inverse(share):
    assert mobilised_share(slip_at(share, 1.0)) == pytest.approx(share, rel=1e-10, abs=1e-300)


def test_slip_grows_with_the_share_and_with_softer_ground():
    slips = [slip_at(share, 0.01) for share in np.linspace(0.0, 0.989, 500)]
    assert np.all(np.diff(slips) > 0)
    assert 0.9 < slips[-1] < 1.0
    assert slip_at(0.5, 0.02) == 2 * slip_at(0.5, 0.01)
    assert slip_at(0.5, 0.0) == 0.0  # ground that does not yield
