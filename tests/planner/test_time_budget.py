"""Work fitted to the time left, by a clock that the tests turn."""

import itertools
import math

import pytest

from planner.polish import Round
from planner.time_budget import FEWEST_STEPS, FIRST_STEPS, TimeBudget, fitted

PLANNED = (Round(0.01, 100), Round(0.1, 60), Round(1.0, 40))
HURRIED = (Round(0.1, 50), Round(1.0, 50))


class Clock:
    def __init__(self, left_s: float) -> None:
        self.left_s = left_s

    def __call__(self) -> float:
        return self.left_s


def spent(clock: Clock, budget: TimeBudget, step_s: float, share: float = 1.0, hurried=()) -> list[Round]:
    taken = []
    for one in budget.rounds(PLANNED, share, hurried):
        taken.append(one)
        clock.left_s -= step_s * one.steps
    return taken


def stepped(clock: Clock, budget: TimeBudget, step_s: float, steps: int = 60, share: float = 0.25) -> list[int]:
    taken = []
    for portion in budget.portions(steps, 10, share):
        taken.append(portion)
        clock.left_s -= step_s * portion
    return taken


@pytest.mark.parametrize("left_s", [math.inf, 10.0])
def test_with_time_enough_everything_is_done_as_planned(left_s):
    clock = Clock(left_s)
    budget = TimeBudget(clock)
    assert spent(clock, budget, 0.01) == list(PLANNED)
    # Against a clock the first portion is a short one, to learn the pace by.
    assert list(budget.portions(25, 10, 0.25)) == ([10, 10, 5] if left_s == math.inf else [FIRST_STEPS, 10, 10, 3])
    assert not budget.is_over()
    assert not budget.fell_short


def test_rounds_get_shorter_alike_where_time_runs_short_and_the_last_one_is_done():
    clock = Clock(1.5)
    budget = TimeBudget(clock)
    taken = spent(clock, budget, 0.01)
    # The pace is known after the first, and half a second is left for a second of work.
    assert taken == [Round(0.01, 100), Round(0.1, 30), Round(1.0, 20)]
    assert clock.left_s == pytest.approx(0.0, abs=0.01)
    assert budget.fell_short


def test_a_share_of_the_time_and_what_the_gate_needs_stay():
    clock = Clock(2.5)
    budget = TimeBudget(clock)
    budget.reserved_s = 0.4
    spent(clock, budget, 0.01, share=0.8)
    assert clock.left_s == pytest.approx(0.5 + 0.4, abs=0.02)


def test_the_gate_holds_back_no_more_than_half():
    clock = Clock(1.0)
    budget = TimeBudget(clock)
    budget.reserved_s = 5.0
    taken = spent(clock, budget, 0.004)
    assert taken[0] == PLANNED[0]
    assert [one.steps for one in taken[1:]] == pytest.approx([15, 10], abs=1)


def test_with_hardly_any_time_fewer_rounds_do():
    clock = Clock(2.0)
    budget = TimeBudget(clock)
    stepped(clock, budget, 0.02, steps=10, share=1.0)
    # 1.8 s are 90 steps at 20 ms; 200 are planned, and 8 tell the pace.
    taken = spent(clock, budget, 0.02, hurried=HURRIED)
    assert taken == [Round(0.01, FEWEST_STEPS), Round(0.1, 41), Round(1.0, 41)]
    assert budget.fell_short


def test_slow_work_before_hurries_nothing_that_is_quick_itself():
    clock = Clock(2.0)
    budget = TimeBudget(clock)
    stepped(clock, budget, 0.02, steps=10, share=1.0)
    assert spent(clock, budget, 0.001, hurried=HURRIED) == [Round(0.01, FEWEST_STEPS), *PLANNED]
    assert not budget.fell_short


def test_portions_end_with_their_share_and_the_first_is_a_few_steps():
    clock = Clock(4.0)
    budget = TimeBudget(clock)
    # A second is 33 steps.
    assert stepped(clock, budget, 0.03) == [FIRST_STEPS, 10, 10, 10, 1]
    assert budget.fell_short


def test_where_a_few_steps_take_all_the_time_no_more_are_begun():
    clock = Clock(4.0)
    budget = TimeBudget(clock)
    assert stepped(clock, budget, 0.6) == [FIRST_STEPS]


def test_nothing_is_begun_when_it_is_over():
    budget = TimeBudget(Clock(0.0))
    assert list(budget.rounds(PLANNED, 1.0)) == []
    assert list(budget.portions(60, 10, 0.25)) == []
    assert budget.is_over()
    assert budget.fell_short


def test_a_clock_that_is_set_back_does_not_stop_the_work():
    ticks = itertools.chain([1.0, 1.0, 2.0], itertools.repeat(2.0))
    budget = TimeBudget(lambda: next(ticks))
    assert list(budget.rounds(PLANNED, 1.0)) == list(PLANNED)


def test_fitted_rounds_are_never_shorter_than_makes_sense_nor_longer_than_planned():
    assert fitted(PLANNED, 0.0) == [Round(0.01, FEWEST_STEPS), Round(0.1, FEWEST_STEPS), Round(1.0, FEWEST_STEPS)]
    assert fitted(PLANNED, 1e9) == list(PLANNED)
    assert fitted([Round(1.0, 3)], 1.0) == [Round(1.0, 3)]


def test_a_share_is_there_until_it_is_spent():
    clock = Clock(20.0)
    budget = TimeBudget(clock)
    within = budget.within(0.25)
    clock.left_s = 16.0
    assert within()
    assert not budget.fell_short
    clock.left_s = 15.0
    assert not within()
    assert budget.fell_short


def test_without_a_limit_every_share_is_there():
    budget = TimeBudget(Clock(math.inf))
    assert budget.within(0.1)()
    assert not budget.fell_short
