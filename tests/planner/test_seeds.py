"""Sets of seeds: every pattern, against the vehicle, the free space and the gate."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.free_space import FreeSpace
from planner.gate import ViolationKind, inspect
from planner.obstacles import ObstacleField
from planner.polygon import KeepIn
from planner.polyline import length_of
from planner.problem import Problem
from planner.seeds import LAST_RESORT, Pattern, seed_paths, spline_from_path
from planner.seeds.pacing import reach_m
from planner.trajectory import Motion, Trajectory
from tests.planner.worlds import LIMITS, mixed, open_box, trees

SEGMENTS = 192
FENCE = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [60.0, 80.0], [60.0, 50.0], [0.0, 50.0]])


def curve_of(points: np.ndarray, problem: Problem, segments: int = SEGMENTS) -> Trajectory:
    return Trajectory(spline_from_path(points, problem, segments), problem.duration_s / segments)


def test_every_pattern_is_drawn_and_begins_and_ends_where_it_should() -> None:
    problem = open_box()
    seeds = seed_paths(problem, 14, np.random.default_rng(0))
    assert [seed.pattern for seed in seeds[:3]] == ["lawnmower", "information tour", "greedy ridge"]
    assert {seed.pattern for seed in seeds} == {pattern.value for pattern in Pattern if pattern not in LAST_RESORT}
    for seed in seeds:
        np.testing.assert_allclose(seed.points_m[0], problem.start.position_m)
        np.testing.assert_allclose(seed.points_m[-1], problem.end_position_m)
        assert all(problem.workspace.contains(point) for point in seed.points_m)
    lengths = np.array([length_of(seed.points_m) for seed in seeds])
    # The time is used: climbs and corners take the rest.
    assert (lengths > 0.5 * reach_m(problem)).all()
    assert (lengths < 1.05 * reach_m(problem)).all()
    unit = np.stack([problem.workspace.unit_from_enu(seed.points_m) for seed in seeds])
    apart = np.linalg.norm(unit[:, None] - unit[None], axis=-1).mean(axis=-1)
    assert apart[~np.eye(len(seeds), dtype=bool)].min() > 0.1


def test_the_same_generator_gives_the_same_paths_and_another_gives_others() -> None:
    problem = open_box(obstacles=ObstacleField.of(trees(np.random.default_rng(0), 8)))
    first, again, other = (seed_paths(problem, 5, np.random.default_rng(n)) for n in (7, 7, 8))
    for one, two in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.points_m, two.points_m)
    assert not np.array_equal(first[1].points_m, other[1].points_m)


def test_in_the_open_every_seed_can_be_flown_as_it_is() -> None:
    problem = open_box()
    for seed in seed_paths(problem, 12, np.random.default_rng(1)):
        report = inspect(curve_of(seed.points_m, problem), problem)
        # The spline rounds what is sharper than its knots; a few hundredths over are the optimiser's to mend.
        allowed = {ViolationKind.ACCELERATION, ViolationKind.CLIMB, ViolationKind.DESCENT}
        assert {violation.kind for violation in report.violations} <= allowed, seed.pattern
        assert all(violation.measured < 1.15 * violation.limit for violation in report.violations), seed.pattern


@pytest.mark.parametrize("kind", [trees, mixed])
def test_between_obstacles_seeds_are_almost_free(kind) -> None:
    problem = open_box(obstacles=ObstacleField.of(kind(np.random.default_rng(3), 16)))
    for seed in seed_paths(problem, 8, np.random.default_rng(0)):
        clearance = problem.obstacles.distance(seed.points_m) - problem.keep_out_m
        assert (clearance < -0.3).mean() < 0.02, seed.pattern


def test_seeds_stay_inside_the_fence() -> None:
    problem = open_box(fence_polygon_m=FENCE)
    for seed in seed_paths(problem, 8, np.random.default_rng(0)):
        inside = KeepIn.of(FENCE).distance(seed.points_m[:, :2])
        assert (inside < -0.2).mean() < 0.02, seed.pattern


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_any_replan_gets_finite_paths_from_where_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    velocity = rng.normal(size=3)
    velocity *= rng.uniform(0.0, 4.5) / np.linalg.norm(velocity) * np.array([1.0, 1.0, 0.3])
    start = Motion(rng.uniform([1, 1, 1], [99, 79, 19]), velocity, rng.normal(size=3))
    end = None if rng.random() < 0.4 else rng.uniform([1, 1, 1], [99, 79, 19])
    problem = open_box(
        obstacles=ObstacleField.of(mixed(rng, int(rng.integers(0, 8)))),
        start=start,
        end_position_m=end,
        duration_s=float(10.0 ** rng.uniform(0.0, 2.5)),
        fence_polygon_m=FENCE if rng.random() < 0.3 else None,
    )
    for path in seed_paths(problem, 7, rng):
        assert path.points_m.shape == (1025, 3)
        assert np.isfinite(path.points_m).all()
        np.testing.assert_allclose(path.points_m[0], start.position_m, atol=1e-9)
        if end is not None:
            np.testing.assert_allclose(path.points_m[-1], end, atol=1e-9)
        curve = curve_of(path.points_m, problem, 32)
        report = inspect(curve, problem)
        assert not {ViolationKind.START, ViolationKind.END, ViolationKind.DURATION} & {
            violation.kind for violation in report.violations
        }


def test_the_limits_are_those_of_the_problem() -> None:
    slow = dataclasses.replace(LIMITS, max_speed_mps=1.0)
    problem = open_box(limits=slow)
    for seed in seed_paths(problem, 4, np.random.default_rng(0)):
        assert inspect(curve_of(seed.points_m, problem, 1000), problem).max_speed_mps < 1.03


def test_the_free_space_of_seeds_keeps_more_than_the_gate_asks() -> None:
    problem = open_box(obstacles=ObstacleField.of(trees(np.random.default_rng(0), 4)))
    points = np.random.default_rng(1).uniform([0, 0, 0], [100, 80, 20], (500, 3))
    free = FreeSpace(problem).margin(points) >= 0.0
    assert (problem.obstacles.distance(points[free]) > problem.keep_out_m).all()


def test_without_time_to_draw_more_seeds_those_that_were_drawn_are_varied() -> None:
    problem = open_box()
    asked = itertools.count()
    seeds = seed_paths(problem, 7, np.random.default_rng(0), go_on=lambda: next(asked) < 1)
    drawn = seed_paths(problem, 4, np.random.default_rng(0))
    assert [seed.pattern for seed in seeds] == [drawn[index % 4].pattern for index in range(7)]
    for seed, own in zip(seeds, drawn, strict=False):
        np.testing.assert_array_equal(seed.points_m, own.points_m)
    for seed, source in zip(seeds[4:], itertools.cycle(drawn), strict=False):
        aside = np.linalg.norm(seed.points_m - source.points_m, axis=1)
        assert aside[[0, -1]].max() == 0.0
        assert 1.0 < aside.max() < 30.0
        assert (seed.points_m >= problem.workspace.box_min_m).all()
        assert (seed.points_m <= problem.workspace.box_max_m).all()
