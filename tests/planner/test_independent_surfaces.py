"""The checker's own distances to measured obstacles, where they are known."""

import numpy as np
import pytest

from tests.planner.independent_surfaces import heights_above, points_distance, terrain_distance, voxels_distance

ORIGIN = {"altitude_amsl_m": 100.0}
POINTS = np.array([[3.0, 4.0, 25.0], [40.0, -10.0, 12.0]])


def test_a_slope_is_as_far_as_its_plane(tmp_path):
    # Rows from north to south, rising to the north by half a metre a metre, above the sea.
    north = np.arange(100.0, -101.0, -5.0)
    np.save(tmp_path / "slope.npy", np.tile(110.0 + 0.5 * north[:, None], (1, 41)))
    entry = {"file": str(tmp_path / "slope.npy"), "cell_m": 5.0}
    height = POINTS[:, 2] - (10.0 + 0.5 * POINTS[:, 1])
    np.testing.assert_allclose(heights_above(entry, ORIGIN, POINTS), height, atol=1e-9)
    distance = terrain_distance(entry, ORIGIN, POINTS)
    assert (distance >= height / np.sqrt(1.25) - 1e-9).all()
    np.testing.assert_allclose(distance, height / np.sqrt(1.25), rtol=0.01)
    assert terrain_distance(entry, ORIGIN, np.array([[0.0, 0.0, 5.0]]))[0] == pytest.approx(-5.0)


def test_points_are_balls_and_voxels_are_boxes(tmp_path):
    np.save(tmp_path / "cloud.npy", np.array([[0.0, 0.0, 25.0], [40.0, -10.0, 0.0]]))
    cloud = {"file": str(tmp_path / "cloud.npy"), "radius_m": 1.0}
    np.testing.assert_allclose(points_distance(cloud, POINTS), [4.0, 11.0])
    occupied = np.zeros((4, 3, 2))
    occupied[1, 0, 1] = occupied[3, 2, 0] = 1.0
    np.save(tmp_path / "cells.npy", occupied)
    cells = {"file": str(tmp_path / "cells.npy"), "min_enu_m": [0.0, 0.0, 0.0], "cell_m": 2.0}
    looked = np.array([[3.0, 1.0, 3.0], [3.0, 1.0, 7.0], [9.0, 7.0, 1.0]])
    np.testing.assert_allclose(voxels_distance(cells, looked), [0.0, 3.0, np.sqrt(2.0)])
