"""The search metric: against sweeps counted one by one, its bound, its gradient, and what it does to a plan."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from planner.detection_metric import DetectionMetric
from planner.effort import Search
from planner.information import DensityGrid, gaussians, uniform
from planner.judging import Judge
from planner.obstacles import ObstacleField
from planner.problem import Limits, Options, Problem
from planner.scene import knots_for, scene_of
from planner.solver import Stage, _Work, solve
from planner.time_budget import TimeBudget
from planner.trajectory import Motion
from planner.workspace import Workspace
from tests.planner.compiled import value_and_slope_of, value_of

BOX = Workspace(np.array([0.0, 0.0, 10.0]), np.array([600.0, 400.0, 50.0]))
PRIOR = gaussians(
    BOX,
    np.array([[150.0, 120.0, 30.0], [450.0, 300.0, 30.0]]),
    np.array([[60.0, 40.0, 40.0], [50.0, 60.0, 40.0]]),
    np.array([2.0, 1.0]),
    (120, 80, 1),
)
SEARCH = Search(PRIOR, 15.0, 0.8)


def rows(count: int, samples: int = 2000) -> np.ndarray:
    """A lawnmower in the unit cube, shape (sample, 3)."""
    corners = []
    for row in range(count):
        east = (0.1, 0.9) if row % 2 == 0 else (0.9, 0.1)
        corners += [(end, (row + 0.5) / count) for end in east]
    place = np.linspace(0.0, len(corners) - 1.0, samples)
    flat = np.stack([np.interp(place, np.arange(len(corners)), axis) for axis in np.array(corners).T], axis=1)
    return np.column_stack([flat, np.full(samples, 0.5)])


def length_m(path_unit: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(path_unit * BOX.lengths_m, axis=0), axis=1).sum())


@pytest.mark.parametrize("count", [3, 8, 14])
def test_what_it_finds_is_what_sweeps_counted_one_by_one_find(count: int) -> None:
    path = rows(count)
    metric = DetectionMetric.of(SEARCH, length_m(path), length_m(path) / len(path))
    found = float(metric.most_found) - float(value_of(metric, path, np.ones(len(path))))
    assert found == pytest.approx(SEARCH.probability_found(BOX.enu_from_unit(path)), rel=0.1)


def test_nothing_of_that_length_is_below_zero() -> None:
    rng = np.random.default_rng(1)
    for count in (4, 10, 30):
        path = rows(count)
        metric = DetectionMetric.of(SEARCH, length_m(path), length_m(path) / len(path))
        assert float(value_of(metric, path, np.ones(len(path)))) > 0.0
    # What optimal effort itself finds, put down as mass: the bound is met, not undercut.
    peak = np.tile([0.25, 0.3, 0.5], (200, 1)) + rng.normal(0.0, 0.02, (200, 3))
    metric = DetectionMetric.of(SEARCH, length_m(peak), length_m(peak) / len(peak))
    assert float(value_of(metric, peak, np.ones(200))) > 0.0


def test_its_gradient_is_that_of_finite_differences() -> None:
    path = rows(6, 300)
    metric = DetectionMetric.of(SEARCH, length_m(path), length_m(path) / len(path))
    rng = np.random.default_rng(0)
    smooth = np.cumsum(rng.normal(0.0, 1.0, path.shape), axis=0)
    along = smooth / np.abs(smooth).max() * np.array([1.0, 1.0, 0.0])

    def figure(step: float) -> float:
        return float(value_of(metric, path + step * along, np.ones(len(path))))

    _, gradient = value_and_slope_of(metric, path, np.ones(len(path)))
    assert float(np.sum(gradient * along)) == pytest.approx((figure(5e-4) - figure(-5e-4)) / 1e-3, rel=0.02)


def test_cells_that_do_not_divide_evenly_lose_nothing() -> None:
    odd = DensityGrid(BOX, np.random.default_rng(0).random((517, 331, 1)))
    metric = DetectionMetric.of(dataclasses.replace(SEARCH, prior=odd), 4000.0, 8.0)
    assert float(metric.probability.sum()) == pytest.approx(1.0, abs=1e-5)
    assert metric.edges_m[0][-1] == pytest.approx(600.0)
    assert metric.edges_m[1][-1] == pytest.approx(400.0)
    assert max(metric.probability.shape) <= 128


def problem(search: Search | None) -> Problem:
    return Problem(
        workspace=BOX,
        information=PRIOR if search is None else search.effort(10.0 * 240.0),
        obstacles=ObstacleField.of([]),
        limits=Limits(10.0, 3.0, 2.0, 3.0),
        start=Motion.at_rest(np.array([20.0, 20.0, 30.0])),
        end_position_m=None,
        duration_s=240.0,
        vehicle_radius_m=0.5,
        clearance_margin_m=1.0,
        search=search,
    )


def stages_of(left: Problem, options: Options) -> list[Stage]:
    """The polish of a replan."""
    segments, per_segment = knots_for(left, options)
    scene = scene_of(left, options, segments, per_segment)
    work = _Work(left, options, scene, segments, lambda _: None, TimeBudget(lambda: np.inf))
    work.warm = True
    return work._stages()


@pytest.fixture(scope="module")
def options() -> Options:
    return Options(candidates=3, modes=(16, 16, 1), seed=0)


def test_a_search_finds_more_than_its_effort_alone_and_far_more_than_rows(options: Options) -> None:
    searching = problem(SEARCH)
    plan = solve(searching, options)
    by_effort = solve(dataclasses.replace(searching, search=None), options)
    judge = Judge(searching, options)
    alone = judge.probability_found(by_effort.best.trajectory.sampled_every(0.2).position_m)
    assert plan.best.probability_found is not None
    assert plan.lawnmower_probability_found is not None
    assert alone is not None
    assert plan.best.probability_found > alone + 0.01
    assert plan.best.probability_found > 1.3 * plan.lawnmower_probability_found
    # The one that finds most is flown, whatever its E.
    assert plan.best.probability_found == max(one.probability_found or 0.0 for one in plan.candidates if one.feasible)
    assert plan.best.objective == pytest.approx(1.0 - plan.best.probability_found)


def test_what_is_left_of_a_search_needs_nothing_compiled(options: Options) -> None:
    whole = problem(SEARCH)
    segments, _ = knots_for(whole, options)
    flown = whole.start.position_m + np.linspace(0.0, 300.0, 200)[:, None] * np.array([1.0, 0.0, 0.0])
    shapes = set()
    for share in (1.0, 0.83, 0.6, 0.45, 0.36):
        left = dataclasses.replace(
            whole, duration_s=share * whole.duration_s, search=SEARCH.after(flown) if share < 1.0 else SEARCH
        )
        # As replans do it: the same knots for what is left.
        asked = dataclasses.replace(options, time_step_s=left.duration_s / (2 * segments))
        (stage,) = stages_of(left, asked)
        shapes.add(str(jax.tree.map(jnp.shape, stage.scene)))
    assert len(shapes) == 1


def test_without_a_search_nothing_is_found_and_the_metric_is_what_counts(options: Options) -> None:
    plan = solve(problem(None), options)
    assert plan.best.probability_found is None
    assert plan.lawnmower_probability_found is None
    assert plan.best.objective == plan.best.ergodic_metric


def test_what_was_searched_in_vain_is_not_searched_again(options: Options) -> None:
    searching = problem(SEARCH)
    first = solve(searching, options).best.trajectory.sampled_every(0.1).position_m
    left = SEARCH.after(first)
    again = left.probability_found(first)
    elsewhere = solve(
        dataclasses.replace(searching, search=left, information=left.effort(searching.reach_m)), options
    ).best
    assert elsewhere.probability_found is not None
    assert elsewhere.probability_found > 1.5 * again


def test_a_level_prior_is_swept_once_all_over() -> None:
    level = Search(uniform(BOX, (60, 40, 1)), 15.0, 1.0)
    effort = level.effort(600.0 * 400.0 / 30.0)
    np.testing.assert_allclose(effort.mass, effort.mass.mean())
