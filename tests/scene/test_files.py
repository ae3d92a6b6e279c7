"""Height maps from files: the same ground out of every format; what a file lacks or does wrong is said."""

import sys

import numpy as np
import pytest
import rasterio
from PIL import Image
from rasterio.transform import Affine

from dirt_env.scene import files
from dirt_env.scene.files import Reading, read_mask, read_raster

NORTH_UP = np.array([[5.0, 6.0, 7.0], [1.0, 2.0, 3.0]])  # first row north
SOUTH_UP = NORTH_UP[::-1]


def pixels(across, down):
    """The transform of a map whose first row is the northern one."""
    return Affine(across, 0.0, 10.0, 0.0, -down, 50.0)


def write_tif(path, heights=NORTH_UP, transform=None, crs="EPSG:32633", nodata=None):
    bands = heights if heights.ndim == 3 else heights[None]
    count, rows, cols = bands.shape
    transform = transform or pixels(2.0, 2.0)
    options = {"driver": "GTiff", "dtype": "float32", "crs": crs, "transform": transform, "nodata": nodata}
    with rasterio.open(path, "w", height=rows, width=cols, count=count, **options) as target:
        target.write(bands.astype("float32"))
    return str(path)


def write_asc(path, header="cellsize 2.0", body="5 6 7\n1 2 3\n", corner="xllcorner 100\nyllcorner 200"):
    path.write_text(f"ncols 3\nnrows 2\n{corner}\n{header}\nNODATA_value -99\n{body}")
    return str(path)


def test_every_format_gives_the_same_ground(tmp_path):
    np.save(tmp_path / "a.npy", SOUTH_UP)
    np.savez(tmp_path / "a.npz", elevation=NORTH_UP, spacing=np.float64(2.0))
    Image.fromarray(NORTH_UP.astype(np.uint16)).save(tmp_path / "a.png")
    read = [
        read_raster(str(tmp_path / "a.npy"), Reading()),
        read_raster(str(tmp_path / "a.npz"), Reading(first_row="north")),
        read_raster(str(tmp_path / "a.png"), Reading()),
        read_raster(write_asc(tmp_path / "a.asc"), Reading()),
        read_raster(write_tif(tmp_path / "a.tif"), Reading()),
    ]
    for raster in read:
        np.testing.assert_array_equal(raster.height, SOUTH_UP)
    assert [raster.cell for raster in read] == [None, None, None, 2.0, 2.0]


def test_png_keeps_sixteen_bits(tmp_path):
    Image.fromarray(np.array([[65535, 258]], dtype=np.uint16)).save(tmp_path / "a.png")
    assert read_raster(str(tmp_path / "a.png"), Reading()).height.tolist() == [[65535.0, 258.0]]


def test_nodata_of_the_file_and_of_the_scene_become_nan(tmp_path):
    holes = np.where(NORTH_UP == 6, -99.0, NORTH_UP)
    np.save(tmp_path / "a.npy", np.where(SOUTH_UP == 6, np.inf, SOUTH_UP))
    for raster in (
        read_raster(write_asc(tmp_path / "a.asc", body="5 -99 7\n1 2 3"), Reading()),
        read_raster(write_tif(tmp_path / "a.tif", holes, nodata=-99.0), Reading()),
        read_raster(write_tif(tmp_path / "b.tif", holes), Reading(nodata_value=-99.0)),
        read_raster(str(tmp_path / "a.npy"), Reading()),
    ):
        np.testing.assert_array_equal(raster.height, np.where(SOUTH_UP == 6, np.nan, SOUTH_UP))


def test_geotiff_reads_only_what_the_crop_needs(tmp_path):
    heights = np.arange(400.0).reshape(20, 20)
    path = write_tif(tmp_path / "a.tif", heights)
    raster = read_raster(path, Reading(crop=(8.0, 4.0, 16.0, 12.0)))
    assert raster.size == (40.0, 40.0)
    assert raster.origin == (6.0, 2.0)
    np.testing.assert_array_equal(raster.height, heights[::-1][1:7, 3:9])


