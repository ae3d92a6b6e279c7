"""The paper's grid update, line by line; equal to its slow twins; exact in volume; symmetric; at rest."""

from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dirt_env.sim.params import Grid
from dirt_env.sim.voxel import update, update_all
from dirt_env.sim.voxel_agent import constrain
from dirt_env.sim.voxel_plain import plain_update
from dirt_env.sim.voxel_state import GRAIN, Rules, make_voxels, volume
from tests import naive_voxel

RULES = Rules(difference=0.5)
STATE = ("fill", "incoming", "life")
SEEDS = st.integers(0, 2**32 - 1)


def empty(rows=3, cols=3, levels=3, **others):
    """Cells without soil; the middle column is (2, 2) and the lowest level 1."""
    return make_voxels(np.zeros((rows, cols)), Grid(rows, cols, 1.0), 1.0, 0.0, levels, **others)


def filled(cells, rows=3, cols=3, levels=3):
    """Cells with the given fills by (row, column, level)."""
    voxels = empty(rows, cols, levels)
    for index, fill in cells.items():
        voxels.fill[index] = fill
    return voxels


def wild(seed, rows=9, cols=7, levels=5, steps=2**12):
    """Cells with fill here and there, overfull ones and constraints among them; fills are multiples of 1 / `steps`."""
    rng = np.random.default_rng(seed)
    voxels = empty(rows, cols, levels)
    inner = np.s_[1:-1, 1:-1, 1:-1]
    shape = (rows, cols, levels)
    voxels.fill[inner] = rng.integers(0, 2 * steps, shape) * (rng.random(shape) < 0.5) / steps
    voxels.life[inner] = rng.integers(1, 9, shape) * (rng.random(shape) < 0.1)
    return voxels


def assert_same(a, b, names=STATE):
    for name in names:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


# --- Algorithm 2 in the order of its lines


def test_incoming_fill_is_accepted_first_and_takes_part_in_the_same_update():
    voxels = empty()
    voxels.incoming[2, 2, 1] = 0.25
    update(voxels, RULES)
    assert voxels.fill[2, 2, 1] == 0.25
    assert voxels.incoming.sum() == 0.0


def test_fill_sinks_at_once_as_far_as_the_cell_below_has_room():
    voxels = filled({(2, 2, 1): 0.75, (2, 2, 2): 0.5})
    update(voxels, Rules(difference=1.0))
    assert voxels.fill[2, 2, 1] == 1.0
    assert voxels.fill[2, 2, 2] == 0.25


def test_fill_sinks_before_it_spreads():
    voxels = filled({(2, 2, 2): 1.0})
    update(voxels, RULES)
    assert voxels.fill[2, 2, 2] == 0.0
    assert voxels.incoming[:, :, 2].sum() == 0.0, "nothing was left to spread on the upper level"
    spread = voxels.incoming[:, :, 1].sum()
    assert spread == pytest.approx(0.08), "what has sunk spreads where it is now"


def test_fill_in_the_air_falls_one_level_an_update():
    voxels = filled({(2, 2, 3): 0.25})
    update(voxels, RULES)
    assert voxels.fill[2, 2].tolist() == [0, 0, 0.25, 0, 0]
    update(voxels, RULES)
    assert voxels.fill[2, 2].tolist() == [0, 0.25, 0, 0, 0]


def test_eight_per_cent_of_the_fill_go_in_equal_parts_to_all_available_neighbours():
    voxels = filled({(2, 2, 1): 0.9, (2, 1, 1): 0.4, (1, 2, 1): 0.39})
    update(voxels, RULES)
    lost = 0.9 * 0.08
    assert voxels.fill[2, 2, 1] == pytest.approx(0.9 - lost, rel=1e-15)
    sent = [voxels.incoming[2, 1, 1], voxels.incoming[1, 2, 1], voxels.incoming[3, 2, 1], voxels.incoming[2, 3, 1]]
    assert sent == [0.0, *[pytest.approx(lost / 3, rel=1e-15)] * 3], "0.9 - 0.4 is no more than the required difference"
    assert volume(voxels, 1.0) == pytest.approx(1.69, rel=1e-15)


