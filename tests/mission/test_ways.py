"""Ways from one place to another: within the limits, clear of obstacles, or refused."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mission.flying.ways import along, find_way
from planner.gate import GateRefused
from planner.gate_report import Violation, ViolationKind
from planner.problem import Limits
from tests.mission.proven import proven

LIMITS = Limits(8.0, 3.0, 1.5, 3.0)
LOW, HIGH = np.array([0.0, 0.0, 5.0]), np.array([100.0, 100.0, 60.0])
coordinates = st.tuples(st.floats(0.0, 400.0), st.floats(0.0, 400.0), st.floats(1.0, 90.0))


def box(center, half):
    center, half = np.array(center, dtype=float), np.array(half, dtype=float)

    def distance(points):
        q = np.abs(points - center) - half
        return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)

    return distance


def way(distance, start=(10.0, 50.0, 10.0), end=(90.0, 50.0, 10.0), prove=proven):
    return find_way(np.array(start), np.array(end), LIMITS, distance, 3.0, LOW, HIGH, prove)


@settings(max_examples=60, deadline=None)
@given(st.lists(coordinates, min_size=1, max_size=5))
def test_a_polyline_is_flown_from_rest_to_rest_through_every_corner_within_every_limit(corners):
    points = np.array(corners)
    trajectory = along(points, LIMITS)
    samples = trajectory.sampled_every(0.02)
    assert samples.position_m[0] == pytest.approx(points[0], abs=1e-9)
    assert samples.position_m[-1] == pytest.approx(points[-1], abs=1e-9)
    speed = np.linalg.norm(samples.velocity_mps, axis=1)
    assert speed.max() <= LIMITS.max_speed_mps
    assert speed[0] < 1e-9
    assert speed[-1] < 1e-9
    assert samples.velocity_mps[:, 2].max() <= LIMITS.max_climb_mps
    assert samples.velocity_mps[:, 2].min() >= -LIMITS.max_descent_mps
    assert np.linalg.norm(samples.acceleration_mps2, axis=1).max() <= LIMITS.max_acceleration_mps2
    for corner in points:
        assert np.linalg.norm(samples.position_m - corner, axis=1).min() < 0.05


def test_a_free_way_is_the_straight_line():
    samples = way(lambda points: np.full(len(points), 1e3)).sampled_every(0.1)
    assert np.abs(samples.position_m[:, 1:] - [50.0, 10.0]).max() < 1e-9


@pytest.mark.parametrize("far_m", [2e5, -3e12, np.nan])
def test_a_way_that_no_vehicle_flies_is_refused_before_it_is_looked_for(far_m):
    def never(points):
        raise AssertionError("looked for")

    with pytest.raises(ValueError, match="wrong about where the vehicle is"):
        way(never, end=(far_m, 50.0, 10.0))
    with pytest.raises(ValueError, match="wrong about where the vehicle is"):
        along(np.array([[0.0, 0.0, 10.0], [0.0, far_m, 10.0]]), LIMITS)


def test_a_low_wall_is_flown_over():
    distance = box([50.0, 50.0, 10.0], [5.0, 200.0, 12.0])
    samples = way(distance).sampled_every(0.05)
    assert distance(samples.position_m).min() >= 3.0
    assert samples.position_m[:, 2].max() >= 25.0


def test_a_tower_that_reaches_the_ceiling_is_flown_round():
    distance = box([50.0, 50.0, 30.0], [12.0, 12.0, 60.0])
    samples = way(distance).sampled_every(0.05)
    assert distance(samples.position_m).min() >= 3.0
    assert np.abs(samples.position_m[:, 1] - 50.0).max() >= 14.0


def test_where_there_is_no_way_it_says_from_where_to_where():
    with pytest.raises(ValueError, match=r"no proven way from \[10.0, 50.0, 10.0\] to \[90.0, 50.0, 10.0\]"):
        way(box([50.0, 50.0, 30.0], [5.0, 500.0, 500.0]))


def test_what_the_gate_refuses_is_not_flown_and_its_words_are_passed_on():
    def refuse(curve):
        violation = Violation(ViolationKind.FENCE, 1.0, 0.0, 0.0, np.zeros(3), "outside the fence")
        raise GateRefused(dataclasses.replace(proven(curve).report, violations=(violation,)))

    with pytest.raises(ValueError, match="outside the fence"):
        way(lambda points: np.full(len(points), 1e3), prove=refuse)


@settings(max_examples=40, deadline=None)
@given(st.lists(coordinates, min_size=2, max_size=4), st.floats(0.5, 10.0))
def test_a_way_keeps_a_limited_jerk(corners, jerk_mps3):
    trajectory = along(np.array(corners), dataclasses.replace(LIMITS, max_jerk_mps3=jerk_mps3))
    jerk = np.diff(trajectory.control_points_m, n=3, axis=0) / trajectory.knot_interval_s**3
    assert np.linalg.norm(jerk, axis=1).max() <= jerk_mps3
