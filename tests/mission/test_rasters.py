import numpy as np
import pymap3d
import pyproj
import pytest
import rasterio

from mission.loading import load
from mission.site.position_table import read_positions
from mission.site.problem import problem_from_mission
from mission.site.rasters import Raster, read_array, read_geotiff, read_raster
from sim_bridge.state import GeodeticPoint

ORIGIN = GeodeticPoint(46.5197, 8.3312, 1420.0)


def geotiff(path, rows, crs, west, north, cell):
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=rows.shape[1],
        height=rows.shape[0],
        count=1,
        dtype="float32",
        crs=crs,
        transform=rasterio.Affine(cell, 0.0, west, 0.0, -cell, north),
    ) as target:
        target.write(rows.astype("float32"), 1)


def test_a_geotiff_in_utm_lands_where_pyproj_and_pymap3d_say(tmp_path):
    to_utm = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32632", always_xy=True)
    latitude, longitude, _ = pymap3d.enu2geodetic(
        430.0, -260.0, 0.0, ORIGIN.latitude_deg, ORIGIN.longitude_deg, ORIGIN.altitude_amsl_m
    )
    east, north = to_utm.transform(longitude, latitude)
    corner_east, corner_north = to_utm.transform(ORIGIN.longitude_deg, ORIGIN.latitude_deg)
    west, top, cell = round(corner_east - 2000.0), round(corner_north + 2000.0), 20.0
    axis = (np.arange(200) + 0.5) * cell
    rows = np.exp(-0.5 * ((west + axis[None] - east) ** 2 + (top - axis[:, None] - north) ** 2) / 60.0**2)
    geotiff(tmp_path / "map.tif", rows, "EPSG:32632", west, top, cell)
    raster = read_geotiff(tmp_path / "map.tif", ORIGIN, np.array([-800.0, -800.0]), np.array([800.0, 800.0]))
    share = raster.values / raster.values.sum()
    centers = [raster.low_m[axis] + (np.arange(n) + 0.5) * raster.cell_m[axis] for axis, n in enumerate(share.shape)]
    mean = np.array([share.sum(axis=1) @ centers[0], share.sum(axis=0) @ centers[1]])
    np.testing.assert_allclose(mean, [430.0, -260.0], atol=0.5)


def test_a_geotiff_elsewhere_or_without_a_place_is_refused(tmp_path):
    rows, low, high = np.ones((10, 10)), np.array([-100.0, -100.0]), np.array([100.0, 100.0])
    geotiff(tmp_path / "far.tif", rows, "EPSG:32632", 200_000.0, 4_000_000.0, 10.0)
    with pytest.raises(ValueError, match="does not touch the box"):
        read_geotiff(tmp_path / "far.tif", ORIGIN, low, high)
    with pytest.warns(rasterio.errors.NotGeoreferencedWarning):
        geotiff(tmp_path / "lost.tif", rows, None, 0.0, 0.0, 1.0)
    with pytest.raises(ValueError, match="does not say where it lies"):
        read_geotiff(tmp_path / "lost.tif", ORIGIN, low, high)
    (tmp_path / "no.tif").write_text("nothing")
    with pytest.raises(ValueError, match="cannot be read as a GeoTIFF"):
        read_geotiff(tmp_path / "no.tif", ORIGIN, low, high)


def test_a_mission_may_name_a_geotiff(sound, tmp_path):
    to_utm = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32632", always_xy=True)
    east, north = to_utm.transform(8.5456, 47.3977)
    rows = np.zeros((100, 100))
    rows[30:33, 40:43] = 1.0
    geotiff(tmp_path / "map.tif", rows, "EPSG:32632", east - 300.0, north + 800.0, 10.0)
    problem = problem_from_mission(load(sound, [f"information={{kind='raster', raster='{tmp_path / 'map.tif'}'}}"]))
    peak = problem.information.centers_m().reshape(-1, 3)[np.argmax(problem.information.mass)]
    np.testing.assert_allclose(peak[:2], [115.0, 485.0], atol=20.0)


def test_a_raster_cut_to_a_rectangle_keeps_its_cells_where_they_are():
    raster = Raster(np.arange(24.0).reshape(6, 4), np.array([-30.0, 10.0]), np.array([10.0, 10.0]))
    cut = raster.clipped(np.array([-12.0, 21.0]), np.array([15.0, 29.0]))
    np.testing.assert_array_equal(cut.values, raster.values[1:5, 1:2])
    np.testing.assert_array_equal(cut.low_m, [-20.0, 20.0])
    np.testing.assert_array_equal(cut.high_m, [20.0, 30.0])


def test_the_middle_or_the_peak_of_a_raster_is_where_it_was_asked_to_be(tmp_path):
    rows = np.ones((4, 6))
    rows[1, 4] = 2.0
    np.save(tmp_path / "map.npy", rows)
    settings = {"key": None, "cell_m": 10.0, "center_m": (100.0, 200.0), "north_first": True}
    middle = read_raster(tmp_path / "map.npy", **settings)
    np.testing.assert_array_equal([middle.low_m, middle.high_m], [[70.0, 180.0], [130.0, 220.0]])
    peak = read_raster(tmp_path / "map.npy", **settings, anchor_at_peak=True)
    column, row = np.unravel_index(np.argmax(peak.values), peak.values.shape)
    np.testing.assert_array_equal(peak.low_m + (np.array([column, row]) + 0.5) * 10.0, [100.0, 200.0])


def test_an_array_of_an_archive_is_chosen_by_its_name(tmp_path):
    np.savez(tmp_path / "two.npz", a=np.ones(3), b=np.zeros(2))
    assert read_array(tmp_path / "two.npz", "b").shape == (2,)
    with pytest.raises(ValueError, match=r'it holds a, b: write key = "a"'):
        read_array(tmp_path / "two.npz")


def test_a_file_that_would_run_code_is_refused(tmp_path):
    np.save(tmp_path / "code.npy", np.array([print], dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match="cannot be read"):
        read_array(tmp_path / "code.npy")


def test_an_archive_that_claims_to_be_huge_is_refused_before_it_is_unpacked(tmp_path):
    import zipfile

    with zipfile.ZipFile(tmp_path / "huge.npz", "w") as archive, archive.open("a.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6)})
    with pytest.raises(ValueError, match="too large"):
        read_array(tmp_path / "huge.npz")


@pytest.mark.parametrize("geodetic", [False, True])
def test_positions_come_from_a_table_in_either_frame(geodetic, tmp_path):
    places = np.array([[10.0, 20.0, 30.0], [-400.0, 250.0, 80.0]])
    columns, rows = "east_m, north_m, up_m, weight", places
    if geodetic:
        columns = "latitude_deg,longitude_deg,altitude_amsl_m,weight"
        place = (ORIGIN.latitude_deg, ORIGIN.longitude_deg, ORIGIN.altitude_amsl_m)
        rows = np.stack(pymap3d.enu2geodetic(*places.T, *place), axis=-1)
    lines = [",".join(f"{number:.12g}" for number in (*row, 2.5)) for row in rows]
    (tmp_path / "seen.csv").write_text("\n".join([columns, *lines]))
    table = read_positions(tmp_path / "seen.csv", ORIGIN)
    np.testing.assert_allclose(table.position_m, places, atol=1e-3)
    np.testing.assert_array_equal(table.weight, [2.5, 2.5])