def test_fill_arrives_with_the_next_update():
    voxels = filled({(2, 2, 1): 0.9})
    update(voxels, RULES)
    assert voxels.fill[2, 3, 1] == 0.0
    assert voxels.incoming[2, 3, 1] > 0.0
    part = voxels.incoming[2, 3, 1]
    update(voxels, RULES)
    assert voxels.fill[2, 3, 1] == part


def test_overflow_goes_up_only_where_no_neighbour_is_available():
    full = {(r, c, 1): 1.0 for r in (1, 2, 3) for c in (1, 2, 3)}
    voxels = filled({**full, (2, 2, 1): 1.375})
    update(voxels, RULES)
    assert voxels.fill[2, 2, 1] == 1.0
    assert voxels.incoming[2, 2, 2] == 0.375
    voxels = filled({**full, (2, 2, 1): 1.375, (2, 1, 1): 0.0})
    update(voxels, RULES)
    assert voxels.incoming[2, 2, 2] == 0.0
    assert voxels.incoming[2, 1, 1] == pytest.approx((1.375 + 1.0 + 1.0) * 0.08), "from three sides"


def test_the_topmost_level_keeps_its_overflow():
    voxels = filled({(1, 1, 1): 2.5}, rows=1, cols=1, levels=1)
    assert update(voxels, RULES, 10) == 1
    assert voxels.fill[1, 1, 1] == 2.5


@pytest.mark.parametrize("life", [1, 100])
def test_a_constraint_blocks_for_exactly_its_life(life):
    voxels = filled({(2, 2, 1): 0.9}, rows=3, cols=3, levels=1)
    for r, c in ((1, 2), (2, 1), (3, 2), (2, 3)):
        constrain(voxels.life, r, c, 1, life)
    assert update(voxels, RULES, life) == life
    assert voxels.fill[2, 2, 1] == 0.9
    assert voxels.incoming.sum() == 0.0
    update(voxels, RULES)
    assert voxels.incoming[2, 3, 1] > 0.0


def test_a_constraint_blocks_from_above_from_the_sides_and_from_below_and_lets_out():
    full = {(r, c, 1): 1.0 for r in (1, 2, 3) for c in (1, 2, 3)}
    voxels = filled({**full, (2, 2, 3): 0.5, (2, 1, 2): 0.9, (2, 2, 1): 1.5})
    constrain(voxels.life, 2, 2, 2, 100)
    update(voxels, RULES, 50)
    assert voxels.fill[2, 2, 2] == 0.0
    assert voxels.fill[2, 2, 3] == 0.5
    assert voxels.fill[2, 2, 1] == 1.5
    voxels = filled({(2, 2, 1): 0.9})
    constrain(voxels.life, 2, 2, 1, 100)
    update(voxels, RULES)
    assert voxels.fill[2, 2, 1] < 0.9


# --- equality with slower twins


@pytest.mark.parametrize("grain", [0.0, GRAIN])
@given(seed=SEEDS)
def test_the_window_the_full_sweep_and_the_plain_kernel_agree_to_the_last_bit(grain, seed):
    rules = RULES._replace(grain=grain)
    window, full, plain = wild(seed), wild(seed), wild(seed)
    for _ in range(25):
        update(window, rules)
        update_all(full, rules)
        plain_update(plain.fill, plain.incoming, plain.life, rules)
        assert_same(window, full)
        assert_same(window, plain)


@given(seed=SEEDS)
def test_the_cells_are_those_of_the_paper_as_objects_with_lists(seed):
    voxels = wild(seed, 5, 4, 3)
    cells = naive_voxel.cells_of(voxels)
    for _ in range(12):
        update(voxels, RULES)
        naive_voxel.grid_update(cells, RULES)
        for index, cell in cells.items():
            assert voxels.fill[index] == pytest.approx(cell.fill, abs=1e-14)
            assert voxels.incoming[index] == pytest.approx(sum(cell.incoming), abs=1e-14)


def test_leaving_out_what_is_at_rest_changes_nothing_over_a_long_collapse():
    ground = np.full((30, 30), 2.0)
    ground[6:11, 5:10] = 12.0
    grid, rules = Grid(30, 30, 1.0), Rules(difference=0.2)
    window, full = (make_voxels(ground, grid, 1.0, 0.0, 14) for _ in range(2))
    done = update(window, rules, 10000)
    assert 50 < done < 10000
    update_all(full, rules, done)
    assert_same(window, full)
    assert window.active[1] == window.active[0] == 0


