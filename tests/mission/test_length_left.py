"""The length that a mission allows is that of the whole exploration, however often it is replanned or resumed."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mission.executive.phases import Phase
from mission.flying import resuming
from mission.flying.belief import INTERVAL_S, Belief, with_length_left
from mission.flying.flight_folder import FlightFolder
from mission.flying.flight_log import FlightLog
from mission.flying.replan_cycle import ReplanCycle, Schedule
from planner.obstacles import ObstacleField, Sphere
from planner.polyline import length_of
from planner.trajectory import Trajectory
from tests.mission.street import CURVE, OPTIONS, PROBLEM, Answers, Following, continuing, reply


def length_between(begin_s: float, end_s: float, curve: Trajectory = CURVE) -> float:
    return length_of(curve.sample(np.linspace(begin_s, end_s, 5000)).position_m)


def after_flying(until_s: float, max_length_m: float) -> tuple[ReplanCycle, Any]:
    belief = Belief(dataclasses.replace(PROBLEM, max_length_m=max_length_m))
    for now_s in np.arange(0.0, until_s, 0.05):
        belief.fly(tuple(CURVE.motion_at(now_s).position_m.tolist()), float(now_s))
    plan = reply((continuing(), 0.4)).plan
    assert plan is not None
    plan = dataclasses.replace(plan, candidates=(dataclasses.replace(plan.candidates[0], trajectory=CURVE),))
    cycle = ReplanCycle(cast(Any, Answers()), belief, OPTIONS, Schedule(5.0, 1.0), plan)
    cycle._to_warm.clear()
    return cycle, Following()


def test_a_replan_may_be_as_long_as_what_will_be_flown_by_then_leaves():
    cycle, executive = after_flying(20.0, 300.0)
    asked = cycle.ask(executive, 20.0, 1.0)
    assert asked is not None
    total_m = length_between(0.0, asked.switch_s) + asked.problem.max_length_m
    assert total_m == pytest.approx(300.0, abs=1.0)
    assert length_between(0.0, asked.switch_s) > 30.0
    # Asked for again later, it is less: what was flown since counts as well.
    later, _ = after_flying(30.0, 300.0)
    again = later.ask(executive, 30.0, 1.0)
    assert again is not None
    assert again.problem.max_length_m < asked.problem.max_length_m - 20.0


def test_without_any_length_left_nothing_is_asked():
    cycle, executive = after_flying(20.0, length_between(0.0, 21.0))
    assert cycle.ask(executive, 20.0, 1.0) is None


def test_before_a_block_without_any_length_left_it_is_hopeless():
    cycle, executive = after_flying(20.0, length_between(0.0, 19.0))
    executive.course = executive.course.braking(20.0)
    executive.held_by_block = True
    for now_s in (30.0, 30.1, 30.2):
        assert not cycle.hopeless
        assert cycle.ask(executive, now_s, 1.0) is None
    assert cycle.hopeless


def test_without_a_limit_there_is_always_length_left():
    flown = CURVE.sampled_every(INTERVAL_S).position_m
    assert with_length_left(PROBLEM, flown) == PROBLEM
    assert with_length_left(dataclasses.replace(PROBLEM, max_length_m=10.0), flown) is None


def interrupted(at_s: float, max_length_m: float) -> FlightFolder:
    """A flight that was interrupted on its course, before something that was pushed onto the rest of it."""
    time_s = np.arange(0.0, at_s, INTERVAL_S)
    flown = CURVE.sample(time_s)
    none, count = np.zeros(0), len(time_s)
    log = FlightLog(
        header={},
        time_s=time_s,
        position_m=flown.position_m,
        velocity_mps=flown.velocity_mps,
        yaw_rad=np.zeros(count),
        target_m=flown.position_m,
        tilt_mps2=np.full((count, 2), np.nan),
        battery_fraction=np.full(count, np.nan),
        phase=(Phase.FOLLOWING.value,) * count,
        armed=np.ones(count, dtype=bool),
        setpoint_s=none,
        setpoint_curve_s=none,
        setpoint_m=np.zeros((0, 3)),
        events=({"kind": "progress", "t": at_s, "explored_s": at_s},),
        courses=((0.0, CURVE),),
    )
    ahead = CURVE.motion_at(0.5 * (at_s + CURVE.end_s)).position_m
    problem = dataclasses.replace(PROBLEM, max_length_m=max_length_m, obstacles=ObstacleField.of([Sphere(ahead, 2.0)]))
    mission = cast(Any, SimpleNamespace(planner=SimpleNamespace(time_limit_s=1.0)))
    return FlightFolder(Path(), mission, problem, OPTIONS, (), log, None)


def test_a_new_plan_for_the_rest_of_an_interrupted_flight_may_be_as_long_as_what_was_flown_leaves(monkeypatch):
    asked = []

    def solve(problem, *_, **__):
        asked.append(problem)
        raise ValueError("asked")

    monkeypatch.setattr(resuming, "solve", solve)
    monkeypatch.setattr(resuming, "keep_compiled", lambda: None)
    with pytest.raises(ValueError, match="asked"):
        resuming.resumption(interrupted(20.0, 300.0))
    assert length_between(0.0, 20.0) + asked[0].max_length_m == pytest.approx(300.0, abs=1.0)
    with pytest.raises(ValueError, match="is flown already"):
        resuming.resumption(interrupted(20.0, length_between(0.0, 19.0)))


def test_the_rest_of_a_proven_course_needs_no_proof_that_it_is_short_enough(monkeypatch):
    monkeypatch.setattr(resuming, "solve", None)
    flight = interrupted(20.0, length_between(0.0, CURVE.end_s) + 0.1)
    flight = dataclasses.replace(flight, problem=dataclasses.replace(flight.problem, obstacles=PROBLEM.obstacles))
    left = resuming.resumption(flight)
    assert left is not None
    assert left.from_s == pytest.approx(20.0)
