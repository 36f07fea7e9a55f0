"""Holding on the course, and going on: the operator, obstacles, wind, a stalled stream."""

import numpy as np
import pytest

from mission.executive.course import Course
from mission.executive.events import FlightMethod, MissionPlace, Operator, Stalled, StreamFailed
from mission.executive.phases import Phase
from mission.executive.stay import limit_s
from planner.obstacles import Sphere
from sim_bridge.state import Command, FlightMode
from tests.mission.rehearsed_flight import FAR_AWAY, LIMITS, Flight, largest_jump_mps


def test_a_pause_stands_on_the_course_and_a_resume_goes_on_from_there():
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run_for(10.0)
    assert flight.phase is Phase.HOLDING
    stood = flight.vehicle.position.copy()
    assert np.linalg.norm(flight.vehicle.velocity) < 1e-9
    flight.tell(Operator.RESUME)
    flight.run_for(0.2)
    assert np.linalg.norm(flight.vehicle.position - stood) < 0.2
    flight.run()
    assert flight.phase is Phase.LANDED
    assert flight.executive.explored
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


@pytest.mark.parametrize("phase", [Phase.TRANSIT, Phase.FOLLOWING, Phase.RETURNING])
def test_whatever_is_interrupted_is_taken_up_again(phase):
    flight = Flight().run_to(phase).run_for(2.0)
    flight.tell(Operator.PAUSE)
    flight.run_for(5.0)
    assert flight.phase is Phase.HOLDING
    flight.tell(Operator.RESUME)
    assert flight.phase is phase
    assert flight.run().phase is Phase.LANDED


def test_too_close_to_an_obstacle_it_holds_and_goes_on_when_clear():
    flight = Flight().exploring()
    flight.obstacle = flight.vehicle.position.copy()
    flight.run_for(0.1)
    assert flight.phase is Phase.HOLDING
    flight.obstacle = FAR_AWAY
    flight.run_for(8.0)
    assert flight.phase is Phase.FOLLOWING


def test_what_keeps_happening_ends_the_exploration():
    flight = Flight().exploring()
    for _ in range(4):
        flight.obstacle = flight.vehicle.position.copy()
        flight.run_for(0.1)
        flight.obstacle = FAR_AWAY
        flight.run_for(6.0)
    assert Phase.TURNING_BACK in flight.phases
    assert flight.run().phase is Phase.LANDED


def test_blown_off_the_course_it_waits_until_it_is_back():
    flight = Flight().exploring()
    flight.push = np.array([0.0, 4.0, 0.0])
    flight.run_for(0.2)
    assert flight.phase is Phase.HOLDING
    flight.push = np.zeros(3)
    flight.run_for(8.0)
    assert flight.phase is Phase.FOLLOWING


def test_a_vehicle_that_does_not_keep_to_its_course_is_flown_more_slowly_from_then_on():
    flight = Flight().exploring()
    full_mps = np.linalg.norm(flight.vehicle.velocity)
    for slower in (0.7, 0.49, 0.35):
        flight.push = np.array([0.0, 4.0, 0.0])
        flight.run_for(0.2)
        flight.push = np.zeros(3)
        flight.run_for(8.0)
        assert flight.phase is Phase.FOLLOWING
        assert flight.executive.course is not None
        assert flight.executive.course.at(flight.now_s).rate == pytest.approx(slower)
    assert np.linalg.norm(flight.vehicle.velocity) < 0.6 * full_mps
    assert any("35% of the pace" in text for text in flight.said)
    flight.run()
    assert flight.phase is Phase.LANDED
    assert flight.executive.explored
    assert Phase.RETURNING in flight.phases


def test_a_slow_flight_has_more_time():
    assignment, exploration = Flight().executive.assignment, Flight().executive.exploration
    course = Course.begin(exploration, 0.0, 0.0, 3.0, 1.0)
    full_s, slow_s = (limit_s(Phase.FOLLOWING, assignment, exploration, course, 1.0, rate) for rate in (1.0, 0.35))
    assert full_s > exploration.duration_s
    assert slow_s > exploration.duration_s / 0.35
    assert slow_s - 60.0 == pytest.approx((full_s - 60.0) / 0.35)


