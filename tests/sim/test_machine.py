"""How the machine stands, moves, and is held by what is solid."""

from math import cos, pi, sin

import numpy as np
import pytest

from dirt_env.sim.machine import drive, facing_of, ground_at, is_free, segment_is_free, track_plane, wrap
from dirt_env.sim.params import Blade, Machine
from dirt_env.sim.state import POSE
from dirt_env.sim.timestep import STRIDE
from tests import naive

BLADE, MACHINE = Blade(), Machine()
EAST = facing_of(0.0)


def pose_at(x, y, heading):
    pose = np.zeros(1, POSE)
    pose[0].x, pose[0].y, pose[0].heading = x, y, heading
    return pose


@pytest.mark.parametrize(("angle", "wrapped"), [(0.3, 0.3), (pi + 0.1, -pi + 0.1), (1000.0, 1000.0 - 159 * 2 * pi)])
def test_angles_are_wrapped(angle, wrapped):
    assert wrap(angle) == pytest.approx(wrapped, abs=1e-12)


def test_the_ground_between_cell_centres_is_bilinear():
    ground = np.add.outer(np.arange(6.0) * 2, np.arange(8.0)).astype(np.float32)
    assert ground_at(ground, 0.5, 1.9, 1.1) == pytest.approx(2 * (1.1 / 0.5 - 0.5) + 1.9 / 0.5 - 0.5)
    assert ground_at(ground, 0.5, -3.0, -3.0) == 0.0
    assert ground_at(ground, 0.5, 9.0, 9.0) == ground[-1, -1]


@pytest.mark.parametrize("heading", [0.0, 0.4, 2.0, -2.8])
def test_the_tracks_lie_in_the_plane_of_the_ground(heading):
    slope_x, slope_y = 0.11, -0.07
    x, y = np.meshgrid((np.arange(40) + 0.5) * 0.5, (np.arange(30) + 0.5) * 0.5)
    ground = (slope_x * x + slope_y * y + 2.0).astype(np.float32)
    z, pitch, roll = track_plane(ground, 0.5, 9.0, 7.0, facing_of(heading), BLADE, MACHINE)
    assert z == pytest.approx(slope_x * 9.0 + slope_y * 7.0 + 2.0, abs=0.02)
    assert pitch == pytest.approx(slope_x * cos(heading) + slope_y * sin(heading), abs=0.01)
    assert roll == pytest.approx(-slope_x * sin(heading) + slope_y * cos(heading), abs=0.01)


def test_the_plane_is_that_of_least_squares():
    ground = np.random.default_rng(1).normal(0, 0.2, (40, 40))
    blade = BLADE._replace(reach=50.0)

    def sample(x, y):
        return ground_at(ground, 0.5, x, y)

    expected = naive.track_plane(sample, 10.0, 9.0, 0.7, MACHINE)
    np.testing.assert_allclose(track_plane(ground, 0.5, 10.0, 9.0, facing_of(0.7), blade, MACHINE), expected, rtol=1e-9)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(1, 1), (1, 8), (3, 2), (7, 40), (40, 40)])
def test_the_plane_is_that_of_the_ground_at_its_points_on_any_map_and_behind_the_blade(shape, dtype):
    rng = np.random.default_rng(5)
    ground = rng.normal(0, 0.3, shape).astype(dtype)
    for _ in range(50):
        x, y, heading = rng.uniform((-1.0, -1.0, -pi), (0.5 * shape[1] + 1.0, 0.5 * shape[0] + 1.0, pi))
        blade = BLADE._replace(reach=rng.uniform(-1.0, 2.0))  # cuts across the tracks
        ahead_x, ahead_y = facing_of(heading)
        limit = x * ahead_x + y * ahead_y + blade.reach - STRIDE * 0.5

        def sample(at_x, at_y, facing=(ahead_x, ahead_y), limit=limit):
            return naive.ground_behind(ground.astype(float), 0.5, at_x, at_y, facing, limit)

        expected = naive.track_plane(sample, x, y, heading, MACHINE)
        found = track_plane(ground, 0.5, x, y, (ahead_x, ahead_y), blade, MACHINE)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("heading", [0.0, 0.25 * pi, 1.9])
