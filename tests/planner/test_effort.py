"""Search effort: the optimality conditions of Koopman and Stone, and what a path sweeps."""

import numpy as np
import pytest

from planner.effort import detection_rate, optimal_effort, probability_found, sweeps_of, unseen
from planner.information import gaussians, uniform
from planner.workspace import Workspace

BOX = Workspace(np.array([0.0, 0.0, 10.0]), np.array([1000.0, 800.0, 50.0]))
PEAKED = gaussians(BOX, np.array([[400.0, 300.0, 30.0]]), np.array([[120.0, 90.0, 40.0]]), np.ones(1), (50, 40, 4))


def sweeps_for(area_m2: float, rate: float) -> np.ndarray:
    effort = optimal_effort(PEAKED, area_m2, rate)
    return effort.mass.sum(axis=2) * area_m2 / (effort.cell_m[0] * effort.cell_m[1])


@pytest.mark.parametrize("area_m2", [2e4, 2e5, 5e6])
def test_what_is_left_is_level_where_effort_is_spent_and_lower_elsewhere(area_m2: float) -> None:
    rate = detection_rate(0.8)
    sweeps = sweeps_for(area_m2, rate)
    left = PEAKED.mass.sum(axis=2) * np.exp(-rate * sweeps)
    spent = sweeps > 1e-9
    level = left[spent].mean()
    np.testing.assert_allclose(left[spent], level, rtol=1e-6)
    assert (left[~spent] <= level * (1 + 1e-9)).all()


def test_no_other_use_of_the_same_area_finds_more() -> None:
    rate, area_m2 = detection_rate(0.9), 3e5
    best = sweeps_for(area_m2, rate)
    cell_m2 = float(PEAKED.cell_m[0] * PEAKED.cell_m[1])
    rng = np.random.default_rng(0)
    found = probability_found(PEAKED, best, rate)
    column = PEAKED.mass.sum(axis=2)
    for power in (0.0, 0.5, 1.0, 2.0):
        other = column**power * rng.uniform(0.8, 1.2, size=column.shape)
        other *= area_m2 / cell_m2 / other.sum()
        assert probability_found(PEAKED, other, rate) < found


def test_little_area_goes_to_the_peak_and_a_level_map_gets_level_effort() -> None:
    sweeps = sweeps_for(3e3, 1.0)
    peak = np.unravel_index(PEAKED.mass.sum(axis=2).argmax(), sweeps.shape)
    assert sweeps[peak] == sweeps.max()
    assert (sweeps > 0).mean() < 0.05
    level = optimal_effort(uniform(BOX, (20, 20, 2)), 1e4, 1.0)
    np.testing.assert_allclose(level.mass, level.mass.mean())


def test_a_straight_pass_is_one_sweep_on_the_average_over_its_swath() -> None:
    grid = uniform(BOX, (500, 400, 1))
    path = np.stack([np.arange(0.0, 1000.0, 2.0), np.full(500, 400.0), np.full(500, 30.0)], axis=1)
    sweeps = sweeps_of(grid, path, 50.0)
    middle = sweeps[200:300]
    across = np.abs(grid.centers_m()[0, :, 0, 1] - 400.0) <= 50.0
    assert middle[:, across].mean() == pytest.approx(1.0, rel=0.03)
    assert middle[:, ~across].max() == 0.0


def test_ground_that_was_searched_becomes_less_probable() -> None:
    sweeps = np.zeros((50, 40))
    sweeps[:25] = 1.0
    after = unseen(PEAKED, sweeps, detection_rate(0.9))
    ratio = after.mass[:25].sum() / after.mass[25:].sum()
    before = PEAKED.mass[:25].sum() / PEAKED.mass[25:].sum()
    assert ratio == pytest.approx(0.1 * before)


def test_a_sensor_that_sees_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="detection_probability"):
        detection_rate(0.0)