@pytest.mark.parametrize(
    ("beside_m", "behind_m", "obstacle_above_m", "rate"),
    [
        (0.8, 0.0, 50.0, 1.0),
        (0.8, 0.0, 1.2, 0.5 / 1.2),
        (0.4, 0.0, 1.2, 1.0),
        (0.0, 1.5, 1.2, 1.0),
        (0.8, 0.0, 2.0, 1.0),
    ],
    ids=["nothing is near", "something is near", "kept well enough", "only behind", "not near enough"],
)
def test_a_vehicle_beside_its_path_is_slowed_down_before_it_comes_near_to_something(
    beside_m, behind_m, obstacle_above_m, rate
):
    flight = Flight().exploring().run_for(8.0)
    course = flight.executive.course
    assert course is not None
    ahead = course.motion_at(course.at(flight.now_s).curve_s + 3.0)
    flight.obstacle = ahead.position_m + np.array([0.0, 0.0, obstacle_above_m])
    along = ahead.velocity_mps / np.linalg.norm(ahead.velocity_mps)
    flight.push = np.array([0.0, 0.0, -beside_m]) - behind_m * along
    flight.run_for(2.5)
    assert flight.phase is Phase.FOLLOWING
    assert flight.executive.course is not None
    assert flight.executive.course.at(flight.now_s).rate == pytest.approx(rate, abs=0.05)


def test_a_pause_does_not_slow_it_down():
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run_for(5.0)
    flight.tell(Operator.RESUME)
    flight.run_for(5.0)
    assert flight.executive.course is not None
    assert flight.executive.course.at(flight.now_s).rate == 1.0


@pytest.mark.parametrize("phase", [Phase.TRANSIT, Phase.FOLLOWING, Phase.HOLDING, Phase.RETURNING])
def test_without_setpoints_the_vehicle_returns_by_itself(phase):
    flight = Flight()
    if phase is Phase.HOLDING:
        flight.exploring().tell(Operator.PAUSE)
    else:
        flight.run_to(phase)
    flight.tell(StreamFailed())
    assert flight.phase is Phase.VEHICLE_RETURN
    flight.run_for(1.0)
    assert flight.vehicle.orders[-1] is Command.RETURN
    assert flight.run().phase is Phase.LANDED


def test_a_stream_that_braked_by_itself_is_taken_up_where_it_stands():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    braked = course.braking(flight.now_s)
    flight.course = braked
    flight.now_s += 3.0
    flight.tell(Stalled(braked))
    assert flight.phase is Phase.HOLDING
    flight.run_for(8.0)
    assert flight.phase is Phase.FOLLOWING
    assert flight.run().phase is Phase.LANDED
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_a_stream_that_braked_while_the_flight_turned_back_is_led_home_from_where_it_stands():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    braked = course.braking(flight.now_s)
    flight.now_s += 3.0
    # Decided before it is known that the stream stands already.
    flight.tell(Operator.RETURN)
    flight.course = braked
    flight.tell(Stalled(braked))
    flight.answers = flight.answers[-1:]
    assert flight.phase is Phase.TURNING_BACK
    assert flight.run().phase is Phase.LANDED
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


@pytest.mark.parametrize("phase", [Phase.TAKING_OFF, Phase.ENTERING, Phase.TURNING_BACK, Phase.TAKING_BACK])
def test_a_pause_before_there_is_anything_to_stand_still_on_comes_into_effect_then(phase):
    flight = Flight()
    if phase is Phase.TURNING_BACK:
        flight.exploring().tell(Operator.RETURN)
    elif phase is Phase.TAKING_BACK:
        flight.run_to(Phase.ENTERING).tell(Operator.RETURN)
    else:
        flight.run_to(phase)
    assert flight.phase is phase
    flight.tell(Operator.PAUSE)
    flight.run_to(Phase.HOLDING)
    stood = flight.vehicle.position.copy()
    flight.run_for(60.0)
    assert flight.phase is Phase.HOLDING
    assert np.linalg.norm(flight.vehicle.position - stood) < 0.1
    flight.tell(Operator.RESUME)
    assert flight.run().phase is Phase.LANDED


def test_a_pause_during_the_climb_of_an_uploaded_mission_holds_above_home():
    flight = Flight(method=FlightMethod.MISSION)
    flight.places = (MissionPlace(1, (0.0, 0.0, 10.0)), MissionPlace(3, (20.0, 0.0, 10.0)))
    flight.run_to(Phase.TAKING_OFF).tell(Operator.PAUSE)
    flight.run_to(Phase.AUTO_HOLD).run_for(30.0)
    assert Command.START_MISSION not in flight.vehicle.orders
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.AUTO_MISSION


