"""Written layouts that vary: what belongs together stays together, mirrors are exact, nothing collides."""

import numpy as np
import pytest

from dirt_env.config import layout, load
from dirt_env.config.episode import parts
from dirt_env.scene import vary

SITE = {
    "site": {"size": [24.0, 16.0], "cell": 0.5},
    "start": [{"region": {"kind": "rectangle", "center": [6.0, 8.0], "size": [4.0, 2.0]}, "depth": 0.3}],
    "goal": [{"region": {"kind": "circle", "center": [17.0, 8.0], "radius": 3.0}}],
}


def scene(**tables):
    return load({**SITE, **tables})


def middle(mask):
    return np.array([axis.mean() for axis in np.nonzero(mask)])


def test_regions_move_together_within_their_shift():
    config = scene(vary={"shift": [2.0, 3.0], "mirror": False})
    base = layout(scene(), np.random.default_rng(0))
    moves = []
    for seed in range(40):
        one = layout(config, np.random.default_rng(seed))
        move = middle(one.start) - middle(base.start)
        assert np.abs(move - (middle(one.goal) - middle(base.goal))).max() < 1.0  # cells; rims are cut into cells
        moves.append(move * 0.5)
    north, east = np.array(moves).T
    assert 2.0 < np.abs(north).max() <= 3.25
    assert 1.3 < np.abs(east).max() <= 2.25


def test_a_start_with_a_shift_of_its_own_moves_against_the_goal():
    start = [{**SITE["start"][0], "shift": [0.0, 4.0]}]
    config = scene(start=start, vary={"mirror": False})
    base = layout(scene(), np.random.default_rng(0))
    found = [layout(config, np.random.default_rng(seed)) for seed in range(20)]
    assert all(np.array_equal(one.goal, base.goal) for one in found)
    assert np.ptp([middle(one.start)[0] for one in found]) * 0.5 > 4.0


def test_a_mirrored_layout_is_the_mirror_image_and_its_machine_too():
    config = scene(machine={"pose": [3.0, 7.0, 20.0]}, obstacle=[{"kind": "post", "center": [12.0, 4.0]}])
    one = layout(config, np.random.default_rng(0))
    other = vary.mirrored(one, config.setting, east_west=True, north_south=False)
    for name in ("height", "target", "start", "goal", "solid"):
        assert np.array_equal(getattr(other, name), getattr(one, name)[:, ::-1])
    assert other.pose == pytest.approx((21.0, 7.0, np.pi - np.radians(20.0)))
    back = vary.mirrored(other, config.setting, east_west=True, north_south=False)
    assert back.pose == pytest.approx(one.pose)
    both = vary.mirrored(one, config.setting, east_west=True, north_south=True)
    assert np.array_equal(both.height, one.height[::-1, ::-1])
    assert both.pose == pytest.approx((21.0, 9.0, -np.pi + np.radians(20.0)))


def test_all_four_mirror_images_are_drawn():
    config = scene(vary={})
    quarters = {tuple(middle(layout(config, np.random.default_rng(seed)).start) > (15.5, 23.5)) for seed in range(40)}
    assert {bool(east) for _, east in quarters} == {False, True}
    assert vary.Vary().mirror


def test_what_collides_is_drawn_anew_and_what_must_collide_is_refused():
    obstacle = [{"kind": "wall", "from": [6.0, 4.0], "to": [6.0, 12.0]}]
    start = [{"region": {"kind": "circle", "center": [3.0, 8.0], "radius": 2.0}, "volume": 2.0, "shift": [1.0, 4.0]}]
    config = scene(start=start, obstacle=obstacle, vary={"mirror": False}, machine={"pose": [12.0, 3.0, 0.0]})
    for seed in range(30):
        one = layout(config, np.random.default_rng(seed))
        assert one.start.sum() >= 44  # of the disc's 50 or so cells: the wall takes none
    stuck = [{"kind": "region", "region": {"kind": "circle", "center": [10.0, 8.0], "radius": 1.0}}]
    ring = {"kind": "circle", "center": [10.0, 8.0], "radius": 2.5}
    on_it = [{"region": ring, "depth": 0.3, "shift": [0.1, 0.1]}]
    with pytest.raises(ValueError, match="vary finds no place in 200 attempts"):
        scene(start=on_it, obstacle=stuck, vary={}, machine={"pose": [3.0, 3.0, 0.0]})


def test_a_ridge_and_a_hollow_move_along():
    ridge = {"kind": "ridge", "center": [8.0, 8.0]}
    hollow = [{"region": {"kind": "rectangle", "center": [12.0, 3.0], "size": [4.0, 2.0]}, "depth": 0.2}]
    config = scene(ground=ridge, hollow=hollow, vary={"shift": [1.0, 1.0]})
    moved = vary.shifted(parts(config), config.vary, config.setting, np.array([[1.0, -1.0], [0.0, 0.0], [0.0, 0.0]]))
    assert moved.ground.center == (9.0, 7.0)
    assert moved.hollows[0].region.center == (13.0, 2.0)
    assert moved.starts[0].region.center == (7.0, 7.0)


@pytest.mark.parametrize(
    ("tables", "complaint"),
    [
        ({"vary": {"shift": [9.0, 0.0]}}, r"start\[0\].region, shifted as far as it may be, reaches from x = -5"),
        ({"vary": {"shift": [-1.0, 0.0]}}, r"vary.shift\[0\] is -1"),
        ({"vary": {"turn": True}}, "vary.turn is not known"),
        ({"start": [{**SITE["start"][0], "shift": [1.0, 1.0]}]}, r"a shift and the scene has no \[vary\]"),
        ({"layout": {"level": 0}, "start": [], "goal": [], "vary": {}}, "layout is random and .*vary are given"),
    ],
)
def test_bad_tables_are_refused(tables, complaint):
    with pytest.raises(ValueError, match=complaint):
        scene(**tables)


def test_a_mask_stays_where_it_is(tmp_path):
    np.save(tmp_path / "goal.npy", np.arange(32 * 48).reshape(32, 48) % 48 > 30)
    goal = [{"region": {"kind": "mask", "path": str(tmp_path / "goal.npy")}}]
    assert layout(scene(goal=goal, vary={}), np.random.default_rng(0)).goal.any()
    with pytest.raises(ValueError, match=r"is the mask .*goal.npy; allowed: another kind, or no shift"):
        scene(goal=goal, vary={"shift": [1.0, 0.0]})
