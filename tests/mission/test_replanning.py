"""Whether what comes back from the solver is taken."""

import dataclasses

import numpy as np

from mission.flying.replanning import Reply, judge
from mission.flying.ways import along
from planner.obstacles import ObstacleField, Sphere
from tests.mission.street import CURVE, LIMITS, PROBLEM, SWITCH_S, continuing, course, farthest_aside, reply, request


def plenty(curve, from_s):
    return 0.5


def test_a_better_proven_plan_that_continues_the_course_is_taken_at_its_switch():
    verdict = judge(reply((continuing(), 0.4)), course(), 1.0, PROBLEM, plenty, must_leave=False)
    assert verdict.reason == "better"
    assert verdict.trajectory is not None
    assert verdict.trajectory.start_s == SWITCH_S
    course().continued(verdict.trajectory, 1.0)


def test_a_plan_that_is_worse_than_staying_is_not_taken():
    verdict = judge(reply((continuing(), 0.6)), course(), 1.0, PROBLEM, plenty, must_leave=False)
    assert verdict.trajectory is None
    assert "staying" in verdict.reason


def test_a_course_that_must_be_left_is_left_for_any_proven_plan():
    assert judge(reply((continuing(), 0.6)), course(), 1.0, PROBLEM, plenty, must_leave=True).trajectory is not None


def test_a_plan_whose_switch_lies_behind_came_too_late():
    verdict = judge(reply((continuing(), 0.4)), course(), SWITCH_S + 0.1, PROBLEM, plenty, must_leave=False)
    assert verdict.trajectory is None
    assert "too late" in verdict.reason


def test_a_plan_that_begins_elsewhere_is_not_taken():
    other = along(np.array([[60.0, 20.0, 10.0], [150.0, 60.0, 12.0]]), LIMITS)
    asked = request()
    asked = dataclasses.replace(asked, problem=dataclasses.replace(asked.problem, start=other.motion_at(0.0)))
    verdict = judge(reply((other, 0.4), asked=asked), course(), 1.0, PROBLEM, plenty, must_leave=False)
    assert verdict.trajectory is None
    assert "does not continue" in verdict.reason


def test_a_plan_that_begins_behind_what_blocks_the_course_is_not_taken():
    known = dataclasses.replace(
        PROBLEM, obstacles=ObstacleField.of([Sphere(CURVE.motion_at(0.6 * SWITCH_S).position_m, 0.2)])
    )
    verdict = judge(reply((continuing(), 0.4)), course(), 0.0, known, plenty, must_leave=True)
    assert verdict.trajectory is None
    assert "blocked before it" in verdict.reason


def test_what_was_learned_while_it_was_solved_counts_and_the_next_best_is_taken():
    best, second = continuing(8.0), continuing(-8.0)
    known = dataclasses.replace(PROBLEM, obstacles=ObstacleField.of([Sphere(farthest_aside(best), 4.0)]))
    verdict = judge(reply((best, 0.3), (second, 0.4)), course(), 1.0, known, plenty, must_leave=False)
    assert verdict.alternative == 1
    assert verdict.trajectory is not None
    assert farthest_aside(verdict.trajectory)[1] < 50.0


def test_where_the_gate_refuses_all_its_reason_is_told():
    known = dataclasses.replace(PROBLEM, obstacles=ObstacleField.of([Sphere(farthest_aside(continuing()), 4.0)]))
    verdict = judge(reply((continuing(), 0.4)), course(), 1.0, known, plenty, must_leave=False)
    assert verdict.trajectory is None
    assert "gate" in verdict.reason
    assert "clearance" in verdict.reason


def test_a_solve_that_failed_leaves_the_course_as_it_is():
    verdict = judge(Reply(request(), None, 0.5, 0.1, "diverged"), course(), 1.0, PROBLEM, plenty, must_leave=True)
    assert verdict.trajectory is None
    assert verdict.reason == "diverged"


def test_a_plan_that_the_charge_would_not_last_for_is_not_taken_and_the_next_best_is():
    best, second = continuing(8.0), continuing(-8.0)

    def spare(curve, from_s):
        assert from_s == SWITCH_S
        return 0.005 if farthest_aside(curve)[1] > 52.0 else 0.5

    offered = reply((best, 0.3), (second, 0.4))
    assert judge(offered, course(), 1.0, PROBLEM, spare, must_leave=False).alternative == 1
    verdict = judge(reply((best, 0.3)), course(), 1.0, PROBLEM, spare, must_leave=False)
    assert verdict.trajectory is None
    assert "charge would not last" in verdict.reason
    # From what blocks the way any proven plan leads on, as far as it goes.
    assert judge(reply((best, 0.3)), course(), 1.0, PROBLEM, spare, must_leave=True).trajectory is not None


def test_where_the_charge_does_not_last_for_the_course_itself_no_more_is_asked_of_a_plan():
    for of_plan, taken in ((-0.06, False), (-0.05, True), (-0.03, True)):

        def spare(curve, from_s, of_plan=of_plan):
            return -0.05 if curve is CURVE else of_plan

        verdict = judge(reply((continuing(), 0.4)), course(), 1.0, PROBLEM, spare, must_leave=False)
        assert (verdict.trajectory is not None) == taken
