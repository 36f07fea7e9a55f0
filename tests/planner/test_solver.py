"""The whole solve on small problems: what comes out is proven, different, repeatable and better than a lawnmower."""

import dataclasses

import jax
import numpy as np
import pytest

from planner import gate
from planner.information import gaussians
from planner.obstacles import ObstacleField, Sphere
from planner.plan import Status
from planner.polish import parted
from planner.priors import WalkPrior
from planner.problem import Covered, Kernel, Method, MetricWeights
from planner.solver import Progress, solve
from planner.spectral_metric import mean_basis
from planner.trajectory import Trajectory
from tests.interpolating import interpolating
from tests.planner.small_problem import BOX, OBSTACLE_LIST, OPTIONS, problem_with


@pytest.fixture(scope="module")
def plan():
    return solve(problem_with(), OPTIONS)


def tail(curve: Trajectory, from_s: float) -> Trajectory:
    """What is left of a curve, as a curve of its own."""
    moments = np.linspace(from_s, curve.end_s, curve.segments + 1)
    return interpolating(curve.sample(moments).position_m, moments[1] - moments[0], curve.motion_at(from_s))


def test_what_is_selected_is_proven_and_the_best_of_those_that_are(plan) -> None:
    assert plan.status is Status.CONVERGED
    assert gate.prove(plan.best.trajectory, problem_with()).report.passed
    assert plan.best.cost == min(candidate.cost for candidate in plan.ranked())
    assert plan.best.report.min_clearance_m >= 0.8


def test_it_covers_a_level_area_better_than_a_lawnmower_of_its_length(plan) -> None:
    assert plan.best.ergodic_metric < plan.lawnmower_ergodic_metric


def test_candidates_differ(plan) -> None:
    assert plan.diversity.mean_pair_distance > 0.1
    assert plan.diversity.effective_plans > 2.0


def test_the_same_seed_gives_the_same_plan_and_another_seed_another(plan) -> None:
    again = solve(problem_with(), OPTIONS)
    np.testing.assert_array_equal(plan.best.trajectory.control_points_m, again.best.trajectory.control_points_m)
    other = solve(problem_with(), dataclasses.replace(OPTIONS, seed=5))
    assert not np.array_equal(
        plan.candidates[-1].trajectory.control_points_m, other.candidates[-1].trajectory.control_points_m
    )


def test_peaked_information_is_covered_at_least_twice_as_well_as_by_a_lawnmower() -> None:
    peaked = gaussians(BOX, np.array([[45.0, 30.0, 10.0], [10.0, 30.0, 10.0]]), np.full((2, 3), 4.0), np.ones(2))
    found = solve(problem_with(information=peaked), OPTIONS)
    assert found.best.ergodic_metric < 0.5 * found.lawnmower_ergodic_metric


def test_a_replan_begins_as_the_vehicle_moves_and_remembers_what_was_covered(plan) -> None:
    curve = plan.best.trajectory
    now_s = 20.0
    flown = curve.sample(np.linspace(0.0, now_s, 400)).position_m
    covered = Covered(mean_basis(BOX.unit_from_enu(flown), np.full(400, 1 / 400), OPTIONS.modes), now_s)
    rest = problem_with(start=curve.motion_at(now_s), duration_s=curve.duration_s - now_s, covered=covered)
    replanned = solve(rest, OPTIONS, warm_start=[tail(plan.best.trajectory, now_s)])
    assert replanned.selected is not None
    start = replanned.best.trajectory.motion_at(0.0)
    np.testing.assert_allclose(start.position_m, rest.start.position_m, atol=1e-9)
    np.testing.assert_allclose(start.velocity_mps, rest.start.velocity_mps, atol=1e-9)
    np.testing.assert_allclose(start.acceleration_mps2, rest.start.acceleration_mps2, atol=1e-8)
    # Flown and still to fly together are about as good as the plan was, so memory was kept.
    assert replanned.best.ergodic_metric < 1.5 * plan.best.ergodic_metric


def test_progress_goes_from_nothing_to_the_gate_without_falling_back() -> None:
    told: list[Progress] = []
    solve(problem_with(), OPTIONS, progress=told.append)
    shares = [one.done for one in told]
    assert shares == sorted(shares)
    assert told[0].phase == "seeds"
    assert told[-1].phase == "gate"