def test_geotiff_with_south_first_is_turned(tmp_path):
    path = write_tif(tmp_path / "a.tif", SOUTH_UP, Affine(2.0, 0, 0, 0, 2.0, 0))
    np.testing.assert_array_equal(read_raster(path, Reading()).height, SOUTH_UP)


@pytest.mark.parametrize(
    ("transform", "crs", "said"),
    [
        (pixels(2.0, 3.0), "EPSG:32633", r"cells of 2 m x 3 m; allowed: squares"),
        (pixels(1e-4, 1e-4), "EPSG:4326", r"in degrees .*EPSG:4326.*; allowed: metres"),
        (pixels(2.0, 2.0), "EPSG:2225", r"in US survey foot of 0.304801 m; allowed: metres"),
        (Affine(2.0, 0.3, 0.0, 0.3, -2.0, 0.0), "EPSG:32633", r"is turned against its map"),
    ],
)
def test_geotiffs_that_are_no_square_metres_are_refused(tmp_path, transform, crs, said):
    with pytest.raises(ValueError, match=said):
        read_raster(write_tif(tmp_path / "a.tif", transform=transform, crs=crs), Reading())


def test_where_a_file_lies_on_its_map(tmp_path):
    assert read_raster(write_tif(tmp_path / "a.tif"), Reading()).corner == (10.0, 46.0)
    assert read_raster(write_asc(tmp_path / "a.asc"), Reading()).corner == (100.0, 200.0)
    centre = "xllcenter 100\nyllcenter 200"
    assert read_raster(write_asc(tmp_path / "c.asc", corner=centre), Reading()).corner == (99.0, 199.0)
    assert read_raster(write_asc(tmp_path / "n.asc", corner=""), Reading()).corner is None
    np.save(tmp_path / "a.npy", SOUTH_UP)
    assert read_raster(str(tmp_path / "a.npy"), Reading()).corner is None


@pytest.mark.parametrize("shape", [(0, 64), (64, 0)])
def test_files_without_a_cell_are_refused(tmp_path, shape):
    np.save(tmp_path / "a.npy", np.zeros(shape))
    with pytest.raises(ValueError, match=rf"a.npy has {shape[0]} x {shape[1]} cells; allowed: at least one"):
        read_raster(str(tmp_path / "a.npy"), Reading())


def test_bands(tmp_path):
    path = write_tif(tmp_path / "a.tif", np.stack([NORTH_UP, NORTH_UP + 10]))
    with pytest.raises(ValueError, match=r"has 2 bands; say which"):
        read_raster(path, Reading())
    np.testing.assert_array_equal(read_raster(path, Reading(band=2)).height, SOUTH_UP + 10)
    with pytest.raises(ValueError, match=r"ground.band is 3; allowed: 1 to 2"):
        read_raster(path, Reading(band=3))


@pytest.mark.parametrize(
    ("header", "corner", "body", "said"),
    [
        ("dx 2.0\ndy 3.0", "xllcorner 0\nyllcorner 0", "5 6 7 1 2 3", r"cells of 2 m x 3 m; allowed: squares"),
        ("cellsize 0.0008", "xllcorner -84.4\nyllcorner 36.6", "5 6 7 1 2 3", r"these are degrees"),
        ("cellsize 0", "xllcorner 0\nyllcorner 0", "5 6 7 1 2 3", r"cellsize 0; allowed: > 0 m"),
        ("cellsize 2", "xllcorner 0\nyllcorner 0", "5 6 7 1 2", r"has 5 heights; its header says 2 x 3 = 6"),
        ("cellsize 2", "xllcorner 0\nyllcorner 0", "5 6 7 1 2 x", r"no number"),
        ("cellsize inf", "xllcorner 0\nyllcorner 0", "5 6 7 1 2 3", r"cellsize inf; allowed: > 0 m"),
        ("", "xllcorner 0\nyllcorner 0", "5 6 7 1 2 3", r"no cellsize"),
        ("dx 2", "xllcorner 0\nyllcorner 0", "5 6 7 1 2 3", r"no cellsize"),
    ],
)
def test_faulty_ascii_grids_are_refused(tmp_path, header, corner, body, said):
    with pytest.raises(ValueError, match=said):
        read_raster(write_asc(tmp_path / "a.asc", header, body, corner), Reading())


