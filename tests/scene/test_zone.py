"""Maps of zones: numbers in the order of the regions, none without regions."""

import numpy as np
import pytest

from dirt_env.scene.regions import Circle, Rectangle
from dirt_env.scene.zone import zone_map
from dirt_env.sim.params import Grid

GRID = Grid(24, 40, 0.5)  # 20 m east, 12 m north
WHOLE, DISC = Rectangle((10.0, 6.0), (20.0, 12.0)), Circle((5.0, 6.0), 2.0)


def test_cells_have_the_number_of_the_last_region_that_holds_them():
    found = zone_map([WHOLE, DISC], GRID)
    assert found.dtype == np.int8
    np.testing.assert_array_equal(found == 2, DISC.mask(GRID))
    assert (found[~DISC.mask(GRID)] == 1).all()
    assert (zone_map([DISC, WHOLE], GRID) == 2).all()
    assert zone_map([DISC], GRID).min() == 0


def test_no_regions_make_no_map():
    assert zone_map([], GRID) is None


def test_a_region_beyond_the_site_is_named():
    with pytest.raises(ValueError, match=r"zone\[1\].region reaches"):
        zone_map([DISC, Circle((0.5, 6.0), 2.0)], GRID)
