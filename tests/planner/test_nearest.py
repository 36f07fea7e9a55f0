"""The least of many distances: the same as that of all of them, for fewer measurements."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.nearest import EVALUATIONS, least


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_it_is_the_least_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    spread = rng.uniform(0.0, 100.0, 3)
    centers, radii = rng.normal(size=(400, 3)) * 50.0, rng.uniform(0.1, 30.0, 400)
    points = np.repeat(rng.normal(size=(500, 3)) * spread, rng.integers(1, 4), axis=0)

    def distances(some: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        return np.linalg.norm(centers[bodies, None] - some, axis=2) - radii[bodies, None]

    everything = distances(points, np.arange(400)).min(axis=0)
    np.testing.assert_array_equal(least(points, np.ones(400, dtype=int), distances), everything)


def test_far_fewer_than_all_are_measured() -> None:
    rng = np.random.default_rng(0)
    centers, points = rng.uniform(0.0, 600.0, (3000, 2)), rng.uniform(0.0, 600.0, (5000, 2))
    flat = np.column_stack([points, np.zeros(5000)])
    measured = []

    def distances(some: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        measured.append(len(some) * len(bodies))
        return np.linalg.norm(centers[bodies, None] - some[:, :2], axis=2)

    least(flat, np.ones(3000, dtype=int), distances)
    assert sum(measured) < 0.15 * len(centers) * len(points)
    assert max(measured) <= EVALUATIONS


@pytest.mark.parametrize("count", [0, 1])
def test_of_few_points_everything_is_measured_at_once(count: int) -> None:
    points = np.zeros((count, 3))
    found = least(points, np.ones(3, dtype=int), lambda some, bodies: np.tile(bodies[:, None] + 1.0, len(some)))
    assert found.tolist() == [1.0] * count


def test_points_all_in_one_place_are_measured_in_portions() -> None:
    points = np.ones((EVALUATIONS, 3))
    found = least(points, np.full(4, 8), lambda some, bodies: np.full((len(bodies), len(some)), 2.0))
    assert (found == 2.0).all()
