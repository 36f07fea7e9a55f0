"""Cubic B-splines against scipy and their own derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from planner.trajectory import Motion, Trajectory, control_points_at_start
from tests.interpolating import interpolating


@pytest.fixture
def curve() -> Trajectory:
    return Trajectory(np.random.default_rng(0).normal(size=(12, 3)), 0.7, start_s=3.0)


def test_it_equals_scipys_spline_with_its_derivatives(curve: Trajectory) -> None:
    knots = 3.0 + 0.7 * np.arange(-3, 13)
    spline = BSpline(knots, curve.control_points_m, 3)
    times = np.linspace(3.0, curve.end_s, 101)
    samples = curve.sample(times)
    np.testing.assert_allclose(samples.position_m, spline(times), atol=1e-12)
    np.testing.assert_allclose(samples.velocity_mps, spline(times, 1), atol=1e-12)
    np.testing.assert_allclose(samples.acceleration_mps2, spline(times, 2), atol=1e-11)


def test_before_and_after_it_stands_still(curve: Trajectory) -> None:
    samples = curve.sample(np.array([0.0, 100.0]))
    np.testing.assert_allclose(samples.velocity_mps, 0.0)
    np.testing.assert_allclose(samples.position_m, curve.sample(np.array([3.0, curve.end_s])).position_m)


vectors = st.tuples(*[st.floats(-50, 50)] * 3).map(np.array)


@given(vectors, vectors, vectors, st.floats(0.05, 5.0))
def test_a_curve_can_begin_with_any_motion(position, velocity, acceleration, interval) -> None:
    first = control_points_at_start(Motion(position, velocity, acceleration), interval)
    curve = Trajectory(np.concatenate([first, first[-1:]]), interval)
    start = curve.motion_at(0.0)
    np.testing.assert_allclose(start.position_m, position, atol=1e-8)
    np.testing.assert_allclose(start.velocity_mps, velocity, atol=1e-8)
    np.testing.assert_allclose(start.acceleration_mps2, acceleration, atol=1e-7)


def test_interpolation_passes_through_its_points_and_ends_at_rest() -> None:
    points = np.random.default_rng(1).normal(size=(9, 3))
    start = Motion(points[0], np.array([0.3, -0.2, 0.1]), np.zeros(3))
    curve = interpolating(points, 0.5, start)
    samples = curve.sample(np.arange(9) * 0.5)
    np.testing.assert_allclose(samples.position_m, points, atol=1e-12)
    np.testing.assert_allclose(samples.velocity_mps[0], start.velocity_mps, atol=1e-12)
    np.testing.assert_allclose(samples.velocity_mps[-1], 0.0, atol=1e-12)


def test_slowing_scales_speed_and_acceleration_and_keeps_the_path(curve: Trajectory) -> None:
    slow = curve.slowed(2.0)
    fast, at = curve.sample(np.array([4.0])), slow.sample(np.array([5.0]))
    np.testing.assert_allclose(at.position_m, fast.position_m)
    np.testing.assert_allclose(at.velocity_mps, fast.velocity_mps / 2)
    np.testing.assert_allclose(at.acceleration_mps2, fast.acceleration_mps2 / 4)


def test_sampling_at_a_rate_includes_the_very_end(curve: Trajectory) -> None:
    samples = curve.sampled_every(0.25)
    assert samples.time_s[-1] == pytest.approx(curve.end_s)
    assert (np.diff(samples.time_s) > 0).all()


@pytest.mark.parametrize("points", [np.zeros((3, 3)), np.full((5, 3), np.nan), np.zeros((5, 2))])
def test_what_is_no_curve_is_refused(points: np.ndarray) -> None:
    with pytest.raises(ValueError, match="control points"):
        Trajectory(points, 0.5)
