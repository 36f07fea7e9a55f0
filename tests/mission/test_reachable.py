import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mission.mission_file.site import Origin, Site
from mission.site.reachable import reachable, spare_in
from planner import information
from planner.obstacles import Cylinder, ObstacleField, Sphere
from planner.workspace import Workspace

ORIGIN = Origin(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=400.0)
TRIANGLE = Site(origin=ORIGIN, polygon_enu_m=[[0.0, 0.0], [100.0, 5.0], [40.0, 80.0]], floor_m=0.0, ceiling_m=30.0)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_deciding_by_blocks_is_the_same_as_asking_every_cell(seed):
    random = np.random.default_rng(seed)
    low, high = (np.array(corner) for corner in TRIANGLE.box_m)
    shape = tuple(random.integers(1, 40, 3))
    density = information.DensityGrid(Workspace(low, high), random.uniform(0.1, 1.0, shape))
    spheres = [Sphere(random.uniform(low, high), float(random.uniform(1.0, 9.0))) for _ in range(4)]
    trees = [Cylinder(random.uniform(low, high)[:2], float(random.uniform(0.5, 4.0)), 0.0, 20.0) for _ in range(4)]
    spare = spare_in(TRIANGLE, ObstacleField.of([*spheres, *trees]), 2.0)
    wanted = density.mass * (spare(density.centers_m().reshape(-1, 3)) >= 0.0).reshape(shape)
    if wanted.any():
        np.testing.assert_allclose(reachable(density, spare).mass, wanted / wanted.sum(), rtol=1e-12)


def test_where_everything_is_covered_there_is_nothing_to_explore():
    low, high = (np.array(corner) for corner in TRIANGLE.box_m)
    everywhere = ObstacleField.of([Sphere(0.5 * (low + high), 200.0)])
    with pytest.raises(ValueError, match="no information is left"):
        reachable(information.uniform(Workspace(low, high)), spare_in(TRIANGLE, everywhere, 1.0))


def test_only_a_few_of_the_cells_are_asked():
    low, high = (np.array(corner) for corner in TRIANGLE.box_m)
    spare = spare_in(TRIANGLE, ObstacleField.of([Cylinder(np.array([40.0, 30.0]), 5.0, 0.0, 40.0)]), 1.0)
    asked = []

    def counting(points):
        asked.append(len(points))
        return spare(points)

    density = information.uniform(Workspace(low, high), (128, 128, 32))
    reachable(density, counting)
    assert sum(asked) < 0.35 * density.mass.size
