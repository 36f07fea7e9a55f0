"""Paths that follow the information, and the altitudes it has."""

import dataclasses
import itertools

import numpy as np
import pytest

from planner.polyline import length_of
from planner.seeds.altitudes import Altitudes
from planner.seeds.informed import greedy_ridge, peak_m, spread_m, stops, tour
from tests.planner.worlds import open_box, two_peaks


def test_a_tour_is_nearly_the_shortest_of_all() -> None:
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(12):
        start, end, places = rng.uniform(size=3), rng.uniform(size=3), rng.uniform(size=(6, 3))
        found = length_of(tour(start, places, end, 1.0))
        orders = itertools.permutations(range(6))
        best = min(length_of(np.concatenate([start[None], places[list(order)], end[None]])) for order in orders)
        ratios.append(found / best)
    assert max(ratios) < 1.2
    assert np.mean(ratios) < 1.03


def test_a_tour_without_an_end_visits_every_stop_once() -> None:
    rng = np.random.default_rng(1)
    places = rng.uniform(size=(40, 3))
    path = tour(np.zeros(3), places, None, 2.0)
    assert len(path) == 41
    assert {tuple(p) for p in path[1:]} == {tuple(p) for p in places}


def test_stops_stand_for_equal_shares_of_the_information() -> None:
    problem = open_box()
    problem = dataclasses.replace(problem, information=two_peaks(problem))
    places = stops(problem, 60, np.random.default_rng(0))
    near_second = np.linalg.norm(places[:, :2] - [75.0, 20.0], axis=1) < 40.0
    assert near_second.mean() == pytest.approx(2.0 / 3.0, abs=0.05)
    assert np.abs(places[near_second, 2] - 15.0).mean() < 2.0


def test_the_ridge_takes_the_greatest_information_first() -> None:
    problem = open_box()
    problem = dataclasses.replace(problem, information=two_peaks(problem))
    path = greedy_ridge(problem, problem.start.position_m, 150.0, 1.0)
    near = np.minimum(
        np.linalg.norm(path - [25.0, 60.0], axis=1) / 16.0, np.linalg.norm(path - [75.0, 20.0], axis=1) / 20.0
    )
    assert (near[1:] < 1.5).mean() > 0.9
    assert len({tuple(p) for p in path}) == len(path)


def test_peak_and_spread_describe_a_normal_density() -> None:
    from planner.information import gaussians

    problem = open_box()
    grid = gaussians(
        problem.workspace,
        np.array([[60.0, 40.0, 10.0]]),
        np.array([[5.0, 5.0, 50.0]]),
        np.ones(1),
        (100, 80, 2),
    )
    problem = dataclasses.replace(problem, information=grid)
    np.testing.assert_allclose(peak_m(problem), [60.0, 40.0], atol=0.51)
    # Nine tenths of a flat normal density lie within 2.146 standard deviations.
    assert spread_m(problem, np.array([60.0, 40.0])) == pytest.approx(2.146 * 5.0, rel=0.05)


def test_altitudes_are_those_of_the_information() -> None:
    problem = open_box()
    flat = Altitudes(problem)
    assert flat.layered
    np.testing.assert_allclose(flat.levels(2), [5.0, 15.0])
    np.testing.assert_allclose(flat.lifted(np.array([[10.0, 10.0], [90.0, 70.0]]), 0.25)[:, 2], 5.0, atol=1e-6)
    peaked = Altitudes(dataclasses.replace(problem, information=two_peaks(problem)))
    heights = peaked.lifted(np.array([[25.0, 60.0], [75.0, 20.0]]), 0.5)[:, 2]
    np.testing.assert_allclose(heights, [5.0, 15.0], atol=0.7)
