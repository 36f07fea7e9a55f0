"""Replans: the process beside the flight, and whether what comes back is taken."""

import dataclasses
import time

import numpy as np
import pytest

from mission.executive.course import Course
from mission.executive.phases import Phase
from mission.flying.belief import INTERVAL_S, Belief, after, covered_by, together
from mission.flying.replan_cycle import WARM_UP, ReplanCycle, Schedule, from_moment
from mission.flying.replanning import Replanner, Reply, Request, judge
from mission.flying.ways import along
from planner.diversity import diversity
from planner.gate import prove
from planner.information import uniform
from planner.obstacles import ObstacleField, Sphere
from planner.plan import Candidate, Plan, Status
from planner.problem import Limits, Options, Problem
from planner.trajectory import Motion, Trajectory
from planner.workspace import Workspace
from tests.mission.proven import proven

LIMITS = Limits(5.0, 2.0, 1.5, 3.0)
BOX = Workspace(np.array([0.0, 0.0, 5.0]), np.array([200.0, 100.0, 30.0]))
MODES = (4, 4, 2)
OPTIONS = Options(candidates=2, modes=MODES)
CURVE = proven(along(np.array([[10.0, 50.0, 10.0], [190.0, 50.0, 10.0], [190.0, 90.0, 10.0]]), LIMITS))
PROBLEM = Problem(
    workspace=BOX,
    information=uniform(BOX),
    obstacles=ObstacleField.of([]),
    limits=LIMITS,
    start=Motion.at_rest(np.array([10.0, 50.0, 10.0])),
    end_position_m=None,
    duration_s=CURVE.duration_s,
    vehicle_radius_m=0.5,
    clearance_margin_m=1.0,
)
SWITCH_KNOT = 12
SWITCH_S = SWITCH_KNOT * CURVE.knot_interval_s


def continuing(aside_m=6.0) -> Trajectory:
    """A curve that leaves `CURVE` at the switch, swings up to `aside_m` to the north, and ends where it ends."""
    rest = CURVE.control_points_m[SWITCH_KNOT:].copy()
    straight = rest[3:-24]
    swing = np.sin(np.pi * np.linspace(0.0, 1.0, len(straight))) ** 2
    rest[3:-24, 1] += aside_m * swing
    return Trajectory(rest, CURVE.knot_interval_s)


def farthest_aside(trajectory: Trajectory) -> np.ndarray:
    """The place in the middle of the swing."""
    samples = trajectory.sampled_every(0.1).position_m
    along_east = samples[samples[:, 0] < 180.0]
    return along_east[int(np.argmax(np.abs(along_east[:, 1] - 50.0)))]


def request(**changes) -> Request:
    problem = dataclasses.replace(
        PROBLEM, start=CURVE.motion_at(SWITCH_S), duration_s=CURVE.end_s - SWITCH_S, **changes
    )
    return Request(1, problem, np.empty((0, 3)), OPTIONS, (CURVE,), CURVE, SWITCH_S, 1.0)


def reply(*candidates: tuple[Trajectory, float], staying=0.5, asked=None) -> Reply:
    asked = asked or request()
    made = tuple(
        Candidate(prove(trajectory, asked.problem), "test", metric, metric) for trajectory, metric in candidates
    )
    feasible = [index for index, one in enumerate(made) if one.feasible]
    paths = np.stack([one.trajectory.sample(np.linspace(0.0, 20.0, 50)).position_m for one in made])
    plan = Plan(
        Status.CONVERGED,
        made,
        min(feasible, key=lambda index: made[index].cost) if feasible else None,
        1.0,
        diversity(BOX.unit_from_enu(paths)),
        1,
    )
    return Reply(asked, plan, staying, 0.3)


def course(now_s=0.0) -> Course:
    return Course.begin(CURVE, now_s, 0.0, LIMITS.max_acceleration_mps2, 1.0)


