"""Signed distances against shapely, against brute force, and against their own differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from planner.obstacles import Box, Cylinder, ObstacleField, Prism, Sphere
from planner.polygon import FAR_M, KeepIn

L_SHAPE = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [2.0, 2.0], [2.0, 5.0], [0.0, 5.0]])
COMB = np.array(
    [[0, 0], [9, 0], [9, 6], [7, 6], [7, 2], [5, 2], [5, 6], [4, 6], [4, 2], [2, 2], [2, 6], [0, 6]], dtype=float
)
ONE_OF_EACH = (
    Sphere(np.array([3.0, -4.0, 2.0]), 1.5),
    Cylinder(np.array([-5.0, 1.0]), 2.0, 0.0, 4.0),
    Box(np.array([4.0, 5.0, 1.0]), np.array([7.0, 9.0, 6.0])),
    Prism(L_SHAPE - 10.0, -1.0, 3.0),
)


def star(rng: np.random.Generator, corners: int, center: np.ndarray, size: float) -> np.ndarray:
    """A simple polygon, not convex in general."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    angle += np.arange(corners) * 1e-3
    return center + size * rng.uniform(0.2, 1.0, (corners, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def random_field(rng: np.random.Generator) -> ObstacleField:
    obstacles = []
    for _ in range(rng.integers(0, 4)):
        obstacles.append(Sphere(rng.uniform(-10, 10, 3), rng.uniform(0.1, 5.0)))
    for _ in range(rng.integers(0, 4)):
        floor = rng.uniform(-10, 10)
        obstacles.append(Cylinder(rng.uniform(-10, 10, 2), rng.uniform(0.1, 5.0), floor, floor + rng.uniform(0.1, 9)))
    for _ in range(rng.integers(0, 4)):
        low = rng.uniform(-10, 10, 3)
        obstacles.append(Box(low, low + rng.uniform(0.1, 6.0, 3)))
    for _ in range(rng.integers(0, 4)):
        floor = rng.uniform(-10, 10)
        polygon = star(rng, rng.integers(3, 14), rng.uniform(-10, 10, 2), rng.uniform(1.0, 6.0))
        obstacles.append(Prism(polygon, floor, floor + rng.uniform(0.1, 9)))
    return ObstacleField.of(obstacles)


def as_jax(field):
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), field)


@pytest.mark.parametrize("corners", [L_SHAPE, L_SHAPE[::-1], COMB])
def test_a_polygon_is_as_far_as_shapely_says(corners: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-3.0, 11.0, (400, 2))
    # Corners and lattice points too: heights shared with edges are where parities go wrong.
    lattice = np.stack(np.meshgrid(np.arange(-1.0, 10.0), np.arange(-1.0, 7.0)), axis=-1).reshape(-1, 2)
    points = np.concatenate([points, lattice, corners])
    shape = shapely.Polygon(corners)
    places = shapely.points(points)
    expected = np.where(shapely.contains(shape, places), 1.0, -1.0) * shapely.distance(shape.exterior, places)
    np.testing.assert_allclose(KeepIn.of(corners).distance(points), expected, atol=1e-12)
    np.testing.assert_allclose(
        as_jax(KeepIn.of(corners)).distance(jnp.asarray(points, jnp.float32)), expected, atol=1e-5
    )


@pytest.mark.parametrize("seed", range(4))
def test_random_prisms_of_different_sizes_are_as_far_as_shapely_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    polygons = [star(rng, count, rng.uniform(-20, 20, 2), 8.0) for count in (3, 4, 5, 9, 17)]
    field = ObstacleField.of([Prism(polygon, 0.0, 5.0) for polygon in polygons])
    points = np.column_stack([rng.uniform(-30, 30, (500, 2)), rng.uniform(-4, 9, 500)])
    expected = np.full(len(points), np.inf)
    for polygon in polygons:
        shape, places = shapely.Polygon(polygon), shapely.points(points[:, :2])
        sign = np.where(shapely.contains(shape, places), -1.0, 1.0)
        h = sign * shapely.distance(shape.exterior, places)
        v = np.maximum(-points[:, 2], points[:, 2] - 5.0)
        outside = np.hypot(np.maximum(h, 0.0), np.maximum(v, 0.0))
        expected = np.minimum(expected, np.where((h < 0) & (v < 0), np.maximum(h, v), outside))
    np.testing.assert_allclose(field.distance(points), expected, atol=1e-11)


