"""After a silence the vehicle is met where it is, and never sent after a course that went on without it."""

import numpy as np
import pytest

from benchmarks.faults.pillar import problem
from benchmarks.faults.rehearsal import Rehearsal
from mission.executive.course import Course
from mission.executive.phases import STREAMING, Phase
from mission.flying.ways import along
from planner.problem import Limits
from sim_bridge.dialects import Autopilot
from sim_bridge.faults import LinkCut
from tests.mission.proven import proven

LIMITS = Limits(5.0, 3.0, 3.0, 2.0, 1.0)
LINE = proven(along(np.array([[0.0, 0.0, 10.0], [100.0, 0.0, 10.0]]), LIMITS))


def flowing(now_s: float = 0.0) -> Course:
    return Course.begin(LINE, now_s, 0.0, 2.0, 1.0)


def fastest_mps(autopilot: Autopilot, cut_s: float, phases: set[Phase] | None = None) -> float:
    fastest = 0.0

    def watch(flight: Rehearsal) -> None:
        nonlocal fastest
        state, phase = flight.executive.state, flight.executive.phase
        if phases is not None:
            phases.add(phase)
        if state is not None and phase in (*STREAMING, Phase.BLIND):
            fastest = max(fastest, float(np.linalg.norm(state.velocity_enu_mps)))

    flown = Rehearsal(autopilot, (LinkCut(begin_s=43.0, duration_s=cut_s),), seed=1).fly(watch)
    assert flown.ended is Phase.LANDED
    assert not flown.faults
    return fastest


@pytest.mark.parametrize("autopilot", Autopilot, ids=lambda one: one.name.lower())
@pytest.mark.parametrize("cut_s", [0.8, 1.2, 6.0])
def test_no_cut_link_makes_the_vehicle_faster_than_the_mission_allows(autopilot, cut_s):
    # What plans leave as a reserve is there for catching up.
    allowed = problem().limits.max_speed_mps / 0.94
    assert fastest_mps(autopilot, cut_s) < allowed


def test_a_short_failsafe_of_the_autopilot_does_not_end_the_mission():
    seen: set[Phase] = set()
    fastest_mps(Autopilot.PX4, 1.05, seen)
    assert Phase.OVERRIDDEN not in seen
    assert Phase.FOLLOWING in seen


def test_the_nearest_moment_of_a_stretch_is_found_and_how_far_it_is():
    course = flowing()
    moment_s, apart_m = course.nearest(course.motion_at(8.0).position_m + np.array([0.0, 3.0, 0.0]), 2.0, 12.0)
    assert moment_s == pytest.approx(8.0, abs=0.06)
    assert apart_m == pytest.approx(3.0, abs=0.05)


def test_the_nearest_moment_never_lies_before_the_course():
    course = flowing()
    assert course.nearest(np.array([-50.0, 0.0, 10.0]), -30.0, 3.0)[0] == LINE.start_s


@pytest.mark.parametrize(("speed_mps", "rate"), [(0.0, 0.0), (2.0, 0.42), (40.0, 1.0), (-3.0, 0.0)])
def test_a_course_is_taken_up_at_the_pace_of_the_vehicle(speed_mps, rate):
    course = flowing().taken_up(10.0, np.array([speed_mps, 0.0, 0.0]), 20.0)
    assert course.at(20.0).curve_s == 10.0
    assert course.at(20.0).rate == pytest.approx(rate, abs=0.02)
    assert course.resuming(20.0).at(40.0).rate == 1.0


def test_after_a_lost_link_the_exploration_goes_on_where_the_vehicle_was_heard_last():
    began, ended = [], []

    def watch(flight: Rehearsal) -> None:
        course = flight.executive.course
        if course is None:
            return
        if flight.executive.phase is Phase.FOLLOWING and flight.now_s < 43.0:
            began[:] = [course.at(flight.now_s).curve_s]
        if flight.executive.phase is Phase.TRANSIT and flight.now_s > 43.0:
            ended[:] = [flight.executive.explored_s(flight.now_s)]

    Rehearsal(Autopilot.PX4, (LinkCut(begin_s=43.0, duration_s=4.0),), seed=1).fly(watch)
    assert ended[0] == pytest.approx(began[0], abs=0.5)
