"""Obstacles from measured files: what the planner keeps away from is what the file holds."""

import os

import numpy as np
import pytest
import trimesh

from mission.findings import InputError
from mission.loading import load
from mission.pictures.relief import relief_of
from mission.site.footprints import footprints_of
from mission.site.problem import problem_from_mission
from mission.view import ground_mesh, surface_of

LOW, HIGH = np.array([0.0, 0.0, 20.0]), np.array([500.0, 500.0, 80.0])
POINTS = np.random.default_rng(0).uniform([200.0, 200.0, 20.0], [260.0, 260.0, 60.0], (60, 3))


def with_obstacle(sound, entry: str, home_up_m: float = 0.0):
    return load(sound, [f"obstacle=[{{{entry}}}]", f"site.home_enu_m=[10, 10, {home_up_m}]"])


def places(count: int = 400) -> np.ndarray:
    return np.random.default_rng(1).uniform(LOW, HIGH, (count, 3))


@pytest.mark.parametrize("kind", ["npy", "csv", "geodetic"])
def test_a_cloud_of_points_is_kept_away_from(kind, sound, tmp_path):
    path = tmp_path / f"scan.{'npy' if kind == 'npy' else 'csv'}"
    if kind == "npy":
        np.save(path, POINTS)
    else:
        np.savetxt(path, POINTS, delimiter=",", header="east_m,north_m,up_m", comments="")
    if kind == "geodetic":
        from sim_bridge.frames import geodetic_from_enu

        origin = load(sound).site.origin.point()
        rows = [geodetic_from_enu(tuple(point), origin) for point in POINTS]
        lines = [f"{row.latitude_deg!r},{row.longitude_deg!r},{row.altitude_amsl_m!r}" for row in rows]
        path.write_text("latitude_deg,longitude_deg,altitude_amsl_m\n" + "\n".join(lines))
    problem = problem_from_mission(with_obstacle(sound, f"kind='points', file='{path}', radius_m=2.0"))
    truth = np.linalg.norm(places()[:, None] - POINTS, axis=2).min(axis=1) - 2.0
    found = problem.obstacles.lower_bound(places())
    assert (found <= truth + 1e-3).all()
    assert np.median(truth - found) < 5.0


def test_a_mesh_is_kept_away_from_where_it_is_put(sound, tmp_path):
    trimesh.creation.box(extents=(40.0, 30.0, 50.0)).export(tmp_path / "tower.stl")
    entry = f"kind='mesh', file='{tmp_path / 'tower.stl'}', position_enu_m=[250.0, 200.0, 45.0]"
    problem = problem_from_mission(with_obstacle(sound, entry))
    outside = np.maximum(np.abs(places() - [250.0, 200.0, 45.0]) - [20.0, 15.0, 25.0], 0.0)
    truth = np.linalg.norm(outside, axis=1)
    found = problem.obstacles.lower_bound(places())
    assert (found <= truth + 1e-9).all()
    assert np.median(truth - found) < 6.0


def test_voxels_are_kept_away_from(sound, tmp_path):
    occupied = np.zeros((6, 5, 4), dtype=np.uint8)
    occupied[2:4, 1:3, :] = 7
    np.save(tmp_path / "cells.npy", occupied)
    entry = f"kind='voxels', file='{tmp_path / 'cells.npy'}', min_enu_m=[100.0, 100.0, 20.0], cell_m=10.0"
    problem = problem_from_mission(with_obstacle(sound, entry))
    solid_low, solid_high = np.array([120.0, 110.0, 20.0]), np.array([140.0, 130.0, 60.0])
    truth = np.linalg.norm(np.maximum(np.maximum(solid_low - places(), places() - solid_high), 0.0), axis=1)
    found = problem.obstacles.lower_bound(places())
    assert (found <= truth + 1e-9).all()
    assert np.median(truth - found) < 6.0
    shown, cell_m = surface_of(problem.obstacles.grids[0])
    assert len(shown) > 0
    assert (shown >= solid_low - cell_m).all()
    assert (shown <= solid_high + cell_m).all()