@pytest.mark.parametrize("number", ["1e400", "0", "64.5", "-3", "nan"])
def test_sizes_of_ascii_grids_are_whole_and_positive(tmp_path, number):
    for name, other in (("ncols", "nrows 2"), ("nrows", "ncols 3")):
        (tmp_path / "a.asc").write_text(f"{name} {number}\n{other}\ncellsize 2\n5 6 7 1 2 3")
        with pytest.raises(ValueError, match=rf"a.asc has {name} {float(number):g}; allowed: whole numbers >= 1"):
            read_raster(str(tmp_path / "a.asc"), Reading())


def test_an_ascii_grid_with_a_byte_order_mark_is_read(tmp_path):
    path = write_asc(tmp_path / "a.asc")
    (tmp_path / "a.asc").write_bytes(b"\xef\xbb\xbf" + (tmp_path / "a.asc").read_bytes())
    np.testing.assert_array_equal(read_raster(path, Reading()).height, SOUTH_UP)


def test_faulty_arrays_are_refused(tmp_path):
    np.save(tmp_path / "cube.npy", np.zeros((2, 2, 2)))
    np.save(tmp_path / "pickle.npy", np.array([{}], dtype=object), allow_pickle=True)
    np.savez(tmp_path / "two.npz", a=np.zeros((2, 2)), b=np.zeros((2, 2)))
    (tmp_path / "broken.npz").write_bytes(b"PK\x03\x04 nothing")
    (tmp_path / "broken.tif").write_bytes(b"nothing")
    Image.new("RGB", (2, 2)).save(tmp_path / "colour.png")
    for name, said in {
        "cube.npy": r"shape \(2, 2, 2\)",
        "pickle.npy": r"Python objects",
        "two.npz": r"2 two-dimensional arrays \(a, b\); say ground.array",
        "broken.npz": r"cannot be read as .npz",
        "broken.tif": r"cannot be read as .tif",
        "colour.png": r"mode RGB; allowed: one grey channel",
        "missing.npy": r"is no file",
        "ground.jpg": r"ends in '.jpg'; allowed: .npy, .npz, .asc, .tif, .tiff, .png",
    }.items():
        with pytest.raises(ValueError, match=said):
            read_raster(str(tmp_path / name), Reading())
    with pytest.raises(ValueError, match=r"ground.array is 'c'; allowed: a, b"):
        read_raster(str(tmp_path / "two.npz"), Reading(array="c"))


@pytest.mark.parametrize("kept", [0, 20, 60, 2000])
def test_broken_pictures_and_masks_are_refused_by_name(tmp_path, kept):
    noise = np.random.default_rng(0).integers(0, 255, (200, 200)).astype(np.uint8)
    Image.fromarray(noise).save(tmp_path / "a.png")
    np.save(tmp_path / "a.npy", noise)
    for name in ("a.png", "a.npy"):
        (tmp_path / name).write_bytes((tmp_path / name).read_bytes()[:kept])
        for read in (lambda path: read_raster(path, Reading()), read_mask):
            with pytest.raises(ValueError, match=rf"{name} cannot be read as .{name[2:]}"):
                read(str(tmp_path / name))


