"""Lists of what is near say the same as looking at everything, wherever a path may be."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import obstacles
from planner.near_lists import FEW_CELLS, MANY_CELLS, cell_counts
from planner.obstacles import Box, Cylinder, ObstacleField, Prism, Sphere


def shapes(count: int, low: np.ndarray, high: np.ndarray, seed: int) -> list[obstacles.Obstacle]:
    """As many of every kind, all over the box and beyond its walls."""
    chance = np.random.default_rng(seed)
    span = high - low
    made: list[obstacles.Obstacle] = []
    for _ in range(count):
        place = low + span * chance.uniform(-0.2, 1.2, 3)
        size = 0.02 * span.max() * chance.uniform(0.2, 3.0, 3)
        angle = np.sort(chance.uniform(0.0, 2.0 * np.pi, chance.integers(3, 12)))
        ring = place[:2] + size[0] * np.column_stack([np.cos(angle), np.sin(angle)]) * chance.uniform(0.3, 1.0)
        made += [
            Sphere(place, size[0]),
            Cylinder(place[:2], size[1], place[2], place[2] + size[2]),
            Box(place - size, place + size),
            Prism(ring, place[2], place[2] + 2.0 * size[2]),
        ]
    return made


def on_the_device(field: ObstacleField) -> ObstacleField:
    """As a scene has it: single precision, whole numbers whole."""
    return jax.tree.map(
        lambda leaf: jnp.asarray(leaf, jnp.int32 if np.issubdtype(leaf.dtype, np.integer) else jnp.float32), field
    )


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 2**31),
    st.sampled_from([(3.0, 3.0, 2.0), (500.0, 500.0, 60.0), (4000.0, 30.0, 100.0), (50.0, 50.0, 900.0)]),
)
def test_inside_the_box_distances_and_slopes_are_those_to_everything(seed: int, lengths_m: tuple[float, ...]) -> None:
    low = np.array([-20.0, 10.0, 5.0])
    high = low + lengths_m
    field = ObstacleField.of(shapes(40, low, high, seed))
    listed = field.listed(low, high)
    assert listed.solids.near is not None
    assert listed.prisms.near is not None
    points = jnp.asarray(np.random.default_rng(seed).uniform(low, high, (400, 3)), jnp.float32)

    def measured(one: ObstacleField) -> tuple[jax.Array, jax.Array]:
        place = on_the_device(one)
        return place.distance(points), jax.grad(lambda at: jnp.sum(place.distance(at)))(points)

    for found, wanted in zip(measured(listed), measured(field), strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_outside_the_box_a_distance_is_finite_and_never_too_small() -> None:
    low, high = np.zeros(3), np.array([500.0, 500.0, 60.0])
    field = ObstacleField.of(shapes(40, low, high, 1))
    points = jnp.asarray(np.random.default_rng(2).uniform(low - 300.0, high + 300.0, (400, 3)), jnp.float32)
    found, wanted = (on_the_device(one).distance(points) for one in (field.listed(low, high), field))
    assert np.isfinite(found).all()
    assert (np.asarray(found) >= np.asarray(wanted)).all()


def test_few_shapes_are_looked_at_one_and_all() -> None:
    low, high = np.zeros(3), np.full(3, 100.0)
    field = ObstacleField.of(shapes(5, low, high, 0))
    assert field.listed(low, high).solids.near is None
    assert field.listed(low, high).prisms.near is None


def test_one_obstacle_more_does_not_change_what_is_compiled() -> None:
    low, high = np.zeros(3), np.array([500.0, 500.0, 60.0])
    known = shapes(40, low, high, 3)
    before = ObstacleField.of(known).listed(low, high)
    after = ObstacleField.of([*known, Sphere(np.array([250.0, 250.0, 30.0]), 5.0)]).listed(low, high)
    assert jax.tree.structure(before) == jax.tree.structure(after)
    assert [np.shape(leaf) for leaf in jax.tree.leaves(before)] == [np.shape(leaf) for leaf in jax.tree.leaves(after)]


def test_many_shapes_have_more_and_shorter_lists_that_say_the_same() -> None:
    low, high = np.zeros(3), np.array([900.0, 700.0, 60.0])
    field = ObstacleField.of(shapes(150, low, high, 5))
    listed = field.listed(low, high)
    assert listed.solids.near is not None
    assert listed.solids.near.members.shape[0] == MANY_CELLS
    points = jnp.asarray(np.random.default_rng(6).uniform(low, high, (2000, 3)), jnp.float32)
    found, wanted = (on_the_device(one).distance(points) for one in (listed, field))
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("most", [FEW_CELLS, MANY_CELLS])
@pytest.mark.parametrize("lengths_m", [(1.0, 1.0, 1.0), (5000.0, 5000.0, 1.0), (1e5, 2.0, 3.0)])
def test_the_cells_of_any_box_fit_the_one_table(lengths_m: tuple[float, ...], most: int) -> None:
    counts = cell_counts(np.array(lengths_m), most)
    assert 0.4 * most < np.prod(counts) <= most
