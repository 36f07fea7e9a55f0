"""Courses: pace, braking, splicing; against finite differences of the setpoints that go out."""

import numpy as np
import pytest

from mission.executive.course import Course, heading_along
from mission.flying.ways import along
from planner.problem import Limits
from planner.trajectory import Trajectory
from tests.mission.proven import proven

LIMITS = Limits(6.0, 3.0, 1.5, 3.0)
CORNERS = np.array([[0.0, 0.0, 10.0], [80.0, 0.0, 20.0], [80.0, 60.0, 20.0]])


def course(now_s: float = 100.0) -> Course:
    return Course.begin(proven(along(CORNERS, LIMITS)), now_s, 0.3, LIMITS.max_acceleration_mps2, 0.8)


def positions(flown: Course, time_s: np.ndarray) -> np.ndarray:
    return np.stack([flown.at(now).motion.position_m for now in time_s])


def test_at_full_pace_the_course_is_the_curve():
    flown = course()
    trajectory = flown.trajectory
    for elapsed in (0.0, 3.3, 12.0, trajectory.duration_s):
        assert flown.at(100.0 + elapsed).motion.position_m == pytest.approx(
            trajectory.motion_at(trajectory.start_s + elapsed).position_m
        )


@pytest.mark.parametrize("change", ["braking", "resuming"])
def test_velocity_and_acceleration_are_the_derivatives_of_the_position_while_the_pace_changes(change):
    flown, begin = course().braking(105.0), 105.0
    if change == "resuming":
        flown, begin = flown.resuming(112.0), 112.0
    step = 1e-4
    for now in np.arange(begin + 0.05, begin + 10.0, 0.37):
        before, here, after = (flown.at(now + d).motion for d in (-step, 0.0, step))
        velocity = (after.position_m - before.position_m) / (2.0 * step)
        assert here.velocity_mps == pytest.approx(velocity, abs=1e-3)
        acceleration = (after.velocity_mps - before.velocity_mps) / (2.0 * step)
        assert here.acceleration_mps2 == pytest.approx(acceleration, abs=2e-2)


def test_braking_stays_on_the_curve_and_ends_where_it_says():
    flown = course().braking(107.0)
    path = along(CORNERS, LIMITS).sampled_every(0.01).position_m
    for position in positions(flown, np.arange(107.0, 125.0, 0.5)):
        assert np.linalg.norm(path - position, axis=1).min() < 0.05
    assert flown.stands(125.0)
    assert flown.at(125.0).motion.position_m == pytest.approx(np.array(flown.stop_position()))
    assert not flown.at(125.0).motion.velocity_mps.any()


def test_braking_takes_no_more_than_its_share_of_the_acceleration_on_a_straight():
    flown = course().braking(107.0)
    straight = proven(Trajectory(np.outer(np.minimum(np.arange(40.0), 37.0), [5.0, 0.0, 0.0]), 1.0))
    flown = Course.begin(straight, 0.0, 0.0, 3.0, 0.8)
    moving = flown.at(5.0)
    assert np.linalg.norm(moving.motion.velocity_mps) == pytest.approx(5.0)
    braked = flown.braking(5.0)
    hardest = max(np.linalg.norm(braked.at(now).motion.acceleration_mps2) for now in np.arange(5.0, 9.0, 0.05))
    assert hardest <= 0.6 * 3.0 + 1e-9


def test_stopping_and_going_on_again_and_again_loses_nothing():
    flown, now = course(), 100.0
    for _ in range(5):
        now += 2.5
        flown = flown.braking(now)
        now += 4.0
        place = flown.at(now).motion.position_m
        flown = flown.resuming(now)
        assert flown.at(now).motion.position_m == pytest.approx(place)
    assert flown.at(now + 100.0).motion.position_m == pytest.approx(CORNERS[-1])


def test_a_course_that_begins_inside_a_moving_curve_begins_at_rest():
    trajectory = proven(along(CORNERS, LIMITS))
    flown = Course.begin(trajectory, 0.0, 0.0, 3.0, 0.8, from_s=6.0)
    assert flown.at(0.0).motion.position_m == pytest.approx(trajectory.motion_at(6.0).position_m)
    assert np.linalg.norm(flown.at(0.0).motion.velocity_mps) < 1e-9
    assert flown.at(30.0).rate == 1.0


def test_the_nose_turns_no_faster_than_it_can_and_ends_along_the_path():
    trajectory = along(CORNERS, LIMITS)
    heading = heading_along(trajectory, -2.0, 0.5)
    yaw = np.array([heading.at(s) for s in np.arange(0.0, trajectory.end_s, 0.1)])
    assert yaw[0] == pytest.approx(-2.0)
    assert np.abs(np.diff(yaw)).max() <= 0.05 + 1e-9
    assert np.cos(yaw[-1] - np.pi / 2.0) == pytest.approx(1.0, abs=1e-6)


def test_many_positions_at_once_are_those_one_by_one():
    old = proven(along(CORNERS, LIMITS))
    flown = Course.begin(old, 0.0, 0.0, 3.0, 0.8)
    first = 10
    new = Trajectory(
        np.vstack([old.control_points_m[first : first + 12], np.tile([30.0, 5.0, 14.0], (3, 1))]),
        old.knot_interval_s,
        old.start_s + first * old.knot_interval_s,
    )
    flown = flown.continued(proven(new), 1.0)
    moments = np.arange(0.0, 12.0, 0.3)
    assert flown.positions_at(moments) == pytest.approx(np.stack([flown.motion_at(s).position_m for s in moments]))


def test_a_curve_that_did_not_pass_the_gate_is_not_flown():
    curve = along(CORNERS, LIMITS)
    with pytest.raises(TypeError, match="only what passed the gate"):
        Course.begin(curve, 0.0, 0.0, 3.0, 0.8)
    flown = course()
    with pytest.raises(TypeError, match="only what passed the gate"):
        flown.continued(flown.trajectory.from_knot(10), 100.5)


def test_after_its_end_a_course_stands_exactly():
    place = np.array([0.30232349, -0.40293551, 10.70006275])
    short = proven(along(np.stack([place, place + np.array([-0.5, 0.26, 0.7])]), LIMITS))
    flown = Course.begin(short, 0.0, 0.0, 3.0, 0.8)
    for now_s in np.linspace(flown.end_s, flown.end_s + 5.0, 11):
        setpoint = flown.at(now_s + 1.0).setpoint()
        assert setpoint.velocity_enu_mps == setpoint.acceleration_enu_mps2 == (0.0, 0.0, 0.0)


def test_a_setpoint_leans_against_drag_by_its_speed_and_never_up_or_down():
    flown = course()
    for now in np.arange(100.5, 108.0, 0.5):
        point = flown.at(now)
        without, with_drag = point.setpoint(), point.setpoint(drag_per_s=0.5)
        more = np.subtract(with_drag.acceleration_enu_mps2, without.acceleration_enu_mps2)
        assert more == pytest.approx([*(0.5 * np.array(without.velocity_enu_mps[:2])), 0.0])
        assert with_drag.position_enu_m == without.position_enu_m
        assert with_drag.velocity_enu_mps == without.velocity_enu_mps


def test_standing_is_standing():
    flown = Course.standing((1.0, 2.0, 3.0), 5.0, 0.4)
    for now in (5.0, 50.0):
        point = flown.at(now)
        assert point.setpoint().position_enu_m == pytest.approx((1.0, 2.0, 3.0))
        assert point.setpoint().velocity_enu_mps == (0.0, 0.0, 0.0)
        assert point.yaw_rad == 0.4
    assert flown.stands(5.0)
