"""From positions in time to the control points of a spline."""

import numpy as np
import pytest

from planner.gate import ViolationKind, inspect
from planner.problem import Problem
from planner.seeds import spline_from_path
from planner.trajectory import Motion, Trajectory
from tests.planner.worlds import open_box

SEGMENTS = 192


def curve_of(points: np.ndarray, problem: Problem, segments: int = SEGMENTS) -> Trajectory:
    return Trajectory(spline_from_path(points, problem, segments), problem.duration_s / segments)


def test_a_spline_follows_its_path_from_the_start_as_it_is_to_rest() -> None:
    start = Motion(np.array([10.0, 10.0, 5.0]), np.array([3.0, 1.0, 0.2]), np.array([0.0, 0.5, 0.0]))
    problem = open_box(start=start, end_position_m=None, duration_s=60.0)
    time = np.linspace(0.0, 60.0, 1025)
    angle = time * np.pi / 60.0
    # Leaves with the start's velocity, ends at rest.
    points = np.column_stack(
        [
            10.0 + 57.0 * np.sin(angle / 2.0) ** 2 + 3.0 * 60.0 / np.pi * np.sin(angle) / 2.0,
            10.0 + 20 * angle,
            5 + angle,
        ]
    )
    curve = curve_of(points, problem, 120)
    first, last = curve.motion_at(0.0), curve.motion_at(curve.end_s)
    np.testing.assert_allclose(first.position_m, start.position_m, atol=1e-9)
    np.testing.assert_allclose(first.velocity_mps, start.velocity_mps, atol=1e-9)
    np.testing.assert_allclose(first.acceleration_mps2, start.acceleration_mps2, atol=1e-9)
    np.testing.assert_allclose(last.position_m, points[-1], atol=1e-9)
    np.testing.assert_allclose(last.velocity_mps, 0.0, atol=1e-9)
    middle = (time > 3.0) & (time < 57.0)
    np.testing.assert_allclose(curve.sample(time[middle]).position_m, points[middle], atol=1e-3)


def test_a_spline_of_a_path_along_the_wall_stays_in_the_box() -> None:
    problem = open_box(end_position_m=None)
    rng = np.random.default_rng(0)
    points = np.clip(np.cumsum(rng.normal(size=(300, 3)) * 6.0, axis=0) + 5.0, [0, 0, 0], [100, 80, 20])
    points[0] = problem.start.position_m
    report = inspect(curve_of(points, problem), problem)
    assert ViolationKind.BOX not in {violation.kind for violation in report.violations}


def test_a_spline_of_too_few_pieces_is_refused() -> None:
    with pytest.raises(ValueError, match="four segments or more"):
        spline_from_path(np.zeros((5, 3)), open_box(), 3)
