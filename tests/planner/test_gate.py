"""The gate against dense sampling: what it passes, no sample refutes; what it measures, samples approach."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import gate
from planner.curve_bounds import bezier_points, derivative, least_along, length_bound, maximum, squared_norm
from planner.gate import LENGTH_RESOLUTION, GateRefused, inspect, prove
from planner.gate_report import ViolationKind
from planner.information import uniform
from planner.obstacles import Box, Cylinder, ObstacleField, Prism, Sphere
from planner.polygon import KeepIn
from planner.problem import Limits, Problem
from planner.trajectory import Motion, Trajectory, control_points_at_start
from planner.workspace import Workspace
from tests.planner.judged_curves import dense, problem_of, random_curve

FENCE = np.array([[-2.0, -2.0], [52.0, -2.0], [52.0, 30.0], [30.0, 30.0], [30.0, 52.0], [-2.0, 52.0]])


def random_obstacles(rng: np.random.Generator, count: int) -> list:
    obstacles = []
    for _ in range(count):
        center, size = rng.uniform(0.0, 50.0, 3), rng.uniform(0.5, 8.0)
        corners = center[:2] + size * np.array([[-1, -1], [1, -1], [1, 1], [0, 0.2], [-1, 1]])
        obstacles.append(
            [
                Sphere(center, size),
                Cylinder(center[:2], size, 0.0, center[2]),
                Box(center - size, center + size * np.array([1.0, 0.5, 2.0])),
                Prism(corners, 0.0, center[2] + 1.0),
            ][rng.integers(4)]
        )
    return obstacles


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_extrema_are_those_of_a_dense_sampling_and_never_below(seed: int) -> None:
    rng = np.random.default_rng(seed)
    curve = random_curve(rng)
    report, samples = inspect(curve, problem_of(curve)), dense(curve)
    speed = np.linalg.norm(samples.velocity_mps, axis=1)
    acceleration = np.linalg.norm(samples.acceleration_mps2, axis=1)
    up = samples.velocity_mps[:, 2]
    for measured, sampled in (
        (report.max_speed_mps, speed.max()),
        (report.max_climb_mps, up.max()),
        (report.max_descent_mps, -up.min()),
        (report.max_acceleration_mps2, acceleration.max()),
    ):
        assert sampled <= measured * (1.0 + 1e-9)
        assert measured <= sampled * (1.0 + 1e-3)
    steps = np.linalg.norm(np.diff(samples.position_m, axis=0), axis=1)
    assert report.length_m == pytest.approx(steps.sum(), rel=3e-4)


@given(st.integers(0, 2**32 - 1), st.integers(0, 4))
@settings(max_examples=60, deadline=None)
def test_the_maximum_of_a_polynomial_is_at_a_root_of_its_derivative(seed: int, degree: int) -> None:
    rng = np.random.default_rng(seed)
    power = rng.normal(size=degree + 1)
    u = np.linspace(0.0, 1.0, degree + 1)
    basis = np.stack([_bernstein(degree, i, u) for i in range(degree + 1)], axis=1)
    found = maximum(np.linalg.solve(basis, np.polyval(power, u))[None])
    roots = np.roots(np.polyder(power)) if degree > 0 else np.array([])
    inner = roots[np.isreal(roots)].real if degree > 0 else roots
    places = np.concatenate([[0.0, 1.0], inner[(inner > 0.0) & (inner < 1.0)]])
    assert found.value == pytest.approx(np.polyval(power, places).max(), rel=1e-9, abs=1e-9)
    assert np.polyval(power, found.parameter) == pytest.approx(found.value, rel=1e-9, abs=1e-9)


def _bernstein(degree: int, index: int, u: np.ndarray) -> np.ndarray:
    from scipy.special import comb

    return comb(degree, index) * u**index * (1.0 - u) ** (degree - index)


def test_pieces_and_derivatives_are_those_of_the_spline() -> None:
    curve = random_curve(np.random.default_rng(5), segments=7)
    bezier = bezier_points(curve)
    velocity = derivative(bezier, curve.knot_interval_s)
    squared = squared_norm(velocity)
    u = 0.3
    for piece in range(curve.segments):
        expected = curve.motion_at(curve.start_s + (piece + u) * curve.knot_interval_s)
        for coefficients, value in (
            (bezier[piece], expected.position_m),
            (velocity[piece], expected.velocity_mps),
            (squared[piece], np.sum(expected.velocity_mps**2)),
        ):
            degree = len(coefficients) - 1
            basis = np.array([_bernstein(degree, i, np.array(u)) for i in range(degree + 1)])
            np.testing.assert_allclose(basis @ coefficients, value, rtol=1e-10)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_clearance_is_enclosed_to_a_millimetre(seed: int) -> None:
    rng = np.random.default_rng(seed)
    curve = random_curve(rng)
    problem = problem_of(curve, random_obstacles(rng, 6))
    report = inspect(curve, problem)
    sampled = problem.obstacles.distance(dense(curve).position_m).min() - problem.vehicle_radius_m
    longest_gap = report.max_speed_mps * curve.duration_s / 20_000
    assert sampled - longest_gap - 2e-3 <= report.min_clearance_m <= sampled + 1e-9
    broken = [v for v in report.violations if v.kind is ViolationKind.CLEARANCE]
    assert bool(broken) == (not report.passed)
    if sampled < problem.clearance_margin_m:
        (violation,) = broken
        there = problem.obstacles.distance(violation.position_m) - problem.vehicle_radius_m
        assert there < problem.clearance_margin_m
        assert violation.measured == pytest.approx(there, abs=2e-3)


def _refuted(curve: Trajectory, problem: Problem, count: int) -> bool:
    """Whether a sample breaks a condition."""
    samples, limits = dense(curve, count), problem.limits
    speed = np.linalg.norm(samples.velocity_mps, axis=1)
    slack = 1e-6
    broken = [
        problem.obstacles.distance(samples.position_m) < problem.keep_out_m - slack,
        ~((samples.position_m > problem.workspace.box_min_m - 1e-5).all(axis=1)),
        ~((samples.position_m < problem.workspace.box_max_m + 1e-5).all(axis=1)),
        speed > limits.max_speed_mps + slack,
        samples.velocity_mps[:, 2] > limits.max_climb_mps + slack,
        -samples.velocity_mps[:, 2] > limits.max_descent_mps + slack,
        np.linalg.norm(samples.acceleration_mps2, axis=1) > limits.max_acceleration_mps2 + slack,
    ]
    if problem.fence_polygon_m is not None:
        broken.append(KeepIn.of(problem.fence_polygon_m).distance(samples.position_m[:, :2]) < -2e-3)
    return bool(np.any(broken))


def _world_is_judged_right(seed: int, count: int) -> bool:
    """A random curve in a world made so that about half pass; whether it passed."""
    rng = np.random.default_rng(seed)
    curve = random_curve(rng, segments=int(rng.integers(4, 40)))
    samples = dense(curve, 2_001)
    speed = np.linalg.norm(samples.velocity_mps, axis=1).max()
    acceleration = np.linalg.norm(samples.acceleration_mps2, axis=1).max()
    room = rng.uniform(0.999, 1.2, 4)
    limits = Limits(
        speed * room[0],
        max(samples.velocity_mps[:, 2].max() * room[1], 1e-3),
        max(-samples.velocity_mps[:, 2].min() * room[2], 1e-3),
        acceleration * room[3],
    )
    obstacles = random_obstacles(rng, int(rng.integers(0, 4)))
    field = ObstacleField.of(obstacles)
    least = field.distance(samples.position_m).min()
    # Obstacles that the curve would hit are moved into the radius, so that the decision is close.
    radius = float(np.clip(least - 0.2 + rng.normal() * 1e-3, 0.0, 50.0))
    fence = FENCE if rng.random() < 0.2 else None
    problem = problem_of(curve, obstacles, limits=limits, vehicle_radius_m=radius, fence_polygon_m=fence)
    report = inspect(curve, problem)
    if report.passed:
        assert not _refuted(curve, problem, count)
    return report.passed


def test_what_it_passes_no_sample_refutes() -> None:
    passed = [_world_is_judged_right(seed, 5_001) for seed in range(60)]
    assert 5 < sum(passed) < 55


@pytest.mark.slow
def test_what_it_passes_no_sample_refutes_in_a_thousand_worlds() -> None:
    passed = [_world_is_judged_right(seed, 40_001) for seed in range(1_000)]
    assert 100 < sum(passed) < 900


def test_a_spike_between_samples_is_found() -> None:
    # A curve that passes within a centimetre of a needle, fast: a sampling of the stream steps over it.
    control = np.array([[0.0, 0.0, 5.0]] * 3 + [[x, 0.0, 5.0] for x in np.arange(5.0, 50.0, 5.0)] + [[50.0, 0, 5]] * 3)
    curve = Trajectory(control, 0.1)
    needle = Cylinder(np.array([22.3456, 0.51]), 0.005, 0.0, 20.0)
    problem = problem_of(curve, [needle])
    coarse = problem.obstacles.distance(curve.sampled_every(0.05).position_m).min()
    assert coarse > problem.keep_out_m
    report = inspect(curve, dataclasses.replace(problem, clearance_margin_m=0.21))
    (violation,) = report.violations
    assert violation.kind is ViolationKind.CLEARANCE
    assert violation.position_m[0] == pytest.approx(22.3456, abs=0.1)
    assert inspect(curve, dataclasses.replace(problem, clearance_margin_m=0.2)).passed


def test_a_path_along_a_wall_is_decided_exactly_at_the_need() -> None:
    control = np.array([[x, 2.0, 5.0] for x in [0.0, 0.0, *np.arange(0.0, 50.0, 2.0), 48.0, 48.0]])
    curve = Trajectory(control, 1.0)
    wall = [Box(np.array([-10.0, -5.0, 0.0]), np.array([70.0, 0.0, 50.0]))]
    problem = problem_of(curve, wall, vehicle_radius_m=0.5, clearance_margin_m=1.499)
    report = inspect(curve, problem)
    assert report.passed
    assert 1.499 <= report.min_clearance_m <= 1.5
    assert not inspect(curve, dataclasses.replace(problem, clearance_margin_m=1.5001)).passed


@pytest.fixture
def curve() -> Trajectory:
    return random_curve(np.random.default_rng(11))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("max_speed_mps", ViolationKind.SPEED),
        ("max_climb_mps", ViolationKind.CLIMB),
        ("max_descent_mps", ViolationKind.DESCENT),
        ("max_acceleration_mps2", ViolationKind.ACCELERATION),
        ("max_jerk_mps3", ViolationKind.JERK),
    ],
)
def test_each_limit_is_kept_to_the_last_digit(curve: Trajectory, name: str, kind: ViolationKind) -> None:
    measured = getattr(inspect(curve, problem_of(curve)), name)
    loose = Limits(1e4, 1e4, 1e4, 1e4)
    assert inspect(curve, problem_of(curve, limits=dataclasses.replace(loose, **{name: measured}))).passed
    report = inspect(curve, problem_of(curve, limits=dataclasses.replace(loose, **{name: measured * 0.999999})))
    (violation,) = report.violations
    assert violation.kind is kind
    assert violation.measured == measured
    motion = curve.motion_at(violation.time_s)
    there = {
        ViolationKind.SPEED: np.linalg.norm(motion.velocity_mps),
        ViolationKind.CLIMB: motion.velocity_mps[2],
        ViolationKind.DESCENT: -motion.velocity_mps[2],
        ViolationKind.ACCELERATION: np.linalg.norm(motion.acceleration_mps2),
        ViolationKind.JERK: _jerk_around(curve, violation.time_s),
    }[kind]
    assert there == pytest.approx(measured, rel=1e-6)


def _jerk_around(curve: Trajectory, time_s: float) -> float:
    """From accelerations a little apart: the jerk of a piece is constant."""
    step_s = 0.2 * curve.knot_interval_s
    before, after = curve.motion_at(time_s - step_s), curve.motion_at(time_s + step_s)
    return float(np.linalg.norm(after.acceleration_mps2 - before.acceleration_mps2)) / (2.0 * step_s)


def test_a_path_is_no_longer_than_its_budget(curve: Trajectory) -> None:
    along = curve.sample(np.linspace(curve.start_s, curve.end_s, 200_001)).position_m
    length_m = float(np.linalg.norm(np.diff(along, axis=0), axis=1).sum())
    assert inspect(curve, problem_of(curve, max_length_m=length_m * 1.0001)).passed
    (violation,) = inspect(curve, problem_of(curve, max_length_m=length_m * 0.9999)).violations
    assert violation.kind is ViolationKind.LENGTH
    assert violation.measured == pytest.approx(length_m, rel=LENGTH_RESOLUTION)


def test_a_path_that_turns_back_is_no_shorter_than_it_is() -> None:
    rng = np.random.default_rng(11)
    for _ in range(20):
        east = np.concatenate([[20.0] * 3, 20.0 + rng.normal(size=12), [20.0] * 3])
        curve = Trajectory(np.column_stack([east, np.full((len(east), 2), 20.0)]), 1.0)
        # Back and forth on a line: what is sampled is never longer than the path.
        along = curve.sample(np.linspace(curve.start_s, curve.end_s, 100_001)).position_m
        sampled_m = float(np.abs(np.diff(along[:, 0])).sum())
        length_m = inspect(curve, problem_of(curve)).length_m
        assert sampled_m <= length_m <= sampled_m * (1.0 + 2.0 * LENGTH_RESOLUTION)


def test_no_limit_of_the_vehicle_goes_unchecked() -> None:
    checked = {"max_speed_mps", "max_climb_mps", "max_descent_mps", "max_acceleration_mps2", "max_jerk_mps3"}
    checked |= {"max_turn_rate_radps"}
    # The heading is made by planner.yaw within its rate; it is not part of the curve.
    assert {field.name for field in dataclasses.fields(Limits)} == checked | {"max_yaw_rate_radps"}


def test_leaving_the_box_between_knots_is_found() -> None:
    control = np.array([[0.0, 0.0, 5.0]] * 3 + [[5.0, 0, 5], [10, -1.4, 5], [15, 0, 5]] + [[20.0, 0, 5]] * 3)
    curve = Trajectory(control, 1.0)
    lowest = dense(curve).position_m[:, 1].min()
    tight = Workspace(np.array([-1.0, lowest + 1e-4, -1.0]), np.full(3, 60.0))
    problem = problem_of(curve, workspace=tight, information=uniform(tight, (2, 2, 2)))
    (violation,) = inspect(curve, problem).violations
    assert violation.kind is ViolationKind.BOX
    assert violation.measured == pytest.approx(1e-4, rel=1e-3)
    assert "north" in violation.text
    wide = Workspace(np.array([-1.0, lowest, -1.0]), np.full(3, 60.0))
    assert inspect(curve, problem_of(curve, workspace=wide, information=uniform(wide, (2, 2, 2)))).passed


def test_leaving_the_fence_is_found_with_how_far() -> None:
    control = np.array([[x, x, 5.0] for x in [5.0, 5, 5, 15, 25, 35, 40, 40, 40]])
    curve = Trajectory(control, 1.0)
    (violation,) = inspect(curve, problem_of(curve, fence_polygon_m=FENCE)).violations
    assert violation.kind is ViolationKind.FENCE
    assert violation.measured == pytest.approx(10.0, abs=0.1)
    inside = Trajectory(control * [1.0, 0.7, 1.0], 1.0)
    assert inspect(inside, problem_of(inside, fence_polygon_m=FENCE)).passed


def test_both_ends_and_the_time_are_checked(curve: Trajectory) -> None:
    fits = problem_of(curve)
    here = curve.motion_at(curve.start_s)
    apart = np.array([0.0, 1e-4, 0.0])
    cases = {
        ViolationKind.START: [
            {"start": Motion(here.position_m + apart, here.velocity_mps, here.acceleration_mps2)},
            {"start": Motion(here.position_m, here.velocity_mps + apart, here.acceleration_mps2)},
            {"start": Motion(here.position_m, here.velocity_mps, here.acceleration_mps2 + apart)},
        ],
        ViolationKind.END: [{"end_position_m": fits.end_position_m + apart}],
        ViolationKind.DURATION: [{"duration_s": curve.duration_s * 0.999}],
    }
    assert inspect(curve, fits).passed
    for kind, changes in cases.items():
        for change in changes:
            report = inspect(curve, dataclasses.replace(fits, **change))
            assert [violation.kind for violation in report.violations] == [kind]
    # Ending anywhere still means ending at rest.
    rolling = Trajectory(curve.control_points_m[:-1], curve.knot_interval_s, curve.start_s)
    report = inspect(rolling, problem_of(rolling, end_position_m=None))
    assert [violation.kind for violation in report.violations] == [ViolationKind.END]


def test_a_curve_that_begins_in_motion_passes() -> None:
    start = Motion(np.array([5.0, 5.0, 5.0]), np.array([3.0, -1.0, 0.5]), np.array([0.5, 1.0, 0.0]))
    interval = 0.8
    first = control_points_at_start(start, interval)
    control = np.concatenate([first, [[10.0, 6, 6], [15, 10, 6]], np.tile([[18.0, 14, 6]], (3, 1))])
    curve = Trajectory(control, interval, 40.0)
    assert inspect(curve, problem_of(curve, start=start)).passed


def test_numbers_that_mean_nothing_are_refused() -> None:
    wild = Trajectory(np.full((5, 3), 1e200), 1.0)
    report = inspect(wild, problem_of(random_curve(np.random.default_rng(0))))
    assert [violation.kind for violation in report.violations] == [ViolationKind.DIVERGED]


def test_a_refused_curve_says_why(curve: Trajectory) -> None:
    limits = Limits(0.1, 1e4, 1e4, 1e-3)
    with pytest.raises(GateRefused, match=r"speed .* limit 0\.1.*acceleration") as refused:
        prove(curve, problem_of(curve, limits=limits))
    kinds = {violation.kind for violation in refused.value.report.violations}
    assert kinds == {ViolationKind.SPEED, ViolationKind.ACCELERATION}


def test_a_lower_bound_holds_even_where_the_work_is_cut_short(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    curve = random_curve(rng)
    field = ObstacleField.of(random_obstacles(rng, 5))
    exact = field.distance(dense(curve).position_m).min()
    for allowed in (10, 100, 1000):
        monkeypatch.setattr("planner.curve_bounds.REPORT_EVALUATIONS", allowed)
        monkeypatch.setattr("planner.curve_bounds.DECISION_EVALUATIONS", allowed)
        least = least_along(bezier_points(curve), field.distance, 1e3, 1e-6)
        assert least.lower <= exact + 1e-6
        assert least.upper >= exact - 0.05


def test_its_tolerances_are_tiny() -> None:
    assert gate.RELATIVE_TOLERANCE <= 1e-9
    assert gate.JOIN_TOLERANCE <= 1e-6
    assert gate.FENCE_TOLERANCE_M <= 1e-3


def test_without_obstacles_clearance_is_infinite(curve: Trajectory) -> None:
    assert inspect(curve, problem_of(curve)).min_clearance_m == np.inf


def test_the_length_of_a_curve_that_stands_far_from_the_origin_is_told_at_once() -> None:
    standing = np.tile([1234.567, -9876.543, 33.333], (40, 4, 1))
    rounded = standing + np.random.default_rng(0).normal(0.0, 2e-12, standing.shape)
    assert length_bound(standing, LENGTH_RESOLUTION) == 0.0
    assert length_bound(rounded, LENGTH_RESOLUTION) < 1e-8
    # One that stands for most of its time and flies then.
    flying = rounded.copy()
    flying[-1] = flying[-1, :1] + np.linspace(0.0, 3.0, 4)[:, None] * np.array([1.0, 0.0, 0.0])
    assert length_bound(flying, LENGTH_RESOLUTION) == pytest.approx(3.0, rel=2e-5)
