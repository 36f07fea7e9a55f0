"""Ways around obstacles: free where there is room, through doors, and never worse than straight."""

import numpy as np
import pytest

from planner.free_space import FreeSpace
from planner.obstacles import Box, ObstacleField, Prism, Sphere
from planner.polyline import at_lengths, densified, length_of, without_repeats
from tests.planner.worlds import mixed, open_box, trees


def world(obstacles, **changes) -> FreeSpace:
    return FreeSpace(open_box(obstacles=ObstacleField.of(obstacles), **changes))


def test_in_the_open_a_path_stays_as_it_is() -> None:
    waypoints = np.array([[5.0, 5.0, 10.0], [50.0, 70.0, 3.0], [95.0, 40.0, 10.0]])
    np.testing.assert_array_equal(world(()).path_through(waypoints), waypoints)


@pytest.mark.parametrize("kind", [trees, mixed])
@pytest.mark.parametrize("seed", range(5))
def test_a_path_is_led_around_what_is_in_the_way(kind, seed: int) -> None:
    rng = np.random.default_rng(seed)
    free = world(kind(rng, 14))
    waypoints = rng.uniform([2.0, 2.0, 2.0], [98.0, 78.0, 18.0], (12, 3))
    waypoints[0], waypoints[-1] = [5.0, 5.0, 10.0], [95.0, 40.0, 10.0]
    path = free.path_through(waypoints)
    np.testing.assert_array_equal(path[[0, -1]], waypoints[[0, -1]])
    dense = densified(path, 0.25)
    # Ends of legs in obstacles are passed by, so nothing but slivers between two samples may be blocked.
    assert (free.margin(dense) < -0.3).mean() < 0.002
    assert (free.margin(densified(waypoints, 0.25)) < -0.3).mean() > 0.01
    assert length_of(path) < 2.0 * length_of(waypoints)
    assert (dense >= free.low_m).all()
    assert (dense <= free.high_m).all()


def test_the_way_leads_through_the_only_door() -> None:
    walls = [
        Box(np.array([48.0, -5.0, -5.0]), np.array([52.0, 60.0, 25.0])),
        Box(np.array([48.0, 70.0, -5.0]), np.array([52.0, 90.0, 25.0])),
    ]
    free = world(walls)
    path = free.path_through(np.array([[10.0, 10.0, 10.0], [90.0, 10.0, 10.0]]))
    dense = densified(path, 0.2)
    assert (free.margin(dense) > -0.05).all()
    inside = dense[np.abs(dense[:, 0] - 50.0) < 2.0]
    assert ((inside[:, 1] > 60.0) & (inside[:, 1] < 70.0)).all()
    # Up to the wall as asked, along it to the door, and back.
    assert length_of(path) < 80.0 + 2.0 * 56.0


def test_a_low_wall_is_flown_over() -> None:
    free = world([Box(np.array([48.0, -5.0, -5.0]), np.array([52.0, 90.0, 12.0]))])
    path = free.path_through(np.array([[10.0, 10.0, 10.0], [90.0, 10.0, 10.0]]))
    dense = densified(path, 0.2)
    assert (free.margin(dense) > -0.05).all()
    assert dense[np.abs(dense[:, 0] - 50.0) < 2.0][:, 2].min() > 13.0


def test_where_there_is_no_way_the_path_is_straight() -> None:
    free = world([Box(np.array([48.0, -5.0, -5.0]), np.array([52.0, 90.0, 25.0]))])
    ends = np.array([[10.0, 10.0, 10.0], [90.0, 10.0, 10.0]])
    assert length_of(free.path_through(ends)) == pytest.approx(80.0)


def test_points_are_pushed_out_of_obstacles_and_into_the_fence() -> None:
    fence = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [0.0, 60.0]])
    corners = np.array([[40.0, 30.0], [50.0, 30.0], [50.0, 40.0], [40.0, 40.0]])
    free = world([Sphere(np.array([20.0, 20.0, 10.0]), 4.0), Prism(corners, 0.0, 30.0)], fence_polygon_m=fence)
    rng = np.random.default_rng(0)
    points = rng.uniform(free.low_m, free.high_m, (300, 3))
    blocked = free.margin(points) < 0.0
    pushed = free.pushed(points)
    assert blocked.mean() > 0.05
    assert (free.margin(pushed) >= 0.0).mean() > 0.99
    np.testing.assert_array_equal(pushed[~blocked], points[~blocked])
    moved = np.linalg.norm(pushed - points, axis=1)[blocked]
    # To the nearest free place, no further.
    assert (moved <= -free.margin(points)[blocked] + 0.5).mean() > 0.95


def test_climbs_and_descents_count_as_long_as_they_take() -> None:
    free = world(())
    legs = np.array([[0.0, 0, 0], [3.0, 0, 4.0], [3.0, 0, 0.0], [53.0, 0, 1.0]])
    # 4 m up at 2 m/s take as long as 10 m at 5 m/s; 4 m down at 1.5 m/s as long as 13.3 m.
    np.testing.assert_allclose(free.flown_lengths(legs), [10.0, 4.0 * 5.0 / 1.5, np.hypot(50.0, 1.0)])


def test_polylines_keep_their_corners_and_lengths() -> None:
    corners = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 0, 0], [10.0, 7.0, 0]])
    dense = densified(without_repeats(corners), 0.9)
    assert np.linalg.norm(np.diff(dense, axis=0), axis=1).max() <= 0.9
    assert length_of(dense) == pytest.approx(17.0)
    assert (np.abs(dense - [10.0, 0, 0]).sum(axis=1) < 1e-9).any()
    legs = np.array([10.0, 7.0])
    np.testing.assert_allclose(
        at_lengths(without_repeats(corners), legs, np.array([5.0, 13.5])), [[5, 0, 0], [10, 3.5, 0]]
    )
    assert len(without_repeats(np.zeros((4, 3)))) == 2
