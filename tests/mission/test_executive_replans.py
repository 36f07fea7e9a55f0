"""New courses, and courses that are blocked."""

import numpy as np
import pytest

from mission.executive.events import NewCourse
from mission.executive.phases import Phase
from mission.flying.ways import along
from planner.trajectory import Trajectory
from tests.mission.proven import proven
from tests.mission.rehearsed_flight import CORNERS, LIMITS, Flight, largest_jump_mps


def test_a_new_course_is_taken_at_its_start_without_a_jump():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    switch_s = course.at(flight.now_s).curve_s + 2.0
    old = flight.executive.exploration
    # The same curve from the switch on, then another end.
    first = int((switch_s - old.start_s) / old.knot_interval_s)
    switch_s = old.start_s + first * old.knot_interval_s
    points = np.vstack([old.control_points_m[first : first + 20], np.tile([40.0, 20.0, 12.0], (3, 1))])
    new = proven(Trajectory(points, old.knot_interval_s, switch_s))
    flight.tell(NewCourse(new))
    assert flight.executive.exploration is new
    flight.run()
    assert flight.phase is Phase.LANDED
    reached = [s.position_enu_m for _, s in flight.setpoints]
    assert min(np.linalg.norm(np.subtract(p, [40.0, 20.0, 12.0])) for p in reached) < 1e-6


def test_new_courses_may_follow_each_other_before_the_first_has_begun():
    flight = Flight().exploring()
    old = flight.executive.exploration
    course = flight.executive.course
    assert course is not None
    here_s = course.at(flight.now_s).curve_s
    for ahead_s in (4.0, 6.0, 8.0, 10.0):
        knot = int((here_s + ahead_s - old.start_s) / old.knot_interval_s)
        start_s = old.start_s + knot * old.knot_interval_s
        flight.tell(NewCourse(proven(Trajectory(old.control_points_m[knot:], old.knot_interval_s, start_s))))
    flight.run()
    assert flight.phase is Phase.LANDED
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_a_new_course_that_comes_too_late_is_dropped():
    flight = Flight().exploring()
    old = flight.executive.exploration
    flight.tell(NewCourse(old.starting_at(0.5)))
    assert flight.executive.exploration is old
    assert flight.run().phase is Phase.LANDED


def test_a_course_that_does_not_continue_the_old_one_is_an_error():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    backwards = proven(along(CORNERS[::-1], LIMITS)).starting_at(course.end_s - 1.0)
    with pytest.raises(ValueError, match="does not continue"):
        flight.tell(NewCourse(backwards))


@pytest.mark.parametrize("slack", [-0.02, 0.02])
def test_the_spare_charge_of_a_curve_tells_whether_its_flight_turns_back(slack):
    def exploring_with(battery):
        flight = Flight()
        flight.vehicle.battery = battery
        flight.exploring()
        executive = flight.executive
        assert executive.course is not None
        here_s = executive.course.at(flight.now_s).curve_s
        return flight, executive.spare_fraction(executive.exploration, here_s, flight.now_s)

    _, spare = exploring_with(0.6)
    flight, left = exploring_with(0.6 - spare + slack)
    assert left == pytest.approx(slack, abs=0.01)
    flight.run()
    assert any("the charge left is less" in text for text in flight.said) is (slack < 0.0)


def test_without_a_charge_or_a_course_nothing_is_known_of_what_is_spare():
    executive = Flight().executive
    assert executive.spare_fraction(executive.exploration, 0.0, 0.0) == float("inf")
