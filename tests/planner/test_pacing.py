"""How far a vehicle gets on a path, and where it is when."""

import dataclasses

import numpy as np
import pytest

from planner.free_space import FreeSpace
from planner.polyline import cut_at, densified, length_of
from planner.seeds import pacing
from planner.seeds.pacing import lead_in, led_to_the_end, paced, reach_m
from planner.trajectory import Motion
from tests.planner.worlds import open_box


def test_the_reach_is_that_of_the_vehicle() -> None:
    at_rest = open_box()
    cruise, change = 0.92 * 5.0, 0.5 * 3.0
    assert reach_m(at_rest) == pytest.approx(cruise * 200.0 - cruise**2 / change, rel=1e-3)
    moving = dataclasses.replace(at_rest, start=Motion(np.full(3, 9.0), np.array([cruise, 0, 0]), np.zeros(3)))
    assert reach_m(moving) == pytest.approx(cruise * 200.0 - cruise**2 / (2.0 * change), rel=1e-3)
    # In two seconds there is no cruise: up and down again.
    assert reach_m(at_rest, 2.0) == pytest.approx(change, rel=1e-3)


@pytest.mark.parametrize("length", [0.0, 1e-6, 0.5, 20.0, 60.0])
def test_a_path_shorter_than_the_reach_takes_all_of_the_time(length: float) -> None:
    problem = open_box(duration_s=60.0)
    begin = problem.start.position_m
    end = begin + np.array([length, 0.0, 0.0])
    positions, excess = paced(np.stack([begin, end]), problem, FreeSpace(problem), 601)
    assert excess < 1.0
    # Up to a cruise and down again with half of 3 m/s²: L = vT − v²/a.
    change = 0.5 * 3.0
    cruise = 0.5 * (60.0 * change - np.sqrt((60.0 * change) ** 2 - 4.0 * change * length))
    assert length_of(positions[250:351]) == pytest.approx(10.0 * cruise, rel=5e-3, abs=1e-9)
    np.testing.assert_allclose(positions[-1], end, atol=1e-9)


def test_a_vehicle_in_motion_is_carried_on_before_it_turns() -> None:
    start = Motion(np.array([50.0, 40.0, 10.0]), np.array([4.0, 0.0, 0.0]), np.zeros(3))
    carried = lead_in(open_box(start=start))
    np.testing.assert_allclose(carried[0], start.position_m)
    # Braking from 4 m/s with half of 3 m/s² takes 5.3 m.
    assert 5.0 < carried[1, 0] - 50.0 < 6.5
    assert len(lead_in(open_box())) == 1


@pytest.mark.parametrize("end", [None, np.array([5.0, 6.0, 10.0])])
def test_of_a_pattern_far_larger_than_the_reach_only_what_is_within_reach_is_looked_at(monkeypatch, end) -> None:
    sizes = []

    def counted(points_m: np.ndarray, spacing_m: float) -> np.ndarray:
        dense = densified(points_m, spacing_m)
        sizes.append(len(dense))
        return dense

    monkeypatch.setattr(pacing, "densified", counted)
    problem = open_box(end_position_m=end)
    rows = np.array([[5.0, 5.0, 10.0], [95.0, 5.0, 10.0], [95.0, 75.0, 10.0], [5.0, 75.0, 10.0]])
    path = led_to_the_end(rows, problem, FreeSpace(problem), 2.5)
    assert max(sizes) < 1100
    assert length_of(path) <= 2.5 * 1.01
    assert np.linalg.norm(path[-1] - path[0]) == pytest.approx(2.5 if end is None else 1.0, rel=0.01)


def test_a_polyline_is_cut_at_a_length() -> None:
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])
    legs = np.array([3.0, 4.0])
    np.testing.assert_allclose(cut_at(corners, legs, 5.0), [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]])
    np.testing.assert_allclose(cut_at(corners, legs, 1.0), [[0.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(cut_at(corners, legs, 3.0), corners[:2])
    np.testing.assert_allclose(cut_at(corners, legs, 9.0), corners)