@pytest.mark.parametrize("obstacle", ONE_OF_EACH, ids=lambda o: type(o).__name__)
def test_each_kind_is_as_far_as_the_nearest_point_of_its_surface(obstacle) -> None:
    rng = np.random.default_rng(1)
    field = ObstacleField.of([obstacle])
    # A body sampled densely by what it is, not by its distance.
    cloud = rng.uniform(-14.0, 12.0, (400_000, 3))
    match obstacle:
        case Sphere(center, radius):
            inside = np.sum((cloud - center) ** 2, axis=1) < radius**2
        case Cylinder(center, radius, floor, ceiling):
            flat = np.sum((cloud[:, :2] - center) ** 2, axis=1) < radius**2
            inside = flat & (cloud[:, 2] > floor) & (cloud[:, 2] < ceiling)
        case Box(low, high):
            inside = ((cloud > low) & (cloud < high)).all(axis=1)
        case Prism(polygon, floor, ceiling):
            flat = shapely.contains_xy(shapely.Polygon(polygon), cloud[:, 0], cloud[:, 1])
            inside = flat & (cloud[:, 2] > floor) & (cloud[:, 2] < ceiling)
    np.testing.assert_array_equal(field.distance(cloud) < 0.0, inside)
    solid, free = cloud[inside], cloud[~inside]
    for point in rng.uniform(-12.0, 10.0, (40, 3)):
        signed = field.distance(point)
        other_side = solid if signed > 0.0 else free
        nearest = np.sqrt(np.min(np.sum((other_side - point) ** 2, axis=1)))
        assert abs(signed) <= nearest + 1e-9
        assert nearest - abs(signed) < 0.8


@given(st.integers(0, 2**32 - 1))
def test_it_changes_no_faster_than_the_place(seed: int) -> None:
    rng = np.random.default_rng(seed)
    field = random_field(rng)
    here = rng.uniform(-15, 15, (200, 3))
    there = here + rng.normal(size=(200, 3)) * 10.0 ** rng.uniform(-4, 1, (200, 1))
    change = np.abs(field.distance(here) - field.distance(there))
    assert (change <= np.linalg.norm(here - there, axis=1) + 1e-9).all()


@pytest.mark.parametrize("seed", range(3))
def test_double_and_single_precision_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    field = ObstacleField.of([*ONE_OF_EACH, Sphere(np.array([-9.0, -9.0, 5.0]), 2.0)])
    points = rng.uniform(-15, 15, (50, 7, 3))
    exact = field.distance(points)
    assert exact.dtype == np.float64
    assert exact.shape == (50, 7)
    single = jax.jit(jax.vmap(as_jax(field).distance))(jnp.asarray(points, jnp.float32))
    np.testing.assert_allclose(single, exact, atol=2e-5)


def test_its_derivative_is_the_difference_of_nearby_distances() -> None:
    rng = np.random.default_rng(2)
    field = ObstacleField.of(ONE_OF_EACH)
    points = rng.uniform(-13, 10, (300, 3))
    step = 1e-6
    difference = np.stack(
        [(field.distance(points + d) - field.distance(points - d)) / (2.0 * step) for d in step * np.eye(3)], axis=-1
    )
    slope = jax.jit(jax.vmap(jax.grad(as_jax(field).distance)))(points)
    # On the ridges between two nearest places the two differ; they are thin.
    smooth = np.abs(np.linalg.norm(difference, axis=1) - 1.0) < 1e-6
    assert smooth.mean() > 0.99
    np.testing.assert_allclose(np.asarray(slope)[smooth], difference[smooth], atol=2e-3)


