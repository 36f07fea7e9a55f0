"""The polish takes each candidate on its own, on however many cores."""

import numpy as np
import pytest

from planner import polish
from planner.obstacles import ObstacleField, Sphere
from planner.polish import FEWEST_KNOTS_A_PART, Round, polished
from planner.problem import Options
from planner.scene import Scene, scene_of
from tests.planner.worlds import open_box

ROUNDS = (Round(0.1, 3), Round(1.0, 3))
KNOTS = FEWEST_KNOTS_A_PART


def scene_with(knots: int) -> Scene:
    problem = open_box(obstacles=ObstacleField.of([Sphere(np.array([30.0, 40.0, 10.0]), 6.0)]))
    return scene_of(problem, Options(modes=(6, 6, 1)), knots + 2, 2)


def random_set(count: int, knots: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(0.2, 0.8, (count, knots, 3)).astype(np.float32)


@pytest.mark.parametrize(("count", "cores"), [(5, 2), (3, 8)])
def test_candidates_end_where_they_end_on_one_core(count: int, cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, particles = scene_with(KNOTS), random_set(count, KNOTS)
    lowest: dict[int, list[float]] = {1: [], cores: []}
    found = {}
    for number, told in lowest.items():
        monkeypatch.setattr(polish, "cores", lambda number=number: number)
        found[number], steps = polished(scene, particles, ROUNDS, told.append)
        assert steps == sum(one.steps for one in ROUNDS)
    assert found[cores].shape == particles.shape
    np.testing.assert_allclose(found[cores], found[1], atol=1e-3)
    np.testing.assert_allclose(lowest[cores], lowest[1], rtol=1e-2)
    assert np.abs(found[1] - particles).max() > 0.01


def test_a_candidate_without_numbers_is_no_bad_company(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, particles = scene_with(KNOTS), random_set(5, KNOTS)
    monkeypatch.setattr(polish, "cores", lambda: 2)
    sound, _ = polished(scene, particles, ROUNDS, lambda _: None)
    lowest: list[float] = []
    found, _ = polished(scene, np.where(np.arange(5)[:, None, None] == 1, np.nan, particles), ROUNDS, lowest.append)
    np.testing.assert_array_equal(found[[0, 2, 3, 4]], sound[[0, 2, 3, 4]])
    assert np.isfinite(lowest).all()


@pytest.mark.parametrize(
    ("cores", "count", "knots", "width"),
    [
        (1, 6, KNOTS, 6),
        (2, 6, KNOTS, 3),
        (2, 1, 2 * KNOTS, 1),
        (8, 3, KNOTS, 1),
        (8, 6, KNOTS // 2, 2),
        (2, 3, KNOTS // 2, 3),
    ],
)
def test_a_part_is_worth_a_thread(
    cores: int, count: int, knots: int, width: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    shapes = []

    def begun(_: Scene, particles: np.ndarray) -> None:
        shapes.append(particles.shape)
        raise InterruptedError

    monkeypatch.setattr(polish, "cores", lambda: cores)
    monkeypatch.setattr(polish, "_begin", begun)
    with pytest.raises(InterruptedError):
        polished(scene_with(knots), random_set(count, knots), ROUNDS, lambda _: None)
    assert set(shapes) == {(width, knots, 3)}
