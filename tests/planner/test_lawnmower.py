"""The baseline: known figures on the unit square, its length, and that nothing in its own family beats it."""

import dataclasses

import numpy as np
import pytest

from planner.information import gaussians, uniform
from planner.lawnmower import Lawnmowers
from planner.obstacles import ObstacleField
from planner.polyline import at_lengths, length_of
from planner.problem import MetricWeights, Problem
from planner.seeds.patterns import Region, layered_rows
from planner.spectral_metric import mean_basis, mode_weights
from planner.trajectory import Motion
from planner.workspace import Workspace
from tests.planner.worlds import open_box, trees

MODES = (8, 8, 1)


def metric_of(problem: Problem, modes=MODES, weights=MetricWeights.LINEAR):
    target, share = problem.information.coefficients(modes), mode_weights(modes, weights)

    def metric(points_m: np.ndarray) -> float:
        unit = problem.workspace.unit_from_enu(points_m)
        mean = mean_basis(unit, np.full(len(unit), 1.0 / len(unit)), modes)
        return float(np.sum(share * (mean - target) ** 2))

    return metric


@pytest.fixture(scope="module")
def square() -> Problem:
    workspace = Workspace(np.zeros(3), np.ones(3))
    centre = Motion.at_rest(np.full(3, 0.5))
    return open_box(uniform(workspace, (64, 64, 1)), workspace=workspace, start=centre, end_position_m=None)


@pytest.mark.parametrize(
    ("rows", "linear", "squared"), [(5, 0.0126, 0.0025), (6, 0.0056, 0.0010), (8, 0.00067, 0.00013)]
)
def test_the_pattern_has_the_published_figures_at_a_hundred_moments(square, rows, linear, squared) -> None:
    path = layered_rows(Region(square), 0.0, rows, [0.5])
    legs = np.linalg.norm(np.diff(path, axis=0), axis=1)
    moments = at_lengths(path, legs, np.linspace(0.0, legs.sum(), 100))
    assert metric_of(square)(moments) == pytest.approx(linear, rel=0.02)
    assert metric_of(square, weights=MetricWeights.SQUARED)(moments) == pytest.approx(squared, rel=0.02)


@pytest.mark.parametrize(("rows", "length_m"), [(4, 3.75), (5, 4.8), (6, 5.8333), (8, 7.875)])
def test_on_a_uniform_square_it_is_no_worse_than_the_pattern_of_that_length(square, rows, length_m) -> None:
    metric = metric_of(square)
    best, points = Lawnmowers(square, length_m).best(metric)
    path = layered_rows(Region(square), 0.0, rows, [0.5])
    legs = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert best <= metric(at_lengths(path, legs, (np.arange(1000) + 0.5) / 1000 * legs.sum())) * (1.0 + 1e-3)
    assert best == pytest.approx(metric(points))


@pytest.mark.parametrize("length_m", [20.0, 300.0, 1100.0])
def test_it_has_the_length_asked_for(length_m: float) -> None:
    problem = open_box()
    _, points = Lawnmowers(problem, length_m).best(metric_of(problem, (8, 8, 4)))
    # Positions at equal times cut the corners between them.
    assert 0.96 * length_m <= length_of(points) <= length_m * (1.0 + 1e-9)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert np.median(steps) == pytest.approx(length_m / len(points), rel=1e-3)


def test_among_trees_it_flies_around_them_and_keeps_its_length() -> None:
    problem = open_box(obstacles=ObstacleField.of(trees(np.random.default_rng(0), 14)))
    metric = metric_of(problem, (8, 8, 4))
    figure, points = Lawnmowers(problem, 900.0).best(metric)
    clearance = problem.obstacles.distance(points) - problem.keep_out_m
    assert (clearance < -0.2).mean() < 0.01
    assert 0.95 * 900.0 <= length_of(points) <= 900.0 * (1.0 + 1e-9)
    assert figure == pytest.approx(metric(points))


def test_more_length_covers_better() -> None:
    problem = open_box()
    metric = metric_of(problem)
    figures = [Lawnmowers(problem, length).best(metric)[0] for length in (150.0, 300.0, 600.0, 1200.0)]
    assert (np.diff(figures) < 0.0).all()


def test_it_takes_the_heading_and_the_layers_that_suit_the_information() -> None:
    problem = open_box()
    # A ridge of information along north, at one height.
    grid = gaussians(
        problem.workspace, np.array([[50.0, 40.0, 4.0]]), np.array([[4.0, 60.0, 2.0]]), np.ones(1), (64, 16, 16)
    )
    problem = dataclasses.replace(problem, information=grid)
    figure, points = Lawnmowers(problem, 80.0).best(metric_of(problem, (8, 8, 4)))
    assert points[:, 2].mean() == pytest.approx(4.0, abs=1.0)
    assert np.ptp(points[:, 0]) < 1.0
    assert np.ptp(points[:, 1]) > 60.0
    assert figure < metric_of(problem, (8, 8, 4))(np.tile(problem.start.position_m, (10, 1)))


def test_a_lawnmower_of_no_length_is_refused() -> None:
    with pytest.raises(ValueError, match="needs a length"):
        Lawnmowers(open_box(), 0.0).best(lambda _: 0.0)