def test_a_better_proven_plan_that_continues_the_course_is_taken_at_its_switch():
    verdict = judge(reply((continuing(), 0.4)), course(), 1.0, PROBLEM, must_leave=False)
    assert verdict.reason == "better"
    assert verdict.trajectory is not None
    assert verdict.trajectory.start_s == SWITCH_S
    course().continued(verdict.trajectory, 1.0)


def test_a_plan_that_is_worse_than_staying_is_not_taken():
    verdict = judge(reply((continuing(), 0.6)), course(), 1.0, PROBLEM, must_leave=False)
    assert verdict.trajectory is None
    assert "staying" in verdict.reason


def test_a_course_that_must_be_left_is_left_for_any_proven_plan():
    assert judge(reply((continuing(), 0.6)), course(), 1.0, PROBLEM, must_leave=True).trajectory is not None


def test_a_plan_whose_switch_lies_behind_came_too_late():
    verdict = judge(reply((continuing(), 0.4)), course(), SWITCH_S + 0.1, PROBLEM, must_leave=False)
    assert verdict.trajectory is None
    assert "too late" in verdict.reason


def test_a_plan_that_begins_elsewhere_is_not_taken():
    other = along(np.array([[60.0, 20.0, 10.0], [150.0, 60.0, 12.0]]), LIMITS)
    asked = request()
    asked = dataclasses.replace(asked, problem=dataclasses.replace(asked.problem, start=other.motion_at(0.0)))
    verdict = judge(reply((other, 0.4), asked=asked), course(), 1.0, PROBLEM, must_leave=False)
    assert verdict.trajectory is None
    assert "does not continue" in verdict.reason


def test_a_plan_that_begins_behind_what_blocks_the_course_is_not_taken():
    known = dataclasses.replace(
        PROBLEM, obstacles=ObstacleField.of([Sphere(CURVE.motion_at(0.6 * SWITCH_S).position_m, 0.2)])
    )
    verdict = judge(reply((continuing(), 0.4)), course(), 0.0, known, must_leave=True)
    assert verdict.trajectory is None
    assert "blocked before it" in verdict.reason


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


def test_what_was_learned_while_it_was_solved_counts_and_the_next_best_is_taken():
    best, second = continuing(8.0), continuing(-8.0)
    known = dataclasses.replace(PROBLEM, obstacles=ObstacleField.of([Sphere(farthest_aside(best), 4.0)]))
    verdict = judge(reply((best, 0.3), (second, 0.4)), course(), 1.0, known, must_leave=False)
    assert verdict.alternative == 1
    assert verdict.trajectory is not None
    assert farthest_aside(verdict.trajectory)[1] < 50.0


def test_where_the_gate_refuses_all_its_reason_is_told():
    known = dataclasses.replace(PROBLEM, obstacles=ObstacleField.of([Sphere(farthest_aside(continuing()), 4.0)]))
    verdict = judge(reply((continuing(), 0.4)), course(), 1.0, known, must_leave=False)
    assert verdict.trajectory is None
    assert "gate" in verdict.reason
    assert "clearance" in verdict.reason


def test_a_solve_that_failed_leaves_the_course_as_it_is():
    verdict = judge(Reply(request(), None, 0.5, 0.1, "diverged"), course(), 1.0, PROBLEM, must_leave=True)
    assert verdict.trajectory is None
    assert verdict.reason == "diverged"


def quick(asked: Request) -> Reply:
    """Stands for the solver in the other process."""
    if asked.time_limit_s < 0.0:
        raise SystemExit(7)
    return Reply(asked, None, 0.5, 0.01, f"asked with {asked.number}")


def wait(replanner: Replanner, seconds=20.0) -> Reply:
    until = time.monotonic() + seconds
    while (answer := replanner.poll()) is None:
        assert time.monotonic() < until
        time.sleep(0.01)
    return answer


def test_the_other_process_answers_and_one_question_at_a_time_is_asked():
    replanner = Replanner(quick)
    try:
        assert replanner.poll() is None
        replanner.ask(dataclasses.replace(request(), number=3))
        assert replanner.busy
        with pytest.raises(ValueError, match="under way"):
            replanner.ask(request())
        assert wait(replanner).failure == "asked with 3"
        assert replanner.warm
        assert not replanner.busy
        assert replanner.lead_host_s() == pytest.approx(0.3 + 1.5 * 0.01)
    finally:
        replanner.close()


