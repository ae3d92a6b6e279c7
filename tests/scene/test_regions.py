"""Regions: exact cells, extents and errors."""

import numpy as np
import pytest
from PIL import Image

from dirt_env.scene.regions import Circle, Mask, Polygon, Rectangle, rasterize
from dirt_env.sim.params import Grid

GRID = Grid(24, 40, 0.5)  # 20 m east, 12 m north


def area(region, grid: Grid = GRID) -> float:
    return rasterize(region, grid, "region").sum() * grid.cell**2


def test_rectangle_on_cell_lines_has_its_exact_area():
    assert area(Rectangle((5.0, 6.0), (4.0, 3.0))) == 12.0
    assert area(Rectangle((5.0, 6.0), (4.0, 3.0), 90.0)) == 12.0


def test_row_zero_is_south_and_column_zero_west():
    mask = rasterize(Rectangle((1.0, 0.5), (2.0, 1.0)), GRID, "region")
    assert mask[:2, :4].all()
    assert mask.sum() == 8


def test_turned_shapes_keep_their_area_and_fine_cells_converge():
    fine = Grid(240, 400, 0.05)
    assert area(Circle((8.0, 6.0), 4.0), fine) == pytest.approx(np.pi * 16, rel=2e-3)
    assert area(Rectangle((8.0, 6.0), (6.0, 3.0), 30.0), fine) == pytest.approx(18.0, rel=5e-3)


def test_polygon_equals_rectangle_and_may_be_concave():
    box = Polygon(((3.0, 4.0), (9.0, 4.0), (9.0, 7.0), (3.0, 7.0)))
    same = rasterize(Rectangle((6.0, 5.5), (6.0, 3.0)), GRID, "r")
    assert (rasterize(box, GRID, "p") == same).all()
    angle = Polygon(((2.0, 2.0), (8.0, 2.0), (8.0, 4.0), (4.0, 4.0), (4.0, 8.0), (2.0, 8.0)))
    assert area(angle) == 6 * 2 + 2 * 4


def test_polygon_turned_around_is_the_same():
    points = ((2.1, 1.3), (9.7, 3.2), (6.4, 9.9), (3.3, 7.1))
    assert (Polygon(points).mask(GRID) == Polygon(points[::-1]).mask(GRID)).all()


def test_mask_files(tmp_path):
    wanted = np.zeros((24, 40), dtype=bool)
    wanted[2:5, 7:9] = True
    np.save(tmp_path / "mask.npy", wanted)
    Image.fromarray(np.where(wanted, 255, 0).astype(np.uint8)[::-1]).save(tmp_path / "mask.png")
    fine = np.repeat(np.repeat(wanted, 3, axis=0), 3, axis=1)
    np.save(tmp_path / "fine.npy", fine)
    for name in ("mask.npy", "mask.png", "fine.npy"):
        assert (rasterize(Mask(str(tmp_path / name)), GRID, "region") == wanted).all()


def test_mask_of_other_proportions_is_refused(tmp_path):
    np.save(tmp_path / "mask.npy", np.ones((10, 10), dtype=bool))
    with pytest.raises(ValueError, match=r"10 x 10 pixels; allowed: the site's 24 x 40"):
        rasterize(Mask(str(tmp_path / "mask.npy")), GRID, "region")


@pytest.mark.parametrize(
    "region", [Circle((19.0, 6.0), 2.0), Rectangle((1.0, 6.0), (2.0, 4.0), 45.0), Polygon(((1, 1), (2, 1), (1, 13)))]
)
def test_outside_the_site_is_an_error_with_the_numbers(region):
    with pytest.raises(ValueError, match=r"goal\[0\].region reaches .* x from 0 to 20 m and y from 0 to 12 m"):
        rasterize(region, GRID, "goal[0].region")


def test_a_region_between_cell_centres_is_an_error():
    with pytest.raises(ValueError, match="holds no cell centre"):
        rasterize(Circle((5.0, 5.0), 0.1), GRID, "region")
