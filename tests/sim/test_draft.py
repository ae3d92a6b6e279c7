"""Draft by the equation of earthmoving: limits with known answers, and a twin that solves the wedge's two balances."""

from itertools import pairwise
from math import cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

from dirt_env.config.presets import PRESETS
from dirt_env.sim.draft import Cut, draft_force, earthmoving_factors, weight_factor
from dirt_env.sim.laws import GRAVITY
from dirt_env.sim.params import Blade, Soil, Strength
from dirt_env.sim.traction import cut_of

UPRIGHT = radians(90.0)
FRICTIONS = [radians(angle) for angle in (5.0, 20.0, 30.0, 34.0, 45.0)]
ANGLES = [(60.0, 34.0, 17.0), (45.0, 20.0, 10.0), (90.0, 30.0, 20.0), (75.0, 10.0, 0.0), (110.0, 25.0, 12.0)]


def passive(friction):
    """Rankine's coefficient of passive earth pressure."""
    return tan(pi / 4 + friction / 2) ** 2


@pytest.mark.parametrize("friction", FRICTIONS)
def test_a_smooth_upright_blade_gives_rankines_passive_pressure(friction):
    factors = earthmoving_factors(UPRIGHT, friction, 0.0)
    assert factors.plane == pytest.approx(pi / 4 - friction / 2, abs=1e-6)
    assert factors.weight == pytest.approx(passive(friction) / 2, rel=1e-12)
    assert factors.cohesion == pytest.approx(2 * sqrt(passive(friction)), rel=1e-9)
    assert factors.surcharge == pytest.approx(passive(friction), rel=1e-12)
    assert factors.pull == 1.0


def test_soil_without_friction_on_a_smooth_upright_blade_stands_twice_its_cohesion():
    factors = earthmoving_factors(UPRIGHT, 0.0, 0.0)
    assert factors.plane == pytest.approx(pi / 4, abs=1e-3)
    assert (factors.weight, factors.cohesion, factors.surcharge) == pytest.approx((0.5, 2.0, 1.0), rel=1e-5)


def wedge_force(rake, internal, external, plane, depth, heavy, cohesion, surcharge, adhesion):
    """Force on the blade [N/m] from the two force balances of the wedge, solved as they stand; and its way ahead."""
    top = depth * (1 / tan(rake) + 1 / tan(plane))
    down = 0.5 * heavy * depth * top + surcharge * top + cohesion * depth + adhesion * depth
    back = cohesion * depth / tan(plane) - adhesion * depth / tan(rake)
    balances = [
        [sin(rake + external), -sin(plane + internal)],
        [cos(rake + external), cos(plane + internal)],
    ]
    return np.linalg.solve(balances, [back, down])[0]


@pytest.mark.parametrize(("rake", "internal", "external"), [tuple(map(radians, angles)) for angles in ANGLES])
def test_the_factors_solve_the_balance_of_forces_on_the_wedge(rake, internal, external):
    depth, heavy, cohesion, surcharge, adhesion = 0.3, 15e3, 4e3, 7e3, 1e3
    n = earthmoving_factors(rake, internal, external)
    force = depth * (heavy * depth * n.weight + cohesion * n.cohesion + surcharge * n.surcharge + adhesion * n.adhesion)
    expected = wedge_force(rake, internal, external, n.plane, depth, heavy, cohesion, surcharge, adhesion)
    assert force == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("rake", "internal", "external"), [tuple(map(radians, angles)) for angles in ANGLES])
def test_no_other_plane_gives_way_more_easily(rake, internal, external):
    n = earthmoving_factors(rake, internal, external)
    planes = np.linspace(0.01, pi - rake - internal - external - 0.01, 2000)
    assert n.weight <= min(weight_factor(plane, rake, internal, external) for plane in planes) * (1 + 1e-12)


def cut(internal=34.0, external=17.0, rake=60.0, slope=0.7, width=3.0, **strength):
    soil = Soil(slope=slope, density=1500.0, friction=0.7)
    angles = {"internal_friction": radians(internal), "external_friction": radians(external)}
    return cut_of(soil, Strength(**angles, **strength), Blade(width=width), radians(rake))


def test_a_smooth_upright_blade_in_the_kernel_too():
    found = draft_force(0.4, 0.0, cut(30.0, 0.0, 90.0))
    assert found == pytest.approx(0.5 * 3.0 * 1500.0 * GRAVITY * 0.4**2 * 3.0, rel=1e-12)  # K_p = 3
    held = draft_force(0.4, 0.0, cut(30.0, 0.0, 90.0, cohesion=5e3)) - found
    assert held == pytest.approx(2 * 5e3 * sqrt(3.0) * 0.4 * 3.0, rel=1e-9)


def test_no_cut_and_no_load_is_no_draft_and_a_load_alone_slides():
    constants = cut(cohesion=2e4, adhesion=5e3)
    assert draft_force(0.0, 0.0, constants) == 0.0
    assert draft_force(0.0, 2.0, constants) == pytest.approx(0.7 * 1500.0 * GRAVITY * 2.0)


def test_a_load_that_lies_on_the_wedge_as_a_whole_is_a_surcharge():
    """Without friction on the ground the load counts only so far as it lies on the wedge; mud lies level, and all of it
    counts there.
    """
    n = earthmoving_factors(radians(60.0), radians(34.0), radians(17.0))
    for slope in (0.7, 0.0):
        constants = cut(slope=slope)
        top, load = 1.0 * constants.top, 0.5
        pressed = draft_force(1.0, load, constants) - draft_force(1.0, 0.0, constants)
        spread = load * 1500.0 * GRAVITY / (3.0 * top)  # Pa
        assert pressed == pytest.approx(3.0 * spread * 1.0 * n.surcharge * n.pull, rel=1e-12)


def test_draft_grows_with_depth_load_frictions_and_cohesion_without_a_jump():
    constants = cut(cohesion=1e3)
    depths = [draft_force(depth, 1.5, constants) for depth in np.linspace(0.0, 1.0, 400)]
    loads = [draft_force(0.2, load, constants) for load in np.linspace(0.0, 4.0, 400)]
    for forces in (depths, loads):
        assert all(low < high for low, high in pairwise(forces))
        assert np.diff(forces, 2).max() < 0.05 * np.ptp(forces)
    for changes in (
        [{"internal": angle} for angle in range(5, 50, 5)],
        [{"external": angle} for angle in range(0, 30, 5)],
        [{"cohesion": c} for c in (0.0, 1e3, 1e4)],
        [{"adhesion": c} for c in (0.0, 1e3, 1e4)],
        [{"width": w} for w in (1.0, 2.0, 3.0)],
    ):
        forces = [draft_force(0.25, 1.0, cut(**change)) for change in changes]
        assert all(low < high for low, high in pairwise(forces)), changes


@pytest.mark.parametrize("name", PRESETS)
def test_soils_by_name_have_draft(name):
    soil = PRESETS[name]
    found = draft_force(0.2, 1.0, cut(soil["internal_friction"], soil["external_friction"], cohesion=soil["cohesion"]))
    assert 5e3 < found < 1e5


def test_constants_name_what_they_multiply():
    assert draft_force(2.0, 0.0, Cut(weight=3.0, hold=5.0, press=0.0, slide=0.0, top=1.0, slope=1.0, width=1.0)) == 22.0