def test_terrain_lies_where_its_rows_say_and_as_high_above_the_sea(sound, tmp_path):
    rows = np.full((30, 30), 488.0 + 10.0)
    rows[:5, -5:] = 488.0 + 45.0
    np.savez(tmp_path / "heights.npz", dem=rows)
    entry = f"kind='terrain', file='{tmp_path / 'heights.npz'}', cell_m=20.0, center_enu_m=[250.0, 250.0]"
    problem = problem_from_mission(with_obstacle(sound, entry, home_up_m=10.0))
    ground = problem.obstacles.surfaces[0]
    # The first rows are the northern ones, the last columns the eastern ones.
    np.testing.assert_allclose(ground.height_at(np.array([[499.0, 499.0], [1.0, 499.0], [499.0, 1.0]])), [45, 10, 10])
    relief = relief_of(problem)
    assert relief is not None
    assert relief.ground_m is not None
    assert relief.ground_m.max() == pytest.approx(45.0)
    vertices, triangles = ground_mesh(ground)
    assert vertices[:, 2].max() == pytest.approx(45.0)
    assert triangles.max() == len(vertices) - 1


@pytest.mark.parametrize("kind", ["npy", "tif"])
def test_a_cliff_that_stands_outside_the_box_is_kept_away_from(kind, sound, tmp_path):
    # Posts every 2 m from -39 to 539; the cliff's foot is 6 m east of the box, three posts away.
    middles = np.arange(-39.0, 540.0, 2.0)
    rows = np.tile(np.where(middles > 507.5, 300.0, 0.0), (len(middles), 1))
    entry = f"kind='terrain', file='{tmp_path / f'ground.{kind}'}', heights='above-origin'"
    if kind == "npy":
        np.save(tmp_path / "ground.npy", rows)
        entry += ", cell_m=2.0, center_enu_m=[250.0, 250.0]"
    else:
        rasterio = pytest.importorskip("rasterio")
        origin = load(sound).site.origin.point()
        local = f"+proj=aeqd +lat_0={origin.latitude_deg} +lon_0={origin.longitude_deg} +datum=WGS84 +units=m"
        with rasterio.open(
            tmp_path / "ground.tif", "w", driver="GTiff", width=len(middles), height=len(middles), count=1,
            dtype="float64", crs=local, transform=rasterio.Affine(2.0, 0.0, -40.0, 0.0, -2.0, 540.0),
        ) as target:  # fmt: skip
            target.write(rows, 1)
    mission = load(sound, [f"obstacle=[{{{entry}}}]", "flight.clearance_margin_m=9.0"])
    assert 9.0 < mission.keep_out_m < 10.0
    obstacles = problem_from_mission(mission).obstacles
    beside = np.random.default_rng(3).uniform([490.0, 10.0, 21.0], [500.0, 490.0, 79.0], (500, 3))
    truth = 507.0 - beside[:, 0]
    assert (obstacles.lower_bound(beside) <= truth + 0.5).all()


def test_ground_that_has_gaps_outside_the_box_goes_on_there_as_it_is_beside_them(sound, tmp_path):
    rows = np.full((80, 80), 5.0)
    rows[:, -10:] = np.nan
    np.save(tmp_path / "ground.npy", rows)
    entry = f"kind='terrain', file='{tmp_path / 'ground.npy'}', heights='above-origin', cell_m=10.0"
    problem = problem_from_mission(with_obstacle(sound, f"{entry}, center_enu_m=[200.0, 250.0]"))
    assert float(problem.obstacles.surfaces[0].height_at(np.array([600.0, 250.0]))) == 5.0


