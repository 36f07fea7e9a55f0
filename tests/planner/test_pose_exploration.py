"""Places and headings explored together: the metric of poses, its optimiser, its proof."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import BSpline

from planner import kernels
from planner.gate import GateRefused, ViolationKind, inspect, prove
from planner.information import DensityGrid
from planner.judging import Judge, at_middles
from planner.kernel_metric_of import metric_of, metric_of_poses
from planner.plan import Plan
from planner.problem import Covered, HeadingRule, Kernel, Metric, Options, Problem
from planner.scene import TURN_RAD, free_from_control, knots_for, scene_of, trajectory_of
from planner.solver import solve
from planner.trajectory import Motion, Trajectory, Turning
from planner.yaw import along_travel, headings
from tests.planner.compiled import value_of
from tests.planner.worlds import open_box, two_peaks

OPTIONS = Options(candidates=2, modes=(4, 4, 1), metric=Metric.KERNEL, heading=HeadingRule.EXPLORED)
DURATION_S = 80.0


def problem_with(**changes) -> Problem:
    problem = open_box(duration_s=DURATION_S)
    return dataclasses.replace(problem, information=two_peaks(problem), **changes)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return solve(problem_with(), OPTIONS)


def turning_curve(rate_radps: float, segments: int = 20) -> Trajectory:
    """Straight and slow, with a heading that turns at a steady rate."""
    interval = DURATION_S / segments
    share = np.clip((np.arange(segments + 3) - 2.0) / (segments - 2.0), 0.0, 1.0)[:, None]
    path = np.array([5.0, 5.0, 10.0]) + share * np.array([90.0, 35.0, 0.0])
    return Trajectory(path, interval, 0.0, rate_radps * interval * (np.arange(segments + 3) - 1.0))


def planned(curve: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """The heading of a curve that has one."""
    heading = curve.headings_at(time_s)
    assert heading is not None
    return heading


def control_of(curve: Trajectory) -> np.ndarray:
    """Its control points."""
    assert curve.heading_control_rad is not None
    return curve.heading_control_rad


def dense_metric(problem: Problem, points: np.ndarray, theta: np.ndarray) -> float:
    """E by the definition, against a target of many poses: cells of the map times headings."""
    counts, around = (32, 24), 16
    mass = problem.information.mass.sum(axis=2)
    cells = [(np.arange(count) + 0.5) / count for count in counts]
    owner = [(cell * size).astype(int) for cell, size in zip(cells, mass.shape, strict=True)]
    weight = np.repeat(mass[np.ix_(*owner)].ravel(), around)
    east, north, heading = np.meshgrid(*cells, TURN_RAD * np.arange(around) / around, indexing="ij")
    target = np.stack([east.ravel(), north.ravel(), heading.ravel()], axis=1)

    def mean_kernel(one: np.ndarray, other: np.ndarray, share: np.ndarray) -> np.ndarray:
        total = 1.0
        for axis, variance in enumerate(theta):
            gap = one[:, None, axis] - other[None, :, axis]
            images = TURN_RAD * np.arange(-20, 21) if axis == 2 else [0.0]
            total = total * sum(np.exp(-0.5 * (gap + turn) ** 2 / variance) for turn in images)
        return total @ share / np.sqrt(np.prod(2.0 * np.pi * theta))

    share, each = weight / weight.sum(), np.full(len(points), 1.0 / len(points))
    some = np.random.default_rng(0).choice(len(target), size=400, p=share)
    own = float(np.mean(mean_kernel(target[some], target, share)))
    pull = mean_kernel(points, target, share) @ each
    return float(own - 2.0 * pull + mean_kernel(points, points, each) @ each)


def test_the_metric_of_poses_is_what_its_definition_says() -> None:
    problem = problem_with()
    metric = metric_of_poses(problem, OPTIONS)
    generator = np.random.default_rng(3)
    points = np.column_stack([generator.uniform(size=(40, 3)), generator.uniform(-9.0, 9.0, size=40)])
    theta = np.asarray(metric.variance, dtype=float)[[0, 1, 3]]
    found = float(value_of(metric, points, np.full(40, 1.0 / 40)))
    # The independent figure takes ∫p·P from four hundred draws.
    assert found == pytest.approx(dense_metric(problem, points[:, [0, 1, 3]], theta), rel=0.05)


def test_whole_turns_change_nothing() -> None:
    metric = metric_of_poses(problem_with(), OPTIONS)
    points = np.random.default_rng(4).uniform(size=(30, 4)).astype(np.float32)
    turned = points + np.array([0.0, 0.0, 0.0, 2.0 * TURN_RAD], np.float32)
    weight = np.full(30, 1.0 / 30)
    assert float(value_of(metric, turned, weight)) == pytest.approx(float(value_of(metric, points, weight)), 1e-4)


def test_what_was_covered_and_what_is_left_are_measured_as_one_flight() -> None:
    problem = problem_with()
    poses = np.random.default_rng(5).uniform(size=(60, 4)) * [1.0, 1.0, 1.0, TURN_RAD]
    whole = value_of(metric_of(problem, OPTIONS), poses, np.full(60, 1.0 / 60))
    covered = Covered(np.zeros(OPTIONS.modes), DURATION_S, poses[:40])
    left = dataclasses.replace(problem, covered=covered, duration_s=0.5 * DURATION_S)
    rest = value_of(metric_of(left, OPTIONS), poses[40:], np.full(20, 1.0 / 20))
    assert float(rest) == pytest.approx(float(whole), rel=1e-4)
    with pytest.raises(ValueError, match=r"give Covered\.poses"):
        metric_of(dataclasses.replace(left, covered=Covered(np.zeros(OPTIONS.modes), 1.0)), OPTIONS)


def test_headings_are_explored_only_with_a_metric_that_knows_them() -> None:
    with pytest.raises(ValueError, match=r"headings are explored by Metric\.KERNEL alone"):
        Options(heading=HeadingRule.EXPLORED)


@pytest.mark.parametrize("kernel", [Kernel.RBF, Kernel.MARKOV, Kernel.SIGNATURE])
def test_kernels_compare_headings_on_a_circle(kernel: Kernel) -> None:
    particles = np.random.default_rng(6).uniform(size=(4, 9, 4)).astype(np.float32)
    turned = particles.copy()
    turned[1, :, 3] += 3.0
    terms = jax.jit(lambda x: kernels.kernel_terms(kernel, x, wraps=True))
    gram, repulsion = terms(particles)
    again, pushed = terms(turned)
    np.testing.assert_allclose(gram, again, atol=1e-4)
    np.testing.assert_allclose(repulsion, pushed, atol=1e-3 * float(np.abs(repulsion).max()))


def test_repulsion_of_headings_is_the_gradient_of_the_kernel() -> None:
    particles = np.random.default_rng(7).uniform(size=(5, 8, 4)).astype(np.float32)
    gram, repulsion = jax.jit(lambda x: kernels.kernel_terms(Kernel.RBF, x, wraps=True))(particles)

    def squared(one: jax.Array, other: jax.Array) -> jax.Array:
        # A chord of the circle whose circumference is one.
        chord = jnp.sin(jnp.pi * (one[:, 3] - other[:, 3])) / jnp.pi
        return jnp.sum((one[:, :3] - other[:, :3]) ** 2) + jnp.sum(chord**2)

    bandwidth = -squared(particles[0], particles[1]) / np.log(gram[0, 1])
    slope = jax.jit(jax.grad(lambda one, other: jnp.exp(-squared(one, other) / bandwidth)))
    for on in range(5):
        by_hand = sum(slope(particles[by], particles[on]) for by in range(5) if by != on)
        np.testing.assert_allclose(repulsion[on], by_hand, atol=2e-4 * float(np.abs(repulsion).max()))


def test_a_heading_is_a_spline_over_the_same_knots() -> None:
    generator = np.random.default_rng(8)
    curve = Trajectory(generator.normal(size=(12, 3)), 0.7, 3.0, generator.normal(size=12))
    knots = 3.0 + (np.arange(16) - 3.0) * 0.7
    time_s = np.linspace(3.0, curve.end_s - 1e-9, 200)
    np.testing.assert_allclose(planned(curve, time_s), BSpline(knots, control_of(curve), 3)(time_s), atol=1e-12)
    rest, later = curve.from_knot(4), time_s[time_s > 3.0 + 4 * 0.7]
    np.testing.assert_allclose(planned(rest, later), planned(curve, later), atol=1e-12)
    np.testing.assert_allclose(rest.sample(later).position_m, curve.sample(later).position_m, atol=1e-12)
    assert Trajectory(np.zeros((4, 3)), 1.0).headings_at(np.zeros(2)) is None
    with pytest.raises(ValueError, match="a control point for each"):
        Trajectory(np.zeros((5, 3)), 1.0, 0.0, np.zeros(4))
    with pytest.raises(ValueError, match="do not fly this"):
        Trajectory(np.zeros((4, 3)), 1.0, 0.0, np.array([0.0, np.nan, 0.0, 0.0]))


def test_the_gate_proves_the_rate_of_the_heading_at_its_exact_extreme() -> None:
    problem = problem_with(start=Motion.at_rest(np.array([5.0, 5.0, 10.0])))
    generator = np.random.default_rng(9)
    curve = turning_curve(0.3)
    wild = dataclasses.replace(curve, heading_control_rad=control_of(curve) + generator.normal(size=23))
    time_s = np.linspace(0.0, DURATION_S, 40_001)
    heading = planned(wild, time_s)
    sampled = np.abs(np.gradient(heading, time_s)).max()
    limits = dataclasses.replace(problem.limits, max_yaw_rate_radps=1.0001 * float(sampled))
    kept = inspect(wild, dataclasses.replace(problem, limits=limits))
    assert kept.max_yaw_rate_radps == pytest.approx(sampled, rel=1e-5)
    assert ViolationKind.YAW_RATE not in {violation.kind for violation in kept.violations}
    limits = dataclasses.replace(problem.limits, max_yaw_rate_radps=0.9999 * float(sampled))
    broken = {one.kind: one for one in inspect(wild, dataclasses.replace(problem, limits=limits)).violations}
    assert "deg/s" in broken[ViolationKind.YAW_RATE].text
    assert inspect(dataclasses.replace(wild, heading_control_rad=None), problem).max_yaw_rate_radps is None


def test_the_gate_refuses_a_heading_that_diverged_or_begins_elsewhere(plan: Plan) -> None:
    proven = prove(plan.best.trajectory, problem_with())
    assert not control_of(proven).flags.writeable
    far = Trajectory(proven.control_points_m, proven.knot_interval_s, 0.0, 1e9 + control_of(proven))
    with pytest.raises(GateRefused, match="rad: the solve diverged"):
        prove(far, problem_with())
    heading = planned(proven, np.zeros(1))
    begins = Turning(float(heading[0]) + 3 * TURN_RAD)
    assert inspect(proven, problem_with(start_turning=begins)).passed
    elsewhere = inspect(proven, problem_with(start_turning=Turning(begins.yaw_rad + 0.1)))
    assert [violation.kind for violation in elsewhere.violations] == [ViolationKind.START]


@pytest.mark.parametrize("start", [None, Turning(-2.0, 0.4)])
def test_the_optimisers_heading_is_the_heading_that_is_flown(start: Turning | None) -> None:
    problem = problem_with(start_turning=start)
    segments, per_segment = knots_for(problem, OPTIONS)
    free = np.random.default_rng(10).uniform(0.2, 0.8, size=(segments - 2, 4))
    steps = np.random.default_rng(11).uniform(-0.9, 0.9, size=segments - 2)
    most = problem.limits.max_yaw_rate_radps * problem.duration_s / segments / TURN_RAD
    goes_on = 0.0 if start is None else start.yaw_rad + start.yaw_rate_radps * problem.duration_s / segments
    free[:, 3] = goes_on / TURN_RAD + np.cumsum(most * steps)
    scene = scene_of(problem, OPTIONS, segments, per_segment)
    control = eqx.filter_jit(scene.control_points)(free)
    np.testing.assert_allclose(free_from_control(np.asarray(control))[:-1], free[:-1], atol=1e-6)
    curve = trajectory_of(problem, free)
    middles = (np.arange(segments * per_segment) + 0.5) * DURATION_S / (segments * per_segment)
    np.testing.assert_allclose(
        TURN_RAD * np.asarray(eqx.filter_jit(scene.positions)(control))[:, 3], planned(curve, middles), atol=1e-4
    )
    if start is not None:
        early = planned(curve, np.array([0.0, 1e-4]))
        assert early[0] == pytest.approx(start.yaw_rad, abs=1e-12)
        assert np.diff(early)[0] / 1e-4 == pytest.approx(start.yaw_rate_radps, rel=1e-3)


def test_a_plan_of_poses_covers_more_than_looking_where_it_goes(plan: Plan) -> None:
    judge = Judge(problem_with(), OPTIONS)
    best = at_middles(plan.best.trajectory)
    rate = problem_with().limits.max_yaw_rate_radps
    same_path = judge.ergodic_metric(best.position_m, headings(best.time_s, best.velocity_mps, rate))
    assert plan.best.ergodic_metric < 0.6 * same_path
    assert plan.best.ergodic_metric < plan.lawnmower_ergodic_metric


@pytest.mark.slow
def test_a_plan_of_poses_covers_more_than_a_plan_of_places(plan: Plan) -> None:
    travelling = solve(problem_with(), dataclasses.replace(OPTIONS, heading=HeadingRule.TRAVEL)).best
    assert travelling.trajectory.heading_control_rad is None
    its_path = Judge(problem_with(), OPTIONS).ergodic_metric(at_middles(travelling.trajectory).position_m)
    assert plan.best.ergodic_metric < 0.6 * its_path


def test_every_candidate_keeps_the_yaw_rate_and_they_differ(plan: Plan) -> None:
    limit = problem_with().limits.max_yaw_rate_radps
    for candidate in plan.candidates:
        assert candidate.feasible, candidate.report.violations
        time_s = np.linspace(0.0, DURATION_S, 20_001)
        heading = planned(candidate.trajectory, time_s)
        assert np.abs(np.diff(heading) / np.diff(time_s)).max() <= limit * (1.0 + 1e-9)
    first, second = (control_of(candidate.trajectory) for candidate in plan.candidates)
    assert np.abs(np.subtract(first, second)).max() > 1.0


def test_the_same_seed_gives_the_same_poses(plan: Plan) -> None:
    again = solve(problem_with(), OPTIONS)
    for one, other in zip(plan.candidates, again.candidates, strict=True):
        np.testing.assert_array_equal(one.trajectory.control_points_m, other.trajectory.control_points_m)
        np.testing.assert_array_equal(control_of(one.trajectory), control_of(other.trajectory))


def test_a_replan_goes_on_with_the_heading_and_counts_what_was_seen(plan: Plan) -> None:
    curve, now_s = plan.best.trajectory, 0.4 * DURATION_S
    times = np.arange(0.0, now_s, 0.1)
    place = problem_with().workspace.unit_from_enu(curve.sample(times).position_m)
    poses = np.column_stack([place, planned(curve, times)])
    at = planned(curve, np.array([now_s - 1e-3, now_s, now_s + 1e-3]))
    # Counted by another whole turn, as a vehicle tells it.
    start = Turning(float(at[1]) - TURN_RAD, float(at[2] - at[0]) / 2e-3)
    left = problem_with(
        start=curve.motion_at(now_s),
        start_turning=start,
        duration_s=DURATION_S - now_s,
        covered=Covered(np.zeros(OPTIONS.modes), now_s, poses),
    )
    knot = int(now_s / curve.knot_interval_s)
    replan = solve(left, OPTIONS, warm_start=[curve.from_knot(knot)])
    begins = planned(replan.best.trajectory, np.zeros(1))
    assert begins[0] == pytest.approx(start.yaw_rad, abs=1e-9)
    # No worse than flying the old plan to its end, by more than rounding and its drawn-in limits.
    rest = at_middles(curve.from_knot(knot))
    staying = Judge(left, OPTIONS).ergodic_metric(rest.position_m, planned(curve, rest.time_s))
    assert replan.best.ergodic_metric < 1.1 * staying


def test_the_direction_of_travel_is_held_where_the_vehicle_stands() -> None:
    path = np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 0], [2, 0, 0], [1, 0, 0]])
    found = along_travel(path)
    np.testing.assert_allclose(np.cos(found[[0, 1, 2, 3, 4, 5]]), 1.0)
    np.testing.assert_allclose(np.cos(found[-2:]), -1.0)
    np.testing.assert_array_equal(along_travel(np.zeros((3, 3))), 0.0)


def test_a_planned_heading_is_followed_from_wherever_the_vehicle_looks() -> None:
    time_s = np.arange(0.0, 20.0, 0.1)
    planned = 0.2 * time_s
    found = headings(time_s, np.zeros((len(time_s), 3)), 0.8, start_yaw_rad=-2.0, planned_rad=planned)
    assert np.abs(np.diff(found)).max() <= 0.08 + 1e-12
    np.testing.assert_allclose(found[50:], planned[50:], atol=1e-12)
    exact = headings(time_s, np.zeros((len(time_s), 3)), 0.8, planned_rad=planned)
    np.testing.assert_allclose(exact, planned, atol=1e-12)


def test_information_on_one_place_is_looked_at_from_every_side() -> None:
    """A vehicle that turns on the spot is best for a peak, and looks at it from all sides alike."""
    problem = open_box(duration_s=DURATION_S)
    mass = np.zeros((16, 16, 4))
    mass[7:9, 7:9] = 1.0
    peaked = dataclasses.replace(problem, information=DensityGrid(problem.workspace, mass / mass.sum()))
    judge = Judge(peaked, OPTIONS)
    stays = np.tile([50.0, 40.0, 10.0], (400, 1))
    around = judge.ergodic_metric(stays, np.linspace(0.0, 4 * TURN_RAD, 400, endpoint=False))
    half = judge.ergodic_metric(stays, np.linspace(0.0, 0.5 * TURN_RAD, 400, endpoint=False))
    assert around < half < judge.ergodic_metric(stays, np.zeros(400))
