"""Candidates led around what they run through."""

import numpy as np

from planner.free_space import FreeSpace
from planner.obstacles import Box, Cylinder, Obstacle, ObstacleField
from planner.polyline import length_of
from planner.rerouting import rerouted
from planner.trajectory import Trajectory
from tests.planner.worlds import open_box


def world(obstacle: Obstacle) -> FreeSpace:
    return FreeSpace(open_box(obstacles=ObstacleField.of([obstacle])))


def along(points_m: np.ndarray) -> Trajectory:
    return Trajectory(np.concatenate([points_m[:1], points_m[:1], points_m, points_m[-1:], points_m[-1:]]), 1.0)


def positions(curve: Trajectory, count: int) -> np.ndarray:
    return curve.sample(np.linspace(curve.start_s, curve.end_s, count)).position_m


def test_what_is_blocked_is_led_around_and_the_rest_keeps_its_time() -> None:
    free = world(Cylinder(np.array([50.0, 40.0]), 5.0, 0.0, 30.0))
    curve = along(np.linspace([5.0, 40.0, 10.0], [95.0, 40.0, 10.0], 41))
    assert (free.margin(positions(curve, 400)) < 0.0).any()
    found = rerouted(curve, free)
    assert (free.margin(found) > -0.2).all()
    before = positions(curve, len(found))
    away = np.abs(before[:, 0] - 50.0) > 20.0
    np.testing.assert_allclose(found[away], before[away], atol=1e-9)


def test_a_tour_that_is_blocked_all_along_does_not_become_a_stay_at_its_start() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    middle = np.array([50.0, 40.0])
    tour = np.column_stack([middle + 25.0 * np.stack([-np.cos(angle), np.sin(angle)], axis=1), np.full(61, 10.0)])
    # Both ends are free, a hand's breadth apart, and all else is inside.
    tour[-1, 1] += 0.1
    free = world(Box(np.array([25.5, 0.0, 0.0]), np.array([100.0, 80.0, 20.0])))
    free_ends = tour.copy()
    free_ends[[0, 1, -2, -1], 0] = 20.0
    curve = along(free_ends)
    blocked = free.margin(positions(curve, 245)) < 0.0
    assert blocked.mean() > 0.9
    assert not blocked[[0, -1]].any()
    assert length_of(rerouted(curve, free)) > 0.9 * length_of(positions(curve, 245))
