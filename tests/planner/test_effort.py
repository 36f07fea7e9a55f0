"""Search effort: the optimality conditions of Koopman and Stone, and what a path sweeps."""

import numpy as np
import pytest

from planner.effort import detection_rate, optimal_effort, sweeps_of, unseen
from planner.information import gaussians, uniform
from planner.workspace import Workspace

BOX = Workspace(np.array([0.0, 0.0, 10.0]), np.array([1000.0, 800.0, 50.0]))
PEAKED = gaussians(BOX, np.array([[400.0, 300.0, 30.0]]), np.array([[120.0, 90.0, 40.0]]), np.ones(1), (50, 40, 4))


def sweeps_for(area_m2: float, detection_probability: float) -> np.ndarray:
    effort = optimal_effort(PEAKED, area_m2, detection_probability)
    return effort.mass.sum(axis=2) * area_m2 / (effort.cell_m[0] * effort.cell_m[1])


def found_in_order(sweeps: np.ndarray, detection_probability: float) -> float:
    """By the law of the module: a part of a place once, before any of it twice."""
    rate = detection_rate(detection_probability)
    again = 1.0 - (1.0 - detection_probability) * np.exp(-rate * np.maximum(sweeps - 1.0, 0.0))
    return float((PEAKED.mass.sum(axis=2) * np.where(sweeps < 1.0, detection_probability * sweeps, again)).sum())


@pytest.mark.parametrize("area_m2", [2e5, 2e6])
def test_what_the_next_sweep_finds_is_level_where_a_second_is_spent_and_lower_elsewhere(area_m2: float) -> None:
    rate = detection_rate(0.5)
    sweeps = sweeps_for(area_m2, 0.5)
    gain = PEAKED.mass.sum(axis=2) * 0.5 * rate * np.exp(-rate * (sweeps - 1.0))
    again = sweeps > sweeps[sweeps > 0.0].min() * (1.0 + 1e-3)
    level = gain[again].mean()
    # To the size of a cell: it is swept once or not at all.
    np.testing.assert_allclose(gain[again], level, rtol=2e-3)
    unswept = PEAKED.mass.sum(axis=2)[sweeps == 0.0] * 0.5
    assert (unswept <= level * (1 + 2e-3)).all()


@pytest.mark.parametrize("detection_probability", [0.2, 0.6, 0.9])
def test_no_other_use_of_the_same_area_finds_more(detection_probability: float) -> None:
    area_m2 = 3e5
    best = sweeps_for(area_m2, detection_probability)
    cell_m2 = float(PEAKED.cell_m[0] * PEAKED.cell_m[1])
    rng = np.random.default_rng(0)
    found = found_in_order(best, detection_probability)
    column = PEAKED.mass.sum(axis=2)
    for power in (0.0, 0.5, 1.0, 2.0):
        other = column**power * rng.uniform(0.8, 1.2, size=column.shape)
        other *= area_m2 / cell_m2 / other.sum()
        assert found_in_order(other, detection_probability) < found


def test_a_perfect_sensor_looks_once_at_the_best_area_it_can_sweep() -> None:
    sweeps = sweeps_for(2e5, 1.0)
    column = PEAKED.mass.sum(axis=2)
    assert sweeps[sweeps > 0.0] == pytest.approx(1.0, rel=0.02)
    assert column[sweeps > 0.0].min() >= column[sweeps == 0.0].max()


def test_little_area_goes_to_the_peak_and_a_level_map_gets_level_effort() -> None:
    sweeps = sweeps_for(3e3, 0.5)
    peak = np.unravel_index(PEAKED.mass.sum(axis=2).argmax(), sweeps.shape)
    assert sweeps[peak] == sweeps.max()
    assert (sweeps > 0).mean() < 0.05
    level = optimal_effort(uniform(BOX, (20, 20, 2)), 1e4, 0.9)
    np.testing.assert_allclose(level.mass, level.mass.mean())


def test_a_straight_pass_is_one_sweep_on_the_average_over_its_swath() -> None:
    grid = uniform(BOX, (500, 400, 1))
    path = np.stack([np.arange(0.0, 1000.0, 2.0), np.full(500, 400.0), np.full(500, 30.0)], axis=1)
    sweeps = sweeps_of(grid, path, 50.0)
    middle = sweeps[200:300]
    across = np.abs(grid.centers_m()[0, :, 0, 1] - 400.0) <= 50.0
    assert middle[:, across].mean() == pytest.approx(1.0, rel=0.03)
    assert middle[:, ~across].max() == 0.0


def test_a_gap_in_what_was_flown_has_seen_nothing() -> None:
    grid = uniform(BOX, (100, 80, 1))
    row = np.stack([np.arange(0.0, 300.0, 2.0), np.full(150, 200.0), np.full(150, 30.0)], axis=1)
    shift = np.array([500.0, 300.0, 0.0])
    with_gap = sweeps_of(grid, np.concatenate([row, row + shift]), 50.0)
    apart = sweeps_of(grid, row, 50.0) + sweeps_of(grid, row + shift, 50.0)
    np.testing.assert_allclose(with_gap, apart)


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