# --- volume


@pytest.mark.parametrize("change", [{}, {"neighbours": 8}, {"in_place": True}, {"down_in_transit": True}])
@given(seed=SEEDS)
def test_volume_is_kept_by_every_reading_on_offer_and_equal_with_a_grain(change, seed):
    for grain in (0.0, GRAIN):
        voxels = wild(seed)
        before = volume(voxels, 1.0)
        update(voxels, RULES._replace(grain=grain, **change), 60)
        assert volume(voxels, 1.0) == (before if grain else pytest.approx(before, rel=1e-13))
        assert voxels.fill.min() >= 0.0


def test_sending_the_whole_fill_up_makes_soil():
    cells = naive_voxel.cells_of(filled({(1, 1, 1): 1.5}, rows=1, cols=1, levels=60))
    for _ in range(60):
        naive_voxel.grid_update(cells, RULES, up="all")
    assert naive_voxel.volume(cells) > 10 * 1.5


def test_capping_the_topmost_level_destroys_soil():
    cells = naive_voxel.cells_of(filled({(1, 1, 1): 2.5}, rows=1, cols=1, levels=2))
    for _ in range(4):
        naive_voxel.grid_update(cells, RULES, cap=True)
    assert naive_voxel.volume(cells) == 2.0


def test_rising_into_a_constraint_is_a_reading_on_offer():
    voxels = filled({(1, 1, 1): 1.5}, rows=1, cols=1, levels=2)
    constrain(voxels.life, 1, 1, 2, 100)
    update(voxels, RULES, 3)
    assert voxels.fill[1, 1, 1] == 1.5
    update(voxels, RULES._replace(rise_into_constraint=True), 3)
    assert voxels.fill[1, 1, 2] == 0.5


# --- symmetry


@given(seed=SEEDS)
def test_mirrored_and_turned_grids_stay_mirrored_and_turned_to_the_last_bit(seed):
    for turn in (lambda a: a[::-1], lambda a: a[:, ::-1], lambda a: a.transpose(1, 0, 2)):
        a, b = wild(seed, 8, 8), wild(seed, 8, 8)
        for name in STATE:
            getattr(b, name)[:] = turn(getattr(a, name)).copy()
        update(a, RULES, 30)
        update(b, RULES, 30)
        for name in STATE:
            np.testing.assert_array_equal(turn(getattr(a, name)), getattr(b, name))


def test_reading_in_place_breaks_the_symmetry():
    snapshot, in_place = wild(3), wild(3)
    for voxels, rules in ((snapshot, RULES), (in_place, RULES._replace(in_place=True))):
        voxels.life[voxels.life > 0] = 0
        voxels.fill[:] = np.maximum(voxels.fill, voxels.fill[::-1])
        update(voxels, rules, 30)
    np.testing.assert_array_equal(snapshot.fill, snapshot.fill[::-1])
    assert np.abs(in_place.fill - in_place.fill[::-1]).max() > 1e-3


# --- the cells against a height field of the 4-neighbour rule


@given(seed=SEEDS)
def test_a_settled_height_field_is_a_fixed_point(seed):
    rng = np.random.default_rng(seed)
    slope = rng.uniform(0.1, 0.95)
    x, y = np.meshgrid(np.arange(12), np.arange(10))
    ground = sum(rng.uniform(0, 3) * np.cos(rng.uniform(0, 1) * x + rng.uniform(0, 1) * y + k) for k in range(3)) + 9.0
    steep = max(np.abs(np.diff(ground, axis=0)).max(), np.abs(np.diff(ground, axis=1)).max())
    ground = ground * min(1.0, slope * 0.999 / steep)
    voxels = make_voxels(ground, Grid(10, 12, 1.0), 1.0, 0.0, 30)
    fill = voxels.fill.copy()
    assert update(voxels, Rules(difference=slope), 5) == 1
    np.testing.assert_array_equal(voxels.fill, fill)
    assert voxels.incoming.sum() == 0.0


