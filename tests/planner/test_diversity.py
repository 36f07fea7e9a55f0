"""Diversity against recursion, closed forms and the properties its numbers promise."""

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.diversity import (
    FRECHET_BANDWIDTH_UNIT2,
    TIME_BANDWIDTH_UNIT2,
    Diversity,
    diversity,
    frechet_distances,
)


def straight(offset: float, samples: int = 20) -> np.ndarray:
    """A path along the first axis, moved by an offset along the second."""
    along = np.linspace(0.0, 1.0, samples)
    return np.stack([along, np.full(samples, offset), np.zeros(samples)], axis=-1)


def recursive_frechet(one: np.ndarray, other: np.ndarray) -> float:
    """Eiter & Mannila's recursion, word for word."""

    @functools.cache
    def coupling(i: int, j: int) -> float:
        gap = float(np.linalg.norm(one[i] - other[j]))
        if i == 0 and j == 0:
            return gap
        if i == 0:
            return max(coupling(0, j - 1), gap)
        if j == 0:
            return max(coupling(i - 1, 0), gap)
        return max(min(coupling(i - 1, j), coupling(i - 1, j - 1), coupling(i, j - 1)), gap)

    return coupling(len(one) - 1, len(other) - 1)


def test_the_frechet_distance_equals_the_recursion() -> None:
    paths = np.random.default_rng(0).uniform(size=(4, 13, 3))
    found = frechet_distances(paths)
    for i in range(4):
        for j in range(4):
            assert found[i, j] == pytest.approx(recursive_frechet(paths[i], paths[j]), abs=1e-14)


def test_two_parallel_paths_have_the_closed_form() -> None:
    offset = 0.2
    measured = diversity(np.stack([straight(0.0), straight(offset)]))
    assert measured.mean_pair_distance == pytest.approx(offset)
    assert measured.determinant == pytest.approx(1.0 - np.exp(-2.0 * offset**2 / TIME_BANDWIDTH_UNIT2))
    alike = np.exp(-(offset**2) / FRECHET_BANDWIDTH_UNIT2)
    assert measured.frechet == pytest.approx(-np.log(alike**2))
    share = np.array([1.0 + alike, 1.0 - alike]) / 2.0
    assert measured.effective_plans == pytest.approx(np.exp(-(share * np.log(share)).sum()))


def test_one_path_has_no_diversity_and_is_one_plan() -> None:
    assert diversity(straight(0.0)[None]) == Diversity(0.0, 0.0, 0.0, 1.0)


def test_copies_are_one_plan_and_far_paths_are_as_many_as_there_are() -> None:
    copies = diversity(np.stack([straight(0.3)] * 5))
    assert copies.determinant == pytest.approx(0.0, abs=1e-12)
    assert copies.frechet == pytest.approx(0.0, abs=1e-12)
    assert copies.effective_plans == pytest.approx(1.0)
    far = diversity(np.stack([straight(10.0 * index) for index in range(5)]))
    assert far.determinant == pytest.approx(1.0)
    assert far.effective_plans == pytest.approx(5.0)
    assert np.isfinite(far.frechet)
    assert far.frechet > 30.0


def test_paths_that_cover_a_square_independently_of_each_other_count_as_different() -> None:
    unrelated = np.random.default_rng(3).uniform(size=(20, 400, 2))
    measured = diversity(np.concatenate([unrelated, np.full((20, 400, 1), 0.5)], axis=-1))
    assert 0.998 < measured.determinant < 1.0


def test_another_pace_is_another_motion_but_the_same_plan() -> None:
    steady = straight(0.0, 200)
    late = steady.copy()
    late[:, 0] = late[:, 0] ** 3
    measured = diversity(np.stack([steady, late]))
    assert measured.mean_pair_distance > 0.2
    assert measured.effective_plans == pytest.approx(1.0, abs=0.05)


def test_the_way_back_is_another_plan() -> None:
    there = straight(0.0)
    assert diversity(np.stack([there, there[::-1]])).effective_plans > 1.99


def test_long_paths_are_thinned_without_losing_the_distance() -> None:
    time = np.linspace(0.0, 1.0, 3000)
    wave = np.stack([time, 0.5 + 0.3 * np.sin(7.0 * time), np.zeros_like(time)], axis=-1)
    moved = wave + np.array([0.0, 0.0, 0.25])
    assert frechet_distances(np.stack([wave, moved]))[0, 1] == pytest.approx(0.25, abs=1e-12)


def test_many_paths_are_thinned_more_and_come_to_the_same_within_a_step() -> None:
    rng = np.random.default_rng(5)
    time = np.linspace(0.0, 1.0, 600)
    phase, height = rng.uniform(0.0, 6.0, (70, 1)), rng.uniform(0.2, 0.8, (70, 1))
    paths = np.stack([time + 0.0 * phase, 0.5 + 0.3 * np.sin(7.0 * time + phase), height + 0.0 * time], axis=-1)
    thin, fine = frechet_distances(paths)[:10, :10], frechet_distances(paths[:10])
    np.testing.assert_allclose(thin, fine, atol=0.05)


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 6), st.integers(1, 9), st.integers(0, 10_000))
def test_every_measure_is_finite_and_in_its_range(count: int, samples: int, seed: int) -> None:
    paths = np.random.default_rng(seed).uniform(size=(count, samples, 3))
    measured = diversity(paths)
    assert 0.0 <= measured.determinant <= 1.0 + 1e-12
    assert 0.0 <= measured.frechet < 37.0
    assert 1.0 - 1e-9 <= measured.effective_plans <= count + 1e-9
    assert measured.mean_pair_distance > 0.0
    shuffled = diversity(paths[np.random.default_rng(0).permutation(count)])
    assert shuffled.effective_plans == pytest.approx(measured.effective_plans)


@pytest.mark.parametrize("paths", [np.zeros((3, 4)), np.zeros((0, 4, 3)), np.full((2, 4, 3), np.nan)])
def test_what_is_not_a_set_of_paths_is_refused(paths: np.ndarray) -> None:
    with pytest.raises(ValueError, match="diversity needs"):
        diversity(paths)
