"""How large a pattern is drawn."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.free_space import FreeSpace
from planner.polyline import length_of
from planner.seeds import Pattern, seed_paths, sizing
from planner.seeds.drawing import Drawing
from planner.seeds.pacing import lead_in, reach_m
from tests.planner.worlds import open_box, two_peaks


@settings(deadline=None)
@given(
    factor=st.floats(0.1, 20.0),
    power=st.floats(0.3, 2.0),
    most=st.integers(1, 300),
    begin=st.integers(1, 300),
    reaches=st.lists(st.floats(0.05, 2000.0), min_size=1, max_size=4),
)
def test_of_all_sizes_one_is_drawn_that_nearly_fills_the_reach(factor, power, most, begin, reaches) -> None:
    drawn: list[int] = []

    def make(size: int) -> np.ndarray:
        drawn.append(size)
        return np.array([[float(size), 0.0, 0.0]])

    def length_m(way: np.ndarray) -> float:
        return factor * float(way[0, 0]) ** power

    within = sizing.fitted(make, length_m, most, begin)
    for reach in reaches:
        size = int(within(reach)[0, 0])
        too_long = [one for one in range(1, most + 1) if factor * one**power > reach]
        if 1 in too_long:
            assert size == 1
        else:
            assert factor * size**power <= reach
            assert size == most or size + 1 in too_long or factor * size**power >= sizing.WELL_FITTED * reach
    assert len(drawn) == len(set(drawn))
    assert drawn[0] == min(begin, most)
    # A length that is a power of the size is found at once, but for what rounding makes of small sizes.
    assert len(drawn) <= 5 + 4 * len(reaches)


def test_sizes_whose_lengths_are_in_no_order_are_searched_to_an_end() -> None:
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(0.5, 1.5, 161) * np.arange(161) for _ in range(50)]
    # However large, nearly or exactly as long, or with no length at all.
    alike = [np.full(161, 70.0), 70.0 + 1e-12 * np.arange(161), 70.0 - 1e-12 * np.arange(161), np.zeros(161)]
    for lengths in drawn + alike:
        begin = int(rng.integers(1, 161))
        within = sizing.fitted(
            lambda size: np.full((1, 3), float(size)), lambda way, of=lengths: of[int(way[0, 0])], 160, begin
        )
        for reach in (20.0, 90.0, 60.0, 400.0):
            assert lengths[int(within(reach)[0, 0])] <= max(reach, lengths[1])


@pytest.mark.parametrize("share", [0.3, 0.5, 0.88])
def test_patterns_whose_size_is_chosen_come_close_to_the_reach(share: float) -> None:
    problem = open_box(two_peaks(open_box()), end_position_m=None)
    drawing = Drawing(problem, FreeSpace(problem), lead_in(problem))
    reach = share * reach_m(problem)
    for pattern in (Pattern.TOUR, Pattern.SQUARE, Pattern.RANDOM):
        way = drawing.ways(pattern, 0, np.random.default_rng(1))(reach)
        length = length_of(np.concatenate([problem.start.position_m[None], way]))
        assert 0.85 * reach <= length <= reach, pattern


def test_patterns_are_larger_where_there_is_more_time() -> None:
    short, long = open_box(duration_s=60.0), open_box(duration_s=400.0)
    for one, two in zip(
        seed_paths(short, 7, np.random.default_rng(0)), seed_paths(long, 7, np.random.default_rng(0)), strict=True
    ):
        assert length_of(two.points_m) > 2.0 * length_of(one.points_m), one.pattern