def field_update(height, coming, rules):
    """The 4-neighbour rule on heights that are shares of one level: `rate` of a column to all neighbours lower by more
    than `difference`; it arrives with the next update.
    """
    h = np.pad(height + coming, 1, constant_values=np.inf)
    inner = h[1:-1, 1:-1]
    lower = [inner - h[r : r + height.shape[0], c : c + height.shape[1]] > rules.difference
             for r, c in ((1, 0), (1, 2), (0, 1), (2, 1))]  # fmt: skip
    count = sum(side.astype(float) for side in lower)
    sent = np.where(count > 0, inner * rules.rate / np.maximum(count, 1), 0.0)
    west, east, south, north = (np.pad(np.where(side, sent, 0.0), 1) for side in lower)
    coming = (east[1:-1, :-2] + west[1:-1, 2:]) + (north[:-2, 1:-1] + south[2:, 1:-1])
    return inner - count * sent, coming


@given(seed=SEEDS)
def test_ground_that_the_four_neighbour_rule_has_settled_is_a_fixed_point(seed):
    rng = np.random.default_rng(seed)
    rules = Rules(difference=rng.uniform(0.2, 0.9))
    height = rng.uniform(3.0, 6.0, (7, 8)) + 2.0 * (rng.random((7, 8)) < 0.2)
    for _ in range(4000):
        steep = [h[:, :-1] - h[:, 1:] for h in (height, height.T)]
        move = [0.25 * np.sign(d) * np.maximum(np.abs(d) - 0.999 * rules.difference, 0.0) for d in steep]
        if max(m.max(initial=0.0) for m in map(np.abs, move)) < 1e-9:
            break
        for axis, m in enumerate(move):
            m = m if axis == 0 else m.T
            height -= np.pad(m, [(0, 0), (0, 1)] if axis == 0 else [(0, 1), (0, 0)])
            height += np.pad(m, [(0, 0), (1, 0)] if axis == 0 else [(1, 0), (0, 0)])
    assert max(np.abs(np.diff(height, axis=axis)).max() for axis in (0, 1)) <= rules.difference
    voxels = make_voxels(height, Grid(7, 8, 1.0), 1.0, 0.0, 10)
    fill = voxels.fill.copy()
    assert update(voxels, rules, 5) == 1
    np.testing.assert_array_equal(voxels.fill, fill)


@given(seed=SEEDS)
def test_on_one_level_cells_and_height_field_agree_step_by_step_and_at_rest(seed):
    rng = np.random.default_rng(seed)
    height = rng.uniform(0.0, 1.0, (8, 9))
    rules = Rules(difference=rng.uniform(0.3, 0.7))
    voxels = make_voxels(height, Grid(8, 9, 1.0), 1.0, 0.0, 1)
    coming = np.zeros_like(height)
    for _ in range(80):
        update_all(voxels, rules)
        height, coming = field_update(height, coming, rules)
        np.testing.assert_array_equal(voxels.fill[1:-1, 1:-1, 1], height)
        np.testing.assert_array_equal(voxels.incoming[1:-1, 1:-1, 1], coming)
    steep = max(np.abs(np.diff(height, axis=0)).max(), np.abs(np.diff(height, axis=1)).max())
    at_rest = update(voxels, rules) == 0 or voxels.active[1] == voxels.active[0]
    assert at_rest == (steep <= rules.difference and not coming.any())


def test_an_overhang_stays_in_the_air_while_its_constraint_lasts_and_no_height_field_can_say_so():
    voxels = filled({(2, 2, 3): 0.5}, rows=3, cols=3, levels=4)
    constrain(voxels.life, 2, 2, 2, 100)
    update(voxels, RULES, 100)
    assert voxels.fill[2, 2].tolist() == [0, 0, 0, 0.5, 0, 0]
    update(voxels, RULES, 3)
    assert voxels.fill[2, 2].tolist() == [0, 0.5, 0, 0, 0, 0]


def test_across_a_level_slopes_up_to_twice_the_required_difference_are_at_rest():
    ground = np.array([[0.55, 1.45, 1.45]])
    voxels = make_voxels(ground, Grid(1, 3, 1.0), 1.0, 0.0, 3)
    assert update(voxels, RULES, 100) == 1
    _height, coming = field_update(ground, np.zeros((1, 3)), RULES)
    assert coming.any(), "the height field of the same threshold moves"