def test_no_candidate_ends_worse_than_the_seed_it_grew_from() -> None:
    options = dataclasses.replace(OPTIONS, candidates=3)
    seeds = solve(problem_with(), options, time_left_s=lambda: 0.0)
    full = solve(problem_with(), options)
    for seed, candidate in zip(seeds.candidates, full.candidates, strict=True):
        assert seed.seed_pattern == candidate.seed_pattern
        if seed.feasible:
            assert candidate.feasible
            assert candidate.cost <= seed.cost


def test_warm_candidates_that_coincide_are_parted_and_no_others(plan) -> None:
    rest = plan.best.trajectory.from_knot(10)
    left = problem_with(start=rest.motion_at(rest.start_s), duration_s=rest.duration_s)
    options = dataclasses.replace(OPTIONS, candidates=2, time_step_s=rest.duration_s / (2 * rest.segments))
    first, second = solve(left, options, warm_start=[rest, rest]).candidates
    assert first.feasible
    assert second.feasible
    apart_m = np.abs(first.trajectory.control_points_m - second.trajectory.control_points_m).max()
    assert apart_m > 1.0
    # What does not coincide with an earlier one is not touched.
    free = np.stack([rest.control_points_m, rest.control_points_m, rest.control_points_m[::-1]]) / 100.0
    moved = np.abs(parted(free, 0) - free).max(axis=(1, 2))
    np.testing.assert_allclose(moved[[0, 2]], 0.0, atol=1e-6)
    assert moved[1] > 1e-3


def test_a_prior_on_the_knots_is_an_option_of_a_solve() -> None:
    options = dataclasses.replace(OPTIONS, candidates=2, knot_prior=WalkPrior(0.1, 0.02))
    assert solve(problem_with(), options).selected is not None


@pytest.mark.parametrize("kernel", [Kernel.MARKOV, Kernel.IDENTITY, Kernel.CONSTANT, Kernel.SIGNATURE])
def test_every_kernel_plans(kernel: Kernel) -> None:
    found = solve(problem_with(), dataclasses.replace(OPTIONS, kernel=kernel, candidates=3))
    assert found.selected is not None


def test_the_papers_recipe_runs_and_its_candidates_are_judged_like_all_others() -> None:
    options = dataclasses.replace(OPTIONS, method=Method.SVES, metric_weights=MetricWeights.SQUARED)
    found = solve(problem_with(), options)
    assert found.steps >= 500
    assert len(found.candidates) == OPTIONS.candidates
    if found.selected is not None:
        assert gate.prove(found.best.trajectory, problem_with()).report.passed


def test_a_mission_of_similar_size_runs_what_is_compiled(plan) -> None:
    similar = problem_with(
        information=gaussians(
            BOX, np.array([[45.0, 30.0, 10.0]]), np.array([[8.0, 8.0, 3.0]]), np.ones(1), (30, 20, 4)
        ),
        obstacles=ObstacleField.of([Sphere(np.array([25.0, 12.0, 10.0]), 3.0), *OBSTACLE_LIST[1:]]),
        duration_s=98.0,
    )
    compiled_s: list[float] = []

    def listen(event: str, duration_secs: float, **_: str | int) -> None:
        if event == "/jax/core/compile/backend_compile_duration":
            compiled_s.append(duration_secs)

    jax.monitoring.register_event_duration_secs_listener(listen)
    try:
        found = solve(similar, OPTIONS)
    finally:
        jax.monitoring.unregister_event_duration_listener(listen)
    assert found.selected is not None
    assert compiled_s == []


def test_plans_keep_to_a_jerk_and_a_length() -> None:
    limits = dataclasses.replace(problem_with().limits, max_jerk_mps3=3.0)
    found = solve(problem_with(limits=limits, max_length_m=220.0), OPTIONS)
    curve = found.best.trajectory
    moments = np.linspace(curve.start_s, curve.end_s, 5001)
    samples = curve.sample(moments)
    jerk = np.linalg.norm(np.diff(samples.acceleration_mps2, axis=0), axis=1) / np.diff(moments)
    assert jerk.max() <= 3.0 * (1.0 + 1e-6)
    assert np.linalg.norm(np.diff(samples.position_m, axis=0), axis=1).sum() <= 220.0
    # Both are used, not merely kept.
    assert jerk.max() > 1.5
    assert found.best.report.length_m > 200.0
