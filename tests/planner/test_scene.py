"""The optimiser's arrays mean what the problem says."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mission.mission_file.planner import FEWEST_SAMPLES, MOST_SAMPLES
from planner.information import uniform
from planner.obstacles import ObstacleField, Sphere
from planner.problem import Limits, Options, Problem
from planner.scene import LIMIT_SHARE, free_from_control, knots_for, sample_uniform, scene_of, trajectory_of
from planner.trajectory import Motion, Trajectory
from planner.workspace import Workspace

BOX = Workspace(np.array([-20.0, 0.0, 5.0]), np.array([60.0, 50.0, 25.0]))
LIMITS = Limits(max_speed_mps=6.0, max_climb_mps=2.0, max_descent_mps=1.0, max_acceleration_mps2=3.0)
START = np.array([0.0, 10.0, 10.0])


@pytest.fixture
def problem() -> Problem:
    return Problem(
        workspace=BOX,
        information=uniform(BOX),
        obstacles=ObstacleField.of([Sphere(np.array([30.0, 30.0, 15.0]), 4.0)]),
        limits=LIMITS,
        start=Motion(START, np.array([1.0, 0.5, 0.0]), np.array([0.1, 0.0, -0.2])),
        end_position_m=np.array([5.0, 5.0, 10.0]),
        duration_s=32.0,
        vehicle_radius_m=0.5,
        clearance_margin_m=1.0,
    )


def random_free(segments: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(0.1, 0.9, size=(segments - 2, 3))


def test_every_candidate_begins_with_the_given_motion_and_ends_at_rest_at_the_end(problem: Problem) -> None:
    curve = trajectory_of(problem, random_free(20))
    start, end = curve.motion_at(0.0), curve.motion_at(curve.end_s)
    np.testing.assert_allclose(start.position_m, problem.start.position_m, atol=1e-12)
    np.testing.assert_allclose(start.velocity_mps, problem.start.velocity_mps, atol=1e-12)
    np.testing.assert_allclose(start.acceleration_mps2, problem.start.acceleration_mps2, atol=1e-11)
    np.testing.assert_allclose(end.position_m, problem.end_position_m, atol=1e-12)
    np.testing.assert_allclose(end.velocity_mps, 0.0, atol=1e-12)
    assert curve.duration_s == pytest.approx(problem.duration_s)


def test_a_free_end_is_where_the_last_free_point_lies(problem: Problem) -> None:
    free_end = dataclasses.replace(problem, end_position_m=None)
    free = random_free(20)
    curve = trajectory_of(free_end, free)
    np.testing.assert_allclose(curve.motion_at(curve.end_s).position_m, BOX.enu_from_unit(free[-1]))


def test_the_optimisers_curve_is_the_curve_that_is_flown(problem: Problem) -> None:
    scene = scene_of(problem, Options(), 20, 2)
    free = random_free(20)
    control = scene.control_points(jnp.asarray(free, jnp.float32))
    curve = trajectory_of(problem, free)
    np.testing.assert_allclose(BOX.enu_from_unit(np.asarray(control)), curve.control_points_m, atol=1e-4)
    np.testing.assert_allclose(free_from_control(np.asarray(control))[:-1], free[:-1], atol=1e-6)
    moments = (np.arange(40) + 0.5) / 40 * curve.duration_s
    found = BOX.enu_from_unit(np.asarray(sample_uniform(control, 2)))
    np.testing.assert_allclose(found, curve.sample(moments).position_m, atol=1e-4)


def test_satisfied_constraints_imply_satisfied_limits_on_the_whole_curve(problem: Problem) -> None:
    scene = scene_of(problem, Options(), 24, 3)

    @jax.jit
    def constraints(free: jax.Array) -> jax.Array:
        control = scene.control_points(free)
        return scene.constraints(control, scene.positions(control))

    rng = np.random.default_rng(3)
    satisfied = 0
    for scale in np.geomspace(0.002, 0.3, 40):
        line = np.linspace(BOX.unit_from_enu(START), BOX.unit_from_enu(problem.end_position_m), 22)
        free = np.clip(line + scale * rng.normal(size=(22, 3)).cumsum(axis=0) / 5.0, 0.01, 0.99).astype(np.float32)
        if float(constraints(free).max()) > 0.0:
            continue
        satisfied += 1
        samples = trajectory_of(problem, free).sampled_every(0.01)
        speed = np.linalg.norm(samples.velocity_mps, axis=1)
        # The first two differences of control points belong to the given motion.
        later = samples.time_s > 2.0 * 32.0 / 24.0
        assert speed[later].max() <= LIMITS.max_speed_mps
        assert samples.velocity_mps[later, 2].max() <= LIMITS.max_climb_mps
        assert -samples.velocity_mps[later, 2].min() <= LIMITS.max_descent_mps
        assert problem.obstacles.distance(samples.position_m).min() >= problem.keep_out_m
    assert satisfied >= 3


def test_each_broken_condition_is_seen(problem: Problem) -> None:
    scene = scene_of(problem, Options(), 24, 3)

    def worst(free: np.ndarray) -> float:
        control = scene.control_points(jnp.asarray(free, jnp.float32))
        return float(scene.constraints(control, scene.positions(control)).max())

    calm = np.tile(BOX.unit_from_enu(START), (22, 1))
    still_end = dataclasses.replace(problem, end_position_m=None, start=Motion.at_rest(START))
    scene = scene_of(still_end, Options(), 24, 3)
    assert worst(calm) < 0.0
    fast = calm.copy()
    fast[10:] += np.array([0.4, 0.0, 0.0])
    assert worst(fast) > 1.0
    outside = calm - np.linspace(0.0, 1.0, 22)[:, None] * np.array([0.3, 0.0, 0.0])
    assert worst(outside) > 0.0
    through = calm + np.linspace(0.0, 1.0, 22)[:, None] * (BOX.unit_from_enu(np.array([30.0, 30.0, 15.0])) - calm[0])
    assert worst(through) > 0.0


def test_limits_are_drawn_in_so_that_the_gate_has_room(problem: Problem) -> None:
    scene = scene_of(problem, Options(), 24, 3)
    assert float(scene.max_speed_mps) == pytest.approx(LIMIT_SHARE * LIMITS.max_speed_mps)
    assert float(scene.keep_out_m) > problem.keep_out_m


def test_missions_of_similar_size_share_a_compilation(problem: Problem) -> None:
    longer = dataclasses.replace(problem, duration_s=problem.duration_s * 1.05)
    assert knots_for(problem, Options()) == knots_for(longer, Options())


def test_a_given_time_step_sets_the_number_of_samples(problem: Problem) -> None:
    for samples in (FEWEST_SAMPLES, 50, MOST_SAMPLES):
        segments, per_segment = knots_for(problem, Options(time_step_s=problem.duration_s / samples))
        assert segments * per_segment == samples
    segments, per_segment = knots_for(problem, Options(time_step_s=0.5))
    assert segments * per_segment == 64


def test_a_trajectory_is_never_made_of_points_outside_the_box(problem: Problem) -> None:
    wild = 3.0 * np.random.default_rng(0).normal(size=(18, 3))
    curve: Trajectory = trajectory_of(problem, wild)
    assert (curve.control_points_m[3:] >= BOX.box_min_m - 1e-9).all()
    assert (curve.control_points_m[3:] <= BOX.box_max_m + 1e-9).all()