def test_a_pause_that_waits_is_dropped_when_the_operator_resumes():
    flight = Flight().run_to(Phase.TAKING_OFF)
    flight.tell(Operator.PAUSE)
    flight.tell(Operator.RESUME)
    assert flight.run().phase is Phase.LANDED
    assert Phase.HOLDING not in flight.phases


def test_a_pause_while_it_holds_anyway_outlasts_what_it_holds_for():
    flight = Flight().exploring()
    flight.obstacle = flight.vehicle.position.copy()
    flight.run_to(Phase.HOLDING)
    flight.tell(Operator.PAUSE)
    flight.obstacle = FAR_AWAY
    flight.run_for(60.0)
    assert flight.phase is Phase.HOLDING
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.FOLLOWING
    assert flight.run().executive.explored


@pytest.mark.parametrize("held", [False, True])
def test_a_pause_outlasts_a_lost_link(held):
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run_for(5.0)
    flight.vehicle.silent = True
    flight.run_to(Phase.BLIND)
    if held:
        flight.vehicle.failsafe = True
        flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.run_for(3.0)
    flight.vehicle.silent = False
    flight.run_for(1.0)
    flight.vehicle.failsafe = False
    flight.run_for(60.0)
    assert flight.phase is Phase.HOLDING
    assert (Phase.ENTERING in flight.phases[flight.phases.index(Phase.BLIND) :]) is held
    flight.tell(Operator.RESUME)
    assert flight.run().phase is Phase.LANDED
    assert flight.executive.explored


def test_a_pause_while_the_link_is_lost_stands_when_it_is_back():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run_to(Phase.BLIND)
    flight.tell(Operator.PAUSE)
    flight.vehicle.silent = False
    flight.run_for(30.0)
    assert flight.phase is Phase.HOLDING


@pytest.mark.parametrize("phase", [Phase.VEHICLE_RETURN, Phase.LANDING])
def test_a_return_or_a_landing_is_paused_and_goes_on(phase):
    flight = Flight().exploring()
    flight.no_way = "walled in"
    flight.tell(Operator.RETURN if phase is Phase.VEHICLE_RETURN else Operator.LAND)
    flight.run_for(4.0)
    assert flight.phase is phase
    flight.tell(Operator.PAUSE)
    flight.run_for(2.0)
    stood = flight.vehicle.position.copy()
    flight.run_for(30.0)
    assert flight.phase is Phase.RETURN_PAUSED
    assert np.linalg.norm(flight.vehicle.position - stood) < 1e-6
    flight.tell(Operator.RESUME)
    assert flight.phase is phase
    assert flight.run().phase is Phase.LANDED


def test_a_landing_that_is_paused_for_too_long_goes_on():
    flight = Flight().exploring()
    flight.tell(Operator.LAND)
    flight.run_for(3.0).tell(Operator.PAUSE)
    assert flight.run(limit_s=400.0).phase is Phase.LANDED
    assert flight.now_s > 300.0


def test_a_vehicle_that_is_down_is_not_paused():
    flight = Flight().exploring()
    flight.vehicle.refuse[Command.LAND] = ["denied"] * 1000
    flight.tell(Operator.LAND)
    flight.vehicle.mode = FlightMode.OTHER
    flight.vehicle.position[2] = 0.0
    flight.run_for(0.1)
    flight.tell(Operator.PAUSE)
    assert flight.phase is Phase.LANDING
    assert "pause: nothing to do while landing" in flight.said


def test_a_danger_ends_a_pause():
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run_for(5.0)
    flight.vehicle.battery = 0.16
    assert flight.run().phase is Phase.LANDED
    assert Phase.RETURNING in flight.phases


def test_a_pause_before_a_block_outlasts_it():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    flight.learn(Sphere(course.motion_at(course.at(flight.now_s).curve_s + 7.0).position_m, 2.0))
    flight.run_to(Phase.HOLDING).run_for(5.0)
    assert flight.executive.held_by_block
    flight.tell(Operator.PAUSE)
    # Nobody seeks a way round, or goes home for want of one, until it is resumed.
    assert not flight.executive.held_by_block
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.HOLDING
    assert flight.executive.held_by_block