@pytest.mark.parametrize("slope", [0.3, 0.7, 0.95])
def test_settled_piles_stand_between_the_required_difference_and_twice_that(slope):
    ground = np.zeros((41, 41))
    ground[18:23, 18:23] = 9.0
    voxels = make_voxels(ground, Grid(41, 41, 1.0), 1.0, 0.0, 12)
    assert update(voxels, Rules(difference=slope), 30000) < 30000
    pile = voxels.fill[1:-1, 1:-1, 1:-1].sum(axis=2)
    steepest = max(np.abs(np.diff(pile, axis=0)).max(), np.abs(np.diff(pile, axis=1)).max())
    assert slope < steepest <= 2 * slope


def test_a_required_difference_of_one_freezes_walls():
    ground = np.zeros((5, 5))
    ground[2, 2] = 4.0
    voxels = make_voxels(ground, Grid(5, 5, 1.0), 1.0, 0.0, 6)
    assert update(voxels, Rules(difference=1.0), 50) == 1


@pytest.mark.parametrize(("fill", "rate"), [(1.0, 0.10), (0.5, 0.23), (1.0, 0.13), (0.5, 0.27)])
def test_two_cells_swap_soil_for_ever_where_the_rate_exceeds_the_required_difference_over_the_fill(fill, rate):
    """What goes, rate * fill, is then more than r: after it the other cell is fuller by as much as this one was."""
    rules = Rules(difference=0.12, rate=rate)
    voxels = make_voxels(np.array([[fill, fill * (1.0 - rate) - 0.002]]), Grid(1, 2, 1.0), 1.0, 0.0, 1)
    done = update(voxels, rules, 20000)
    assert (done == 20000) == (rate * fill > rules.difference)
    before = (voxels.fill + voxels.incoming)[1, 1:3, 1]
    update_all(voxels, rules)
    after = (voxels.fill + voxels.incoming)[1, 1:3, 1]
    assert after == pytest.approx(before[::-1] if done == 20000 else before, abs=1e-12)


@pytest.mark.parametrize("fill", [0.1, 0.25, 0.6, 0.95])
def test_rough_ground_comes_to_rest_up_to_a_rate_of_about_the_required_difference_over_its_fill(fill):
    def comes_to_rest(rate):
        ground = np.random.default_rng(1).uniform(fill - 0.05, fill + 0.05, (12, 12))
        voxels = make_voxels(ground, Grid(12, 12, 1.0), 1.0, 0.0, 2)
        return update(voxels, Rules(difference=0.03, rate=rate), 4000) < 4000

    assert comes_to_rest(0.75 * 0.03 / fill)
    assert not comes_to_rest(1.4 * 0.03 / fill)


def test_solid_columns_take_nothing():
    solid = np.zeros((5, 5), bool)
    solid[2, 3] = True
    ground = np.zeros((5, 5))
    ground[2, 2] = 3.0
    voxels = make_voxels(ground, Grid(5, 5, 1.0), 1.0, 0.0, 5, solid=solid)
    update(voxels, RULES, 2000)
    assert voxels.fill[3, 4].sum() == 0.0
    assert voxels.fill[3, 3].sum() < 3.0
    assert volume(voxels, 1.0) == pytest.approx(3.0, rel=1e-14)


def test_an_open_border_takes_soil_and_gives_none():
    ground = np.zeros((3, 3))
    ground[1, 0] = 3.0
    voxels = make_voxels(ground, Grid(3, 3, 1.0), 1.0, 0.0, 5, open_border=True)
    rim = voxels.fill[0].copy()
    update(voxels, RULES, 3000)
    assert volume(voxels, 1.0) < 2.9
    np.testing.assert_array_equal(voxels.fill[0], rim)


def test_cells_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="allowed: 1 level to 67108864 cells"):
        empty(levels=0)


def test_a_column_collapses_to_a_heap_about_its_middle():
    ground = np.zeros((31, 31))
    ground[14:17, 14:17] = 8.0
    voxels = make_voxels(ground, Grid(31, 31, 1.0), 1.0, 0.0, 10)
    update(voxels, RULES, 30000)
    pile = voxels.fill[1:-1, 1:-1, 1:-1].sum(axis=2)
    far = max(hypot(r - 15, c - 15) for r, c in np.argwhere(pile > 0))
    assert 3 < far < 14
    np.testing.assert_array_equal(pile, pile.T)