def test_the_soil_ahead_of_the_blade_lifts_no_track(heading):
    x, y = np.meshgrid((np.arange(40) + 0.5) * 0.5, (np.arange(40) + 0.5) * 0.5)
    ahead = (x - 10.0) * cos(heading) + (y - 10.0) * sin(heading)
    ground = np.where(ahead > BLADE.reach, 1.0, 0.0).astype(np.float32)
    plane = track_plane(ground, 0.5, 10.0, 10.0, facing_of(heading), BLADE, MACHINE)
    np.testing.assert_allclose(plane, 0.0, atol=1e-12)


def test_the_machine_drives_on_an_arc():
    pose = pose_at(10.0, 10.0, 0.0)
    for _ in range(1000):
        drive(None, None, 80, 80, 0.5, pose[0], BLADE, MACHINE, 0.001 * 0.5 * pi * 4, 0.001 * 0.5 * pi)
    assert (pose[0].x, pose[0].y) == pytest.approx((14.0, 14.0), abs=1e-5)
    assert pose[0].heading == pytest.approx(0.5 * pi)


def test_walls_hold_the_blade_and_an_open_border_only_the_pivot():
    assert not is_free(None, None, 40, 40, 0.5, 18.6, 10.0, EAST, BLADE, MACHINE)
    assert is_free(None, None, 40, 40, 0.5, 18.4, 10.0, EAST, BLADE, MACHINE)
    outside = np.zeros((40, 40), np.float32)
    assert is_free(None, outside, 40, 40, 0.5, 19.9, 10.0, EAST, BLADE, MACHINE)
    assert not is_free(None, outside, 40, 40, 0.5, 20.1, 10.0, EAST, BLADE, MACHINE)


def test_a_held_machine_still_turns_and_backs_out():
    pose = pose_at(18.45, 10.0, 0.0)
    assert drive(None, None, 40, 40, 0.5, pose[0], BLADE, MACHINE, 0.2, 0.0) == (0.0, 0.0, EAST)
    assert pose[0].x == 18.45
    assert drive(None, None, 40, 40, 0.5, pose[0], BLADE, MACHINE, -0.2, 0.1) == (-0.2, 0.1, facing_of(0.1))


@pytest.mark.parametrize("width", [0.6, 3.0])
@pytest.mark.parametrize("cell", [0.25, 0.5])
def test_no_solid_cell_has_room_inside_the_machine(width, cell):
    n = int(20 / cell)
    blade = BLADE._replace(width=width)
    for row in range(int(8.8 / cell), int(11.2 / cell)):
        for col in range(int(8.5 / cell), int(11.5 / cell)):
            solid = np.zeros((n, n), bool)
            solid[row, col] = True
            x, y = (col + 0.5) * cell - 10.0, (row + 0.5) * cell - 10.0
            inside = abs(x) < 0.5 * MACHINE.length and abs(y) < 0.5 * MACHINE.width
            assert not (inside and is_free(solid, None, n, n, cell, 10.0, 10.0, EAST, blade, MACHINE))


def test_a_post_is_not_driven_over():
    solid = np.zeros((40, 40), bool)
    solid[20, 24] = True
    assert not is_free(solid, None, 40, 40, 0.5, 10.7, 10.2, EAST, BLADE, MACHINE)
    assert is_free(solid, None, 40, 40, 0.5, 8.0, 10.2, EAST, BLADE, MACHINE)
    assert not segment_is_free(solid, None, 40, 40, 0.5, 10.0, 10.2, 14.0, 10.2)
    assert segment_is_free(solid, None, 40, 40, 0.5, 10.0, 11.2, 14.0, 11.2)