def test_heights_above_the_ground_are_kept_and_cut_the_information(sound, tmp_path):
    np.save(tmp_path / "flat.npy", np.zeros((30, 30)))
    entry = (
        f"kind='terrain', file='{tmp_path / 'flat.npy'}', cell_m=20.0, center_enu_m=[250.0, 250.0], "
        "heights='above-origin', least_height_m=25.0, greatest_height_m=40.0"
    )
    mission = with_obstacle(sound, entry)
    problem = problem_from_mission(mission)
    up = problem.information.centers_m()[..., 2][problem.information.mass > 0.0]
    assert 25.0 <= up.min() < up.max() <= 40.0
    assert footprints_of(mission) == []


FAULTS = {
    "an empty cloud": ("scan.csv", "east_m,north_m,up_m\n", "kind='points', radius_m=1.0", "no positions"),
    "a cloud with a hole": ("scan.csv", "east_m,north_m,up_m\n1,nan,3\n", "kind='points', radius_m=1.0", "non-finite"),
    "no mesh": ("tower.stl", "solid nothing\nendsolid nothing\n", "kind='mesh'", "triangles"),
    "not a mesh": ("tower.obj", "this is a letter", "kind='mesh'", "triangles"),
    "flat voxels": ("cells.npy", np.ones((4, 4)), "kind='voxels', min_enu_m=[0,0,0], cell_m=1.0", "three axes"),
    "no voxels": ("cells.npy", np.zeros((4, 4, 4)), "kind='voxels', min_enu_m=[0,0,0], cell_m=1.0", "no occupied"),
    "terrain without cells": ("ground.npy", np.zeros((9, 9)), "kind='terrain'", "write cell_m"),
    "terrain elsewhere": (
        "ground.npy",
        np.zeros((9, 9)),
        "kind='terrain', cell_m=20.0, center_enu_m=[5000.0, 0.0]",
        "does not touch",
    ),
    "terrain too small": (
        "ground.npy",
        np.zeros((9, 9)),
        "kind='terrain', cell_m=20.0, center_enu_m=[250.0, 250.0]",
        "inside the site",
    ),
    "terrain with gaps": (
        "ground.npy",
        np.where(np.eye(40) > 0, np.nan, 0.0),
        "kind='terrain', cell_m=20.0, center_enu_m=[250.0, 250.0]",
        "fill the gaps",
    ),
    "heights upside down": (
        "ground.npy",
        np.zeros((40, 40)),
        "kind='terrain', cell_m=20.0, center_enu_m=[250, 250], least_height_m=50.0, greatest_height_m=40.0",
        "must be greater than least_height_m",
    ),
    "a band that the start is not in": (
        "ground.npy",
        np.zeros((40, 40)),
        "kind='terrain', cell_m=20.0, center_enu_m=[250, 250], heights='above-origin', least_height_m=50.0",
        "up must be at least 50",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_file_that_is_no_obstacle_is_refused_with_what_to_do(fault, sound, tmp_path):
    name, content, entry, words = FAULTS[fault]
    if isinstance(content, str):
        (tmp_path / name).write_text(content)
    else:
        np.save(tmp_path / name, content)
    with pytest.raises(InputError, match=words):
        with_obstacle(sound, f"file='{tmp_path / name}', {entry}")


def test_a_mesh_with_a_hole_is_refused(sound, tmp_path):
    box = trimesh.creation.box(extents=(10.0, 10.0, 10.0))
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export(tmp_path / "open.ply")
    with pytest.raises(InputError, match="not a closed surface"):
        with_obstacle(sound, f"kind='mesh', file='{tmp_path / 'open.ply'}', position_enu_m=[250.0, 250.0, 50.0]")


def test_a_file_that_was_written_anew_is_read_anew(sound, tmp_path):
    path = tmp_path / "ground.npy"
    entry = f"kind='terrain', file='{path}', cell_m=20.0, center_enu_m=[250, 250], heights='above-origin'"
    for height, stamp in ((0.0, 1_000), (10.0, 2_000)):
        np.save(path, np.full((30, 30), height))
        os.utime(path, (stamp, stamp))
        problem = problem_from_mission(with_obstacle(sound, entry, home_up_m=height))
        assert float(problem.obstacles.surfaces[0].height_at(np.zeros(2))) == height
