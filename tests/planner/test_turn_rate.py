"""The limit on the turn rate: what the gate measures against dense sampling, and plans and seeds that keep to it."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.curve_bounds import greatest_ratio
from planner.gate import ViolationKind, inspect
from planner.problem import Kernel, Limits, Options
from planner.scene import scene_of
from planner.seeds import seed_paths, spline_from_path
from planner.solver import solve
from planner.trajectory import Motion, Trajectory
from tests.planner.judged_curves import dense, problem_of, random_curve
from tests.planner.worlds import open_box

WINGS = Limits(6.0, 2.0, 2.0, 3.0, max_turn_rate_radps=0.4)
"""At full speed the turn rate and not the acceleration bounds the turns: radius 15 m."""


def wide_box(**changes):
    return open_box(limits=WINGS, end_position_m=None, duration_s=150.0, **changes)


def turn_rates(curve: Trajectory, least_mps: float, count: int = 40_001) -> np.ndarray:
    """|v × a|/‖v‖² on the map, wherever the vehicle is faster than that."""
    samples = dense(curve, count)
    v, a = samples.velocity_mps, samples.acceleration_mps2
    squared = v[:, 0] ** 2 + v[:, 1] ** 2
    across = np.abs(v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0])
    return (across / np.maximum(squared, 1e-12))[squared > least_mps**2]


def limited(radps: float) -> Limits:
    return Limits(30.0, 1e4, 1e4, 1e4, max_turn_rate_radps=radps)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_the_greatest_turn_rate_is_taken_and_no_sample_exceeds_it(seed: int) -> None:
    curve = random_curve(np.random.default_rng(seed), segments=12)
    report = inspect(curve, problem_of(curve, limits=limited(1e-6)))
    assert report.max_turn_rate_radps is not None
    assert turn_rates(curve, 1.0).max() <= report.max_turn_rate_radps * (1.0 + 1e-6)
    (broken,) = (one for one in report.violations if one.kind is ViolationKind.TURN_RATE)
    there = curve.motion_at(broken.time_s)
    v, a = there.velocity_mps, there.acceleration_mps2
    rate = abs(v[0] * a[1] - v[1] * a[0]) / (v[0] ** 2 + v[1] ** 2 + 1e-9 * 30.0**2)
    assert report.max_turn_rate_radps == pytest.approx(rate, rel=1e-3)


def test_a_circle_turns_as_fast_as_its_speed_over_its_radius() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    circle = Trajectory(20.0 + 10.0 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), 0.5)
    problem = problem_of(circle, limits=limited(0.2), start=circle.motion_at(0.0), end_position_m=None)
    report = inspect(circle, problem)
    assert report.max_turn_rate_radps == pytest.approx((angle[1] - angle[0]) / 0.5, rel=1e-3)
    broken = [one for one in report.violations if one.kind is ViolationKind.TURN_RATE]
    assert len(broken) == 1
    assert "turn rate" in broken[0].text
    assert broken[0].limit == 0.2


def test_a_straight_path_from_rest_to_rest_does_not_turn() -> None:
    start, end = np.array([5.0, 5.0, 10.0]), np.array([45.0, 25.0, 12.0])
    share = np.concatenate([np.zeros(3), np.linspace(0.1, 0.9, 9), np.ones(3)])[:, None]
    straight = Trajectory(start + share * (end - start), 1.0)
    report = inspect(straight, problem_of(straight, limits=limited(0.01)))
    assert report.passed
    assert report.max_turn_rate_radps == pytest.approx(0.0, abs=1e-6)


def test_a_path_that_turns_too_fast_at_walking_pace_is_refused_too() -> None:
    corner = np.array(
        [[10.0, 10.0, 10.0]] * 3
        + [[12.0, 10.0, 10.0], [12.1, 10.1, 10.0], [12.0, 12.0, 10.0]]
        + [[12.0, 14.0, 10.0]] * 3
    )
    slow = Trajectory(corner, 20.0)
    report = inspect(slow, problem_of(slow, limits=dataclasses.replace(limited(0.05), max_speed_mps=18.0)))
    assert [one.kind for one in report.violations] == [ViolationKind.TURN_RATE]


def test_without_a_limit_nothing_is_measured_or_optimised() -> None:
    curve = random_curve(np.random.default_rng(1))
    assert inspect(curve, problem_of(curve)).max_turn_rate_radps is None
    assert not scene_of(open_box(), Options(modes=(4, 4, 1)), 16, 2).turns_are_limited


def test_a_ratio_of_constants_is_their_ratio() -> None:
    found = greatest_ratio(np.array([[2.0, 2.0], [-6.0, -6.0]]), np.array([[4.0, 4.0], [4.0, 4.0]]))
    assert found.value == pytest.approx(1.5)


@pytest.mark.slow
def test_what_is_planned_keeps_the_turn_rate() -> None:
    problem = wide_box()
    plan = solve(problem, Options(candidates=8, modes=(6, 6, 1), kernel=Kernel.RBF))
    assert len(plan.ranked()) >= 3
    for candidate in plan.ranked():
        assert turn_rates(candidate.trajectory, 0.05).max() <= WINGS.max_turn_rate_radps * (1.0 + 1e-6)
    assert plan.best.ergodic_metric < 0.005


def test_most_seeds_nearly_keep_the_turn_rate() -> None:
    problem = wide_box()
    seeds = seed_paths(problem, 6, np.random.default_rng(0))
    assert np.median([turning_share(spline_from_path(seed.points_m, problem, 96), problem) for seed in seeds]) < 0.1


def turning_share(control: np.ndarray, problem) -> float:
    """Share of the time in which a path turns too fast."""
    curve = Trajectory(control, problem.duration_s / (len(control) - 3))
    rates = turn_rates(curve, 0.3)
    return float(np.mean(rates > problem.limits.max_turn_rate_radps))


def test_seeds_are_as_gentle_as_the_jerk_allows_and_as_short_as_the_length() -> None:
    problem = open_box(
        limits=Limits(5.0, 2.0, 1.5, 3.0, max_jerk_mps3=1.5),
        max_length_m=300.0,
        end_position_m=np.array([5.0, 5.0, 10.0]),
    )
    assert isinstance(problem.start, Motion)
    for seed in seed_paths(problem, 8, np.random.default_rng(0)):
        assert np.linalg.norm(np.diff(seed.points_m, axis=0), axis=1).sum() <= 300.0
        control = spline_from_path(seed.points_m, problem, 96)
        curve = Trajectory(control, problem.duration_s / 96)
        jerk = np.linalg.norm(np.diff(control, n=3, axis=0), axis=1) / curve.knot_interval_s**3
        assert np.mean(jerk > 1.5) < 0.05, seed.pattern