def test_derivatives_are_finite_where_the_formulas_are_singular() -> None:
    field = ObstacleField.of(ONE_OF_EACH)
    singular = [
        [3.0, -4.0, 2.0],  # centre of the sphere
        [3.0, -4.0, 3.5],  # its surface
        [-5.0, 1.0, 2.0],  # axis of the cylinder
        [-5.0, 1.0, 4.0],  # its lid
        [-3.0, 1.0, 4.0],  # its rim
        [5.5, 7.0, 3.5],  # centre of the box
        [4.0, 5.0, 1.0],  # its corner
        [4.0, 5.0, 3.0],  # its edge
        [-10.0, -10.0, -1.0],  # corner of the prism
        [-7.0, -10.0, 1.0],  # its wall
        [-8.0, -8.0, 1.0],  # its inner corner
        [-9.0, -9.0, 1.0],  # inside, as far from two walls
    ]
    value, slope = jax.jit(jax.vmap(jax.value_and_grad(as_jax(field).distance)))(np.array(singular))
    assert np.isfinite(value).all()
    assert np.isfinite(slope).all()
    assert (np.linalg.norm(slope, axis=1) <= 1.0 + 1e-5).all()


def test_without_obstacles_everything_is_far() -> None:
    field = ObstacleField.of(())
    assert field.is_empty
    np.testing.assert_array_equal(field.distance(np.zeros((4, 3))), FAR_M)
    value, slope = jax.value_and_grad(as_jax(field).distance)(jnp.zeros(3))
    assert value == FAR_M
    np.testing.assert_array_equal(slope, 0.0)
    assert KeepIn.everywhere().distance(np.zeros((2, 2))).tolist() == [FAR_M, FAR_M]


def test_absent_obstacles_are_never_the_nearest() -> None:
    three = ObstacleField.of([Sphere(np.full(3, float(i)), 1.0) for i in range(3)])
    np.testing.assert_allclose(three.distance(np.full(3, 5000.0)), 4998.0 * np.sqrt(3.0) - 1.0)


def test_missions_of_similar_size_share_one_compilation() -> None:
    traces = 0

    @jax.jit
    def measured(field: ObstacleField, points):
        nonlocal traces
        traces += 1
        return field.distance(points)

    rng = np.random.default_rng(3)
    for count in (17, 20, 24):
        spheres = [Sphere(rng.uniform(0, 9, 3), 1.0) for _ in range(count)]
        prisms = [Prism(star(rng, 5 + count % 3, np.zeros(2), 2.0), 0.0, 1.0) for _ in range(5)]
        measured(as_jax(ObstacleField.of([*spheres, *prisms])), jnp.zeros((5, 3)))
    assert traces == 1


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Sphere(np.zeros(3), 0.0), "radius_m must be positive"),
        (lambda: Sphere(np.array([0.0, np.nan, 0.0]), 1.0), "center_m needs 3 finite numbers"),
        (lambda: Cylinder(np.zeros(2), 1.0, 5.0, 5.0), "ceiling_m - floor_m must be positive"),
        (lambda: Box(np.zeros(3), np.array([1.0, 0.0, 1.0])), "along y must be positive"),
        (lambda: Prism(L_SHAPE[:2], 0.0, 1.0), "three corners or more"),
        (lambda: Prism(np.array([[0, 0], [1, 1], [2, 2.0]]), 0.0, 1.0), "needs area"),
        (lambda: Prism(np.array([[0, 0], [1, np.inf], [2, 2.0]]), 0.0, 1.0), "finite corners"),
    ],
)
def test_a_shape_that_is_none_is_refused(make, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        make()


def test_a_ring_that_repeats_its_first_corner_is_the_same_polygon() -> None:
    closed = np.concatenate([L_SHAPE, L_SHAPE[:1]])
    points = np.random.default_rng(4).uniform(-2, 8, (50, 2))
    np.testing.assert_array_equal(KeepIn.of(closed).distance(points), KeepIn.of(L_SHAPE).distance(points))