def test_files_of_too_many_cells_are_refused_before_they_are_read(tmp_path, monkeypatch):
    """One cell too many is refused; as many as are allowed are read."""
    monkeypatch.setattr("dirt_env.scene.raster.LARGEST", 6)
    np.save(tmp_path / "a.npy", NORTH_UP)
    np.savez(tmp_path / "a.npz", NORTH_UP)
    Image.fromarray(NORTH_UP.astype(np.uint16)).save(tmp_path / "a.png")
    write_asc(tmp_path / "a.asc")
    for suffix in ("npy", "npz", "png", "asc"):
        assert read_raster(str(tmp_path / f"a.{suffix}"), Reading()).height.size == 6
    monkeypatch.setattr("dirt_env.scene.raster.LARGEST", 5)
    for suffix in ("npy", "npz", "png", "asc"):
        with pytest.raises(ValueError, match=rf"a.{suffix} has 2 x 3 = 6 cells; allowed: at most 5 at once"):
            read_raster(str(tmp_path / f"a.{suffix}"), Reading())
    with pytest.raises(ValueError, match="allowed: at most 5"):
        read_mask(str(tmp_path / "a.npy"))


def test_an_ascii_grid_of_ten_thousand_million_cells_is_refused_by_its_header(tmp_path):
    (tmp_path / "a.asc").write_text("ncols 100000\nnrows 100000\ncellsize 1\n" + "0 " * 3000)
    with pytest.raises(ValueError, match=r"a.asc has 100000 x 100000 = 1e\+10 cells; allowed: at most 67108864"):
        read_raster(str(tmp_path / "a.asc"), Reading())


INSIDE = np.array([[True, False, False], [True, True, False]])  # first row north


@pytest.mark.parametrize(("kind", "bright"), [("u1", 1), ("u1", 255), ("u2", 1), ("u2", 255), ("u2", 65535)])
def test_inside_a_mask_is_what_is_half_as_bright_as_its_brightest_pixel(tmp_path, kind, bright):
    Image.fromarray((INSIDE * bright).astype(kind)).save(tmp_path / "a.png")
    np.testing.assert_array_equal(read_mask(str(tmp_path / "a.png")), INSIDE[::-1])


def test_a_mask_at_half_and_just_below(tmp_path):
    Image.fromarray(np.array([[200, 100, 99, 0]], np.uint8)).save(tmp_path / "a.png")
    assert read_mask(str(tmp_path / "a.png")).tolist() == [[True, True, False, False]]


def test_a_dark_mask_has_nothing_inside(tmp_path):
    for kind in ("u1", "u2"):
        Image.fromarray(np.zeros((2, 3), kind)).save(tmp_path / "a.png")
        assert not read_mask(str(tmp_path / "a.png")).any()


@pytest.mark.parametrize("mode", ["1", "RGB", "RGBA", "P"])
def test_masks_in_other_modes(tmp_path, mode):
    Image.fromarray((INSIDE * 255).astype(np.uint8)).convert(mode).save(tmp_path / "a.png")
    np.testing.assert_array_equal(read_mask(str(tmp_path / "a.png")), INSIDE[::-1])


@pytest.mark.parametrize("mode", ["RGBA", "LA"])
def test_what_is_transparent_in_a_mask_is_dark(tmp_path, mode):
    white = Image.new(mode, (3, 2), "white")
    white.putalpha(Image.fromarray((INSIDE * 255).astype(np.uint8)))
    white.save(tmp_path / "a.png")
    np.testing.assert_array_equal(read_mask(str(tmp_path / "a.png")), INSIDE[::-1])


def test_first_row_of_a_georeferenced_file_is_not_up_to_the_scene(tmp_path):
    with pytest.raises(ValueError, match=r"ground.first_row is 'south'; a.asc says itself"):
        read_raster(write_asc(tmp_path / "a.asc"), Reading(first_row="south"))


def test_a_missing_package_is_named_with_its_command(tmp_path, monkeypatch):
    path = write_tif(tmp_path / "a.tif")
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(ImportError, match=r'pip install "\.\[files\]" in the checkout'):
        read_raster(path, Reading())


def test_suffixes_are_those_of_the_manual():
    assert files.SUFFIXES == (".npy", ".npz", ".asc", ".tif", ".tiff", ".png")
