"""Ground from a file: extent, resampling, cells without data."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dirt_env.scene.survey import HeightFile, fill, resample
from dirt_env.sim.params import Grid


def test_resampling_to_the_same_cells_changes_nothing():
    height = np.random.default_rng(0).random((7, 9))
    np.testing.assert_array_equal(resample(height, 0.5, 0.0, 0.0, Grid(7, 9, 0.5)), height)
    np.testing.assert_allclose(resample(height, 0.3, 0.0, 0.0, Grid(7, 9, 0.3)), height, rtol=1e-12)
    np.testing.assert_allclose(resample(height, 1.0, 2.0, 3.0, Grid(3, 4, 1.0)), height[3:6, 2:6], rtol=1e-14)


@pytest.mark.parametrize("cell", [0.25, 0.5, 2.0, 3.0])
def test_a_plane_stays_a_plane_at_any_cell(cell):
    y, x = np.mgrid[0:24, 0:36] + 0.5
    count = int(12 / cell)
    result = resample(0.3 * x - 0.2 * y, 1.0, 6.0, 6.0, Grid(count, count, cell))
    y, x = (np.mgrid[0:count, 0:count] + 0.5) * cell + 6.0
    np.testing.assert_allclose(result, 0.3 * x - 0.2 * y, rtol=1e-12, atol=1e-12)


def test_larger_cells_are_means():
    height = np.random.default_rng(0).random((8, 12))
    result = resample(height, 1.0, 0.0, 0.0, Grid(4, 6, 2.0))
    np.testing.assert_allclose(result, height.reshape(4, 2, 6, 2).mean(axis=(1, 3)), rtol=1e-14)


def test_holes_stay_as_large_as_they_are():
    height = np.ones((4, 4))
    height[1, 2] = np.nan
    result = resample(height, 1.0, 0.0, 0.0, Grid(8, 8, 0.5))
    assert np.isnan(result).sum() == 4
    assert np.isnan(result[2:4, 4:6]).all()
    np.testing.assert_allclose(result[~np.isnan(result)], 1.0, rtol=1e-15)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 17), st.integers(1, 17), st.integers(0, 2**32 - 1), st.floats(0.0, 0.95))
def test_filling_keeps_what_is_known_and_adds_no_extreme(rows, cols, seed, share):
    rng = np.random.default_rng(seed)
    height = rng.normal(size=(rows, cols))
    hole = rng.random((rows, cols)) < share
    hole[rng.integers(rows), rng.integers(cols)] = False
    result = fill(np.where(hole, np.nan, height))
    np.testing.assert_array_equal(result[~hole], height[~hole])
    assert result.min() >= height[~hole].min() - 1e-12
    assert result.max() <= height[~hole].max() + 1e-12


def survey(path, **keys):
    return HeightFile(str(path), **keys)


def test_datum_is_the_lowest_cell_of_the_site(tmp_path):
    np.save(tmp_path / "a.npy", 500.0 + np.arange(12.0).reshape(3, 4))
    found = survey(tmp_path / "a.npy", crop=(2.0, 1.0, 4.0, 3.0), pixel=1.0).survey(Grid(2, 2, 1.0))
    assert found.datum == 506.0
    assert found.height.tolist() == [[0.0, 1.0], [4.0, 5.0]]


def test_scale_and_offset(tmp_path):
    np.save(tmp_path / "a.npy", np.array([[100, 250]], dtype=np.uint16))
    found = survey(tmp_path / "a.npy", scale=0.01, offset=7.0).survey(Grid(1, 2, 1.0))
    assert found.datum == 8.0
    np.testing.assert_allclose(found.height, [[0.0, 1.5]])


def test_missing_data_needs_a_decision(tmp_path):
    height = np.arange(20.0).reshape(4, 5)
    height[1, 1:4] = np.nan
    np.save(tmp_path / "a.npy", height)
    with pytest.raises(ValueError, match=r'no data in 3 of the site\'s 20 cells \(15.0%\).*"wall".*"fill"'):
        survey(tmp_path / "a.npy").survey(Grid(4, 5, 1.0))
    found = survey(tmp_path / "a.npy", nodata="fill").survey(Grid(4, 5, 1.0))
    assert np.isfinite(found.height).all()
    assert found.missing.sum() == 3
    assert survey(tmp_path / "a.npy", crop=(0, 2, 5, 4)).survey(Grid(2, 5, 1.0)).missing.sum() == 0


def test_a_file_without_any_data_in_the_site_is_an_error(tmp_path):
    np.save(tmp_path / "a.npy", np.full((2, 2), np.nan))
    with pytest.raises(ValueError, match=r"no data in any of the site's 4 cells"):
        survey(tmp_path / "a.npy", nodata="fill").survey(Grid(2, 2, 1.0))


def test_crop_outside_the_file_and_unknown_cell_are_errors(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((3, 4)))
    with pytest.raises(ValueError, match=r"ground.crop is \[0, 0, 5, 3\].*from 0 to 4 m.*from 0 to 3 m"):
        survey(tmp_path / "a.npy", crop=(0, 0, 5, 3), pixel=1.0).extent(None)
    with pytest.raises(ValueError, match=r"say ground.pixel"):
        survey(tmp_path / "a.npy").extent(None)
