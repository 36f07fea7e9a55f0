import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mission.waypoints import legs_clear, waypoints_along
from planner.obstacles import Cylinder, ObstacleField
from planner.trajectory import Motion, Trajectory
from tests.interpolating import interpolating

NOTHING = lambda points: np.full(len(points), 1e6)  # noqa: E731


def winding(seed=0, knots=40):
    points = np.cumsum(np.random.default_rng(seed).normal(size=(knots, 3)) * [6.0, 6.0, 1.0], axis=0)
    return interpolating(points, 2.0, Motion.at_rest(points[0]))


def distance_to_legs(points, corners):
    a, b = corners[:-1], corners[1:]
    share = np.einsum("pld,ld->pl", points[:, None] - a, b - a) / np.maximum(np.sum((b - a) ** 2, axis=1), 1e-12)
    nearest = a + np.clip(share, 0.0, 1.0)[..., None] * (b - a)
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def test_the_legs_stay_within_the_tolerance_of_the_curve_and_are_far_fewer_than_its_samples():
    trajectory = winding()
    waypoints = waypoints_along(trajectory, NOTHING, tolerance_m=0.5)
    corners = np.array([w.position_enu_m for w in waypoints])
    dense = trajectory.sampled_every(0.02).position_m
    assert distance_to_legs(dense, corners).max() < 0.5 + 0.05
    assert len(waypoints) < len(trajectory.sampled_every(0.1).time_s) / 4
    np.testing.assert_allclose(corners[[0, -1]], dense[[0, -1]], atol=1e-12)


def test_the_speeds_bring_a_vehicle_to_each_waypoint_when_the_curve_is_there():
    waypoints = waypoints_along(winding(), NOTHING, tolerance_m=0.5)
    for before, after in itertools.pairwise(waypoints):
        length = np.linalg.norm(np.subtract(after.position_enu_m, before.position_enu_m))
        np.testing.assert_allclose(after.time_s - before.time_s, length / after.speed_mps, rtol=1e-9)


def test_a_straight_flight_is_one_leg():
    line = Trajectory(np.linspace([0.0, 0.0, 10.0], [50.0, 20.0, 15.0], 30), 1.0)
    assert len(waypoints_along(line, NOTHING, tolerance_m=0.1)) == 2


def test_legs_are_split_where_the_shortcut_would_cut_a_corner():
    around = np.array([[np.cos(a) * 10.0, np.sin(a) * 10.0, 5.0] for a in np.linspace(0.0, np.pi, 40)])
    trajectory = interpolating(around, 1.0, Motion.at_rest(around[0]))
    tree = ObstacleField.of([Cylinder(np.zeros(2), 8.9, 0.0, 20.0)])
    spare = lambda points: tree.distance(points) - 1.0  # noqa: E731
    coarse = waypoints_along(trajectory, NOTHING, tolerance_m=3.0)
    careful = waypoints_along(trajectory, spare, tolerance_m=3.0)
    corners = np.array([w.position_enu_m for w in careful])
    along = np.concatenate([np.linspace(a, b, 200) for a, b in itertools.pairwise(corners)])
    assert len(careful) > len(coarse)
    assert spare(along).min() > 0.0


def test_a_limit_on_their_number_widens_the_tolerance():
    trajectory = winding(knots=120)
    assert len(waypoints_along(trajectory, NOTHING, tolerance_m=0.05)) > 60
    assert len(waypoints_along(trajectory, NOTHING, tolerance_m=0.05, most=60)) <= 60


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_leg_is_called_clear_exactly_where_fine_sampling_finds_no_contact(seed):
    random = np.random.default_rng(seed)
    centers, radii = random.uniform(-5.0, 5.0, (4, 2)), random.uniform(0.2, 2.0, 4)
    field = ObstacleField.of([Cylinder(c, float(r), -50.0, 50.0) for c, r in zip(centers, radii, strict=True)])
    start, end = random.uniform(-6.0, 6.0, (2, 20, 3))
    clear = legs_clear(start, end, field.distance)
    share = np.linspace(0.0, 1.0, 801)[:, None, None]
    sampled = field.distance((start + share * (end - start)).reshape(-1, 3)).reshape(801, 20).min(axis=0)
    assert clear[sampled > 0.03].all()
    assert not clear[sampled < -0.03].any()
