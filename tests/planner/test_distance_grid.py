"""Grids of distances: never above the truth, close to it, and the same for the proof and the optimiser."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.distance_grid import DistanceGrid, from_heights, from_mesh, from_points, from_voxels
from planner.gate import ViolationKind, inspect
from planner.obstacles import Box, ObstacleField, Sphere
from planner.trajectory import Trajectory
from planner.workspace import Workspace
from tests.planner.worlds import open_box

SMALL = Workspace(np.full(3, -2.0), np.full(3, 8.0))
REGION = Workspace(np.zeros(3), np.array([20.0, 16.0, 10.0]))


def as_jax(tree):
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), tree)


def boxes_of(occupied: np.ndarray, low: np.ndarray, cell: np.ndarray) -> list[Box]:
    return [Box(low + index * cell, low + (index + 1) * cell) for index in np.argwhere(occupied)]


def is_never_above(grid: DistanceGrid, truth, points: np.ndarray, closeness_m: float) -> None:
    exact, bound, smooth = truth(points), grid.lower_bound(points), grid.distance(points)
    assert (bound <= exact + 1e-9).all()
    assert (smooth <= bound + 1e-9).all()
    assert (exact - smooth < closeness_m).all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_voxels_are_as_far_as_the_boxes_they_stand_for(seed: int) -> None:
    rng = np.random.default_rng(seed)
    occupied = rng.random(rng.integers(1, 6, 3)) < 0.3
    occupied.flat[rng.integers(occupied.size)] = True
    low, cell = rng.uniform(-5, 5, 3), rng.uniform(0.3, 2.0, 3)
    size = cell * occupied.shape
    grid = from_voxels(occupied, low, cell, Workspace(low - 1.5 * size, low + 2.5 * size))
    boxes = ObstacleField.of(boxes_of(occupied, low, cell))
    points = rng.uniform(low - 1.5 * size, low + 2.5 * size, (300, 3))
    outside = points[boxes.distance(points) > 0.0]
    # Cells are refined four times, so a blend gives away at most an eighth of a coarse diagonal, twice.
    is_never_above(grid, boxes.distance, outside, np.linalg.norm(cell) / 4.0 + 1e-9)
    node = rng.integers(0, grid.values_m.size, 2000)
    nodes = grid.low_m + grid.cell_m * np.stack(np.unravel_index(node, grid.values_m.shape), -1)
    apart, values = boxes.distance(nodes), grid.values_m.reshape(-1)[node]
    np.testing.assert_allclose(np.maximum(values, 0.0), np.maximum(apart, 0.0), atol=1e-9)
    # Several cells are one body: inside a box a node is at least as deep in the body.
    assert (values[apart < -1e-9] <= apart[apart < -1e-9] + 1e-9).all()


def test_a_solid_block_is_as_deep_as_its_nearest_wall() -> None:
    grid = from_voxels(np.ones((6, 6, 6), dtype=bool), np.zeros(3), 1.0, Workspace(np.full(3, -2.0), np.full(3, 8.0)))
    field = ObstacleField.of([Box(np.zeros(3), np.full(3, 6.0))])
    points = np.random.default_rng(0).uniform(-2.0, 8.0, (500, 3))
    is_never_above(grid, field.distance, points, 0.5)
    assert float(np.asarray(grid.distance(np.full((1, 3), 3.0)))[0]) == pytest.approx(-3.0, abs=0.5)


def test_it_changes_no_faster_than_its_nodes_allow_and_without_jumps() -> None:
    rng = np.random.default_rng(1)
    grid = from_voxels(rng.random((6, 5, 4)) < 0.2, np.zeros(3), 1.0, SMALL)
    here = rng.uniform(-6.0, 12.0, (4000, 3))
    there = here + rng.normal(size=here.shape) * 1e-3
    change = np.abs(grid.distance(here) - grid.distance(there))
    assert (change <= np.sqrt(3.0) * np.linalg.norm(here - there, axis=1) + 1e-9).all()


def test_points_are_balls() -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform([2, 2, 2], [18, 14, 8], (40, 3))
    grid = from_points(points, 0.7, REGION, 0.5)
    balls = ObstacleField.of([Sphere(point, 0.7) for point in points])
    places = rng.uniform([-3, -3, -3], [23, 19, 13], (2000, 3))
    inside = ((places > REGION.box_min_m) & (places < REGION.box_max_m)).all(axis=1)
    is_never_above(grid, balls.distance, places[inside], np.sqrt(3.0) * 0.5 + 1e-9)
    bound = grid.lower_bound(places)
    assert (bound <= balls.distance(places) + 1e-9).all()


def test_a_mesh_is_as_far_as_the_body_it_encloses() -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box(extents=(6.0, 4.0, 5.0))
    vertices = mesh.vertices + np.array([10.0, 8.0, 5.0])
    grid = from_mesh(vertices, mesh.faces, REGION, 0.5)
    body = ObstacleField.of([Box(np.array([7.0, 6.0, 2.5]), np.array([13.0, 10.0, 7.5]))])
    places = np.random.default_rng(3).uniform(REGION.box_min_m, REGION.box_max_m, (3000, 3))
    exact, bound = body.distance(places), grid.lower_bound(places)
    assert (bound <= exact + 1e-9).all()
    assert (grid.distance(places) <= bound + 1e-9).all()
    far = np.abs(exact) > 1.5
    # Beyond a cell or two of the surface the sides are known, and the bound is close.
    assert (exact[far] - bound[far] < 0.6).all()
    assert (np.sign(bound[far]) == np.sign(exact[far])).all()


def test_a_hollow_in_a_mesh_is_inside() -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=4.0)
    grid = from_mesh(mesh.vertices + np.array([10.0, 8.0, 5.0]), mesh.faces, REGION, 0.4)
    assert grid.lower_bound(np.array([10.0, 8.0, 5.0])) == pytest.approx(-4.0, abs=0.5)
    assert grid.lower_bound(np.array([1.0, 8.0, 5.0])) == pytest.approx(5.0, abs=0.5)


def test_terrain_is_solid_below_its_heights() -> None:
    rng = np.random.default_rng(4)
    heights = np.cumsum(rng.normal(size=(9, 8)), axis=0) + 3.0
    low, post = np.array([-1.0, -2.0]), 3.1
    grid = from_heights(heights, low, post, REGION, 0.4, reach_m=12.0)
    places = rng.uniform(REGION.box_min_m, REGION.box_max_m, (3000, 3))
    from scipy.interpolate import RegularGridInterpolator

    posts = [low[axis] + post * np.arange(heights.shape[axis]) for axis in (0, 1)]
    ground = RegularGridInterpolator(posts, heights)(places[:, :2])
    bound = grid.lower_bound(places)
    above = places[:, 2] - ground
    # Straight down the ground is never nearer than the bound says, and under it nothing is free.
    assert (bound <= np.maximum(above, 0.0) + 1e-9).all()
    assert (bound[above < 0.0] <= 1e-9).all()
    # The true distance by brute force, against a dense surface.
    dense = [np.linspace(-12.0, limit + 12.0, 400) for limit in REGION.box_max_m[:2]]
    surface = np.stack(np.meshgrid(*dense, indexing="ij"), axis=-1).reshape(-1, 2)
    on_posts = np.clip(surface, [axis[0] for axis in posts], [axis[-1] for axis in posts])
    surface = np.column_stack([surface, RegularGridInterpolator(posts, heights)(on_posts)])
    for place, value in zip(places[above > 0.0][:200], bound[above > 0.0][:200], strict=True):
        nearest = np.sqrt(((surface - place) ** 2).sum(axis=1).min())
        assert value <= nearest + 1e-9
        # A column is as high as its highest corner: on slopes that costs about a cell.
        assert nearest - value < 1.6


@pytest.mark.parametrize("reach_m", [0.0, 3.0])
def test_ground_is_never_said_to_be_farther_than_ground_that_was_not_looked_at_may_be(reach_m: float) -> None:
    posts = np.arange(-40.0, 61.0, 2.0)
    heights = np.zeros((len(posts), len(posts)))
    grid = from_heights(heights, np.full(2, posts[0]), 2.0, REGION, 0.4, reach_m)
    around = np.array([8.0, 8.0, 0.0])
    places = np.random.default_rng(8).uniform(REGION.box_min_m - around, REGION.box_max_m + around, (2000, 3))
    known_low, known_high = REGION.box_min_m[:2] - reach_m, REGION.box_max_m[:2] + reach_m
    to_unknown = np.minimum(places[:, :2] - known_low, known_high - places[:, :2]).min(axis=1)
    assert (grid.lower_bound(places) <= np.minimum(places[:, 2], to_unknown) + 1e-9).all()
    assert (grid.distance(places) <= grid.lower_bound(places) + 1e-9).all()


def test_single_precision_and_derivatives_agree_with_the_host() -> None:
    rng = np.random.default_rng(5)
    field = ObstacleField.of(
        [from_voxels(rng.random((6, 5, 4)) < 0.3, np.zeros(3), 1.0, SMALL), Sphere(np.full(3, 9.0), 1.0)]
    )
    points = rng.uniform(-3.0, 12.0, (400, 3))
    exact = field.distance(points)
    measured = jax.jit(jax.vmap(jax.value_and_grad(as_jax(field).distance)))
    value, slope = measured(points)
    np.testing.assert_allclose(value, exact, atol=1e-4)
    step = 1e-5
    difference = np.stack(
        [(field.distance(points + d) - field.distance(points - d)) / (2.0 * step) for d in step * np.eye(3)], axis=-1
    )
    close = np.abs(np.asarray(slope) - difference).max(axis=1) < 1e-3
    assert close.mean() > 0.98
    nodes = np.array([[0.0, 0, 0], [3.0, 2.0, 1.0], [-0.25, -0.25, -0.25], [50.0, 50.0, 50.0]])
    assert np.isfinite(measured(nodes)[1]).all()


def test_the_gate_proves_clearance_against_a_grid_as_against_the_shape() -> None:
    block = np.ones((4, 4, 8), dtype=bool)
    low = np.array([40.0, 30.0, 0.0])
    grid = from_voxels(block, low, 2.0, open_box().workspace)
    control = np.array([[x, 25.0, 10.0] for x in [20.0, 20, 20, *range(25, 75, 5), 75, 75, 75]])
    curve = Trajectory(control, 5.0)
    ends = {"start": curve.motion_at(0.0), "end_position_m": control[-1]}
    reports = [
        inspect(curve, open_box(obstacles=ObstacleField.of([solid]), **ends))
        for solid in (grid, Box(low, low + 2.0 * np.array(block.shape)))
    ]
    assert reports[0].min_clearance_m == pytest.approx(reports[1].min_clearance_m, abs=0.25)
    assert reports[0].min_clearance_m <= reports[1].min_clearance_m + 1e-6
    assert all(ViolationKind.CLEARANCE not in {v.kind for v in report.violations} for report in reports)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: from_voxels(np.zeros((3, 3, 3), dtype=bool), np.zeros(3), 1.0, REGION), "solid cells"),
        (lambda: from_voxels(np.ones((3, 3), dtype=bool), np.zeros(3), 1.0, REGION), "three-dimensional"),
        (lambda: from_voxels(np.ones((3, 3, 3), dtype=bool), np.zeros(3), 0.0, REGION), "positive edges"),
        (lambda: from_points(np.zeros((0, 3)), 1.0, REGION, 1.0), "finite points"),
        (lambda: from_points(np.zeros((1, 3)), 1.0, REGION, -1.0), "positive edges"),
        (lambda: from_heights(np.full((3, 3), np.nan), np.zeros(2), 1.0, REGION, 1.0, 1.0), "finite heights"),
        (lambda: from_mesh(np.zeros((3, 3)), np.zeros((0, 3), dtype=int), REGION, 1.0), "needs triangles"),
    ],
)
def test_what_is_no_body_is_refused(make, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        make()


def test_too_fine_a_grid_is_made_coarser() -> None:
    grid = from_points(np.array([[5.0, 5.0, 5.0]]), 1.0, Workspace(np.zeros(3), np.full(3, 1000.0)), 0.1)
    assert grid.values_m.size <= 1_500_000
    assert grid.lower_bound(np.array([500.0, 5.0, 5.0])) == pytest.approx(494.0, abs=10.0)


def test_far_from_the_voxels_of_a_large_region_distances_are_rough_but_never_too_great() -> None:
    large = Workspace(np.full(3, -400.0), np.full(3, 400.0))
    block = np.ones((4, 4, 4), dtype=bool)
    grid = from_voxels(block, np.zeros(3), 0.5, large)
    box = ObstacleField.of([Box(np.zeros(3), np.full(3, 2.0))])
    assert grid.values_m.size <= 1_500_000
    points = np.random.default_rng(0).uniform(-400.0, 400.0, (2000, 3))
    exact, found = box.distance(points), grid.distance(points)
    assert (found <= exact + 1e-9).all()
    assert (found > 0.6 * exact).all()


def test_grids_of_similar_size_have_one_shape_so_that_compiled_code_serves_all() -> None:
    rng = np.random.default_rng(7)
    points, occupied = rng.uniform(2.0, 8.0, (50, 3)), rng.random((12, 12, 8)) < 0.2
    shapes = []
    for longer_m in (0.2, 0.4, 0.9):
        region = Workspace(REGION.box_min_m, REGION.box_max_m + longer_m)
        cloud = from_points(points, 0.3, region, 0.5)
        cells = from_voxels(occupied, np.ones(3), 0.5, region)
        assert (cells.low_m + cells.cell_m * (np.array(cells.values_m.shape) - 1) >= region.box_max_m - 1e-9).all()
        shapes.append((cloud.values_m.shape, cells.values_m.shape))
    assert len(set(shapes)) == 1
