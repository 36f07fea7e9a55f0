"""When a replan is asked for, from where, and with how much time."""

import dataclasses

import numpy as np
import pytest

from mission.executive.phases import Phase
from mission.flying.belief import INTERVAL_S, Belief
from mission.flying.replan_cycle import WARM_UP, ReplanCycle, Schedule, from_moment
from mission.flying.replanning import Reply
from tests.mission.street import (
    CURVE,
    OPTIONS,
    PROBLEM,
    SWITCH_S,
    Answers,
    Following,
    continuing,
    course,
    reply,
    request,
)


@pytest.fixture
def cycle():
    answers = Answers()
    plan = reply((continuing(), 0.4)).plan
    assert plan is not None
    plan = dataclasses.replace(plan, candidates=(dataclasses.replace(plan.candidates[0], trajectory=CURVE),))
    made = ReplanCycle(answers, Belief(PROBLEM), OPTIONS, Schedule(5.0, 1.0), plan)
    return made, answers


def answered(answers, **changes):
    answers.reply = dataclasses.replace(Reply(answers.asked[-1], None, 0.5, 0.3, "nothing"), **changes)


def test_a_blocked_course_is_left_for_any_proven_plan(cycle):
    made, answers = cycle
    made._to_warm.clear()
    executive = Following()
    for blocked_s, taken in ((None, False), (30.0, True)):
        executive.blocked_s = blocked_s
        made.hurry()
        assert made.ask(executive, 0.0, 1.0) is not None
        asked = dataclasses.replace(answers.asked[-1], problem=request().problem, switch_s=SWITCH_S)
        answers.reply = dataclasses.replace(reply((continuing(), 0.6), asked=asked))
        answered_with = made.poll(executive, 1.0)
        assert answered_with is not None
        assert (answered_with[1].trajectory is not None) == taken, answered_with[1].reason


def test_nothing_is_asked_from_behind_what_blocks_the_course(cycle):
    made, _ = cycle
    made._to_warm.clear()
    executive = Following()
    executive.blocked_s = 11.0
    assert made.ask(executive, 10.0, 1.0) is None


def test_before_the_exploration_the_solver_is_warmed_up_and_nothing_is_judged(cycle):
    made, answers = cycle
    executive = Following()
    executive.phase = Phase.TAKING_OFF
    assert made.ask(executive, 0.0, 1.0) is None
    assert [asked.number for asked in answers.asked] == [WARM_UP]
    answered(answers)
    assert made.poll(executive, 0.1) is None


def test_a_replan_takes_over_as_far_ahead_as_solves_take(cycle):
    made, _ = cycle
    made._to_warm.clear()
    asked = made.ask(Following(), 10.0, 1.0)
    assert asked is not None
    assert asked.switch_s == pytest.approx(10.0 + 2.0)
    assert asked.problem.duration_s == pytest.approx(CURVE.end_s - 12.0)
    assert asked.problem.start.position_m == pytest.approx(CURVE.motion_at(12.0).position_m)
    # What lies between now and then is flown by then, and counted.
    assert len(asked.flown_m) == pytest.approx(2.0 / INTERVAL_S, abs=1)


def test_faster_simulation_means_farther_ahead(cycle):
    made, _ = cycle
    made._to_warm.clear()
    asked = made.ask(Following(), 4.0, 10.0)
    assert asked is not None
    assert asked.switch_s == pytest.approx(24.0)


def test_replans_keep_their_period_unless_there_is_hurry(cycle):
    made, answers = cycle
    made._to_warm.clear()
    executive = Following()
    assert made.ask(executive, 5.0, 1.0) is not None
    answered(answers)
    made.poll(executive, 6.0)
    assert made.ask(executive, 7.0, 1.0) is None
    made.hurry()
    assert made.ask(executive, 7.1, 1.0) is not None


def test_nothing_is_asked_while_the_course_brakes_or_is_nearly_over(cycle):
    made, _ = cycle
    made._to_warm.clear()
    executive = Following()
    executive.course = executive.course.braking(5.0)
    assert made.ask(executive, 5.1, 1.0) is None
    executive.course = course()
    assert made.ask(executive, CURVE.end_s - 3.0, 1.0) is None


def test_before_a_block_it_asks_from_where_it_stands_and_gives_up_after_a_while(cycle):
    made, answers = cycle
    made._to_warm.clear()
    executive = Following()
    executive.course = executive.course.braking(10.0)
    executive.phase, executive.held_by_block = Phase.HOLDING, True
    for attempt in range(3):
        assert not made.hopeless
        asked = made.ask(executive, 30.0 + 10.0 * attempt, 1.0)
        assert asked is not None
        assert asked.staying is None
        assert asked.problem.start.position_m == pytest.approx(np.array(executive.course.stop_position()))
        assert not asked.problem.start.velocity_mps.any()
        answered(answers)
        made.poll(executive, 31.0 + 10.0 * attempt)
    assert made.hopeless


def test_before_a_block_without_a_solver_it_is_hopeless_at_once(cycle):
    made, answers = cycle
    assert not made.hopeless
    answers.lost = "the replanning process ended with code 1"
    assert made.hopeless


def test_replans_keep_their_size_so_that_nothing_is_compiled_in_the_air(cycle):
    made, answers = cycle
    made._to_warm.clear()
    sizes = set()
    from planner.scene import knots_for

    for now in (2.0, 8.0, 14.0):
        answers.busy = False
        made.hurry()
        asked = made.ask(Following(), now, 1.0)
        assert asked is not None
        sizes.add(knots_for(asked.problem, asked.options))
    assert len(sizes) == 1


def test_the_rest_of_a_curve_is_the_same_curve():
    rest = from_moment(CURVE, 13.2)
    assert rest.start_s == pytest.approx(13.2, abs=0.5 * CURVE.knot_interval_s + 1e-9)
    for s in (15.0, 20.0, CURVE.end_s):
        assert rest.motion_at(s).position_m == pytest.approx(CURVE.motion_at(s).position_m)