def test_a_process_that_dies_is_an_answer_and_not_an_error():
    replanner = Replanner(quick)
    try:
        replanner.ask(dataclasses.replace(request(), time_limit_s=-1.0))
        answer = wait(replanner)
        assert answer.plan is None
        assert "ended" in replanner.lost
    finally:
        replanner.close()


class Garbled:
    """What can be sent and not be read."""

    def __reduce__(self):
        return int, ("no number",)


def garble(asked: Request) -> Reply:
    return Reply(asked, Garbled(), 0.5, 0.01)


def test_an_answer_that_cannot_be_read_is_an_answer_too():
    replanner = Replanner(garble)
    try:
        replanner.ask(dataclasses.replace(request(), number=3))
        assert wait(replanner).plan is None
        assert "cannot be read" in replanner.lost
    finally:
        replanner.close()


def never(asked: Request) -> Reply:
    time.sleep(1000.0)
    raise AssertionError(asked)


def test_a_process_that_hangs_is_ended_and_is_an_answer(monkeypatch):
    replanner = Replanner(never)
    try:
        replanner.ask(dataclasses.replace(request(), number=3))
        assert replanner.poll() is None
        monkeypatch.setattr("mission.flying.replanning.HUNG_HOST_S", 0.1)
        time.sleep(0.2)
        answer = wait(replanner)
        assert answer.plan is None
        assert "has not answered" in answer.failure
        assert "has not answered" in replanner.lost
        assert not replanner.busy
    finally:
        replanner.close()


class Answers:
    """The other process, without one: answers when it is told to."""

    def __init__(self):
        self.asked: list[Request] = []
        self.reply: Reply | None = None
        self.lost, self.warm, self.busy = "", True, False

    def ask(self, asked):
        self.asked.append(asked)
        self.busy = True

    def poll(self):
        answer, self.reply = self.reply, None
        if answer is not None:
            self.busy = False
        return answer

    def lead_host_s(self):
        return 2.0


class Following:
    """What a cycle looks at of an executive."""

    def __init__(self):
        self.course = course()
        self.phase = Phase.FOLLOWING
        self.exploration = CURVE
        self.held_by_block = False
        self.blocked_s = None


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


def test_memory_is_the_mean_over_everything_flown_however_it_was_put_together():
    places = CURVE.sampled_every(INTERVAL_S).position_m
    whole = covered_by(places, len(places) * INTERVAL_S, PROBLEM, MODES)
    half = len(places) // 2
    parts = [covered_by(part, len(part) * INTERVAL_S, PROBLEM, MODES) for part in (places[:half], places[half:])]
    both = together(*parts)
    assert both is not None
    np.testing.assert_array_equal(both.places, whole.places)
    assert both is not None
    assert both.duration_s == pytest.approx(whole.duration_s)
    assert both.mean_basis == pytest.approx(whole.mean_basis)
    assert together(None, whole) is whole


def test_a_belief_counts_a_position_for_each_tenth_of_a_second_and_none_for_pauses():
    belief = Belief(PROBLEM)
    for now in np.arange(0.0, 10.0, 0.033):
        belief.fly((1.0, 2.0, 10.0), float(now))
    for now in np.arange(60.0, 65.0, 0.033):
        belief.fly((3.0, 4.0, 10.0), float(now))
    assert len(belief.flown_m()) == pytest.approx(150, abs=2)


def test_what_was_flown_becomes_what_the_metric_remembers():
    places = CURVE.sampled_every(INTERVAL_S).position_m
    left = after(PROBLEM, places, MODES)
    assert left.covered is not None
    assert left.covered.duration_s == pytest.approx(len(places) * INTERVAL_S)
    assert after(PROBLEM, np.empty((0, 3)), MODES) is PROBLEM
