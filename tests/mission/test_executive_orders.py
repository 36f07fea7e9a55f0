"""Commands: given when they are due, asked again, and refusals shown."""

import numpy as np
import pytest

from mission.executive.events import FlightMethod, Operator
from mission.executive.phases import Phase
from sim_bridge.state import Command, FlightMode
from tests.mission.rehearsed_flight import Flight


def test_arming_is_tried_again_and_the_refusal_is_shown_once():
    flight = Flight()
    flight.vehicle.refuse[Command.ARM] = ['denied ("Preflight Fail: compass")'] * 3
    flight.run_to(Phase.TAKING_OFF)
    assert flight.vehicle.orders.count(Command.ARM) == 4
    assert sum("compass" in text for text in flight.said) == 1


def test_arming_that_is_always_refused_aborts():
    flight = Flight()
    flight.vehicle.refuse[Command.ARM] = ["denied"] * 100
    flight.run()
    assert flight.phase is Phase.ABORTED
    assert Command.TAKE_OFF not in flight.vehicle.orders


def test_a_take_off_that_does_not_reach_its_height_ends_in_a_landing():
    flight = Flight().run_to(Phase.TAKING_OFF)
    flight.run(lambda f: f.vehicle.mode is FlightMode.TAKEOFF)
    flight.vehicle.target_up = 3.0
    # It stays in its take-off below the height that was asked for, as one does whose motors are too weak.
    flight.run(lambda f: f.vehicle.position[2] > 2.5)
    flight.vehicle.mode = FlightMode.OTHER
    flight.run_to(Phase.LANDING)
    assert Command.FOLLOW_SETPOINTS not in flight.vehicle.orders
    assert flight.run().phase is Phase.LANDED
    assert not flight.executive.explored


@pytest.mark.parametrize("method", FlightMethod)
def test_a_climb_is_done_where_it_was_asked_for_though_home_moves_meanwhile(method):
    flight = Flight(method=method)
    # PX4 moves its home as it leaves the ground; its estimate of the height may have drifted since it set it last.
    flight.vehicle.home_up_m, flight.vehicle.home_up_aloft_m = -1.5, 2.5
    flight.run_to(Phase.ENTERING if method is FlightMethod.OFFBOARD else Phase.AUTO_MISSION)
    assert flight.vehicle.position[2] == 10.0


def test_a_take_off_that_is_refused_disarms_and_aborts():
    flight = Flight()
    flight.vehicle.refuse[Command.TAKE_OFF] = ["denied"] * 1000
    flight.run_to(Phase.TAKING_OFF)
    flight.run_for(10.0)
    # Both autopilots disarm by themselves ten seconds after arming on the ground.
    flight.vehicle.armed = False
    assert flight.run().phase is Phase.ABORTED
    assert not flight.setpoints


def test_a_landing_that_is_refused_is_asked_for_again():
    flight = Flight().exploring()
    flight.vehicle.refuse[Command.LAND] = ["temporarily rejected"] * 2
    flight.tell(Operator.LAND)
    flight.run()
    assert flight.vehicle.orders.count(Command.LAND) == 3
    assert flight.phase is Phase.LANDED


def test_setpoints_go_on_until_the_landing_is_taken_and_not_one_step_longer():
    flight = Flight().exploring()
    flight.tell(Operator.LAND)
    flight.run_for(0.5)
    assert flight.course is not None
    flight.run_for(2.0)
    assert flight.course is None


def test_a_vehicle_that_does_not_take_setpoints_lands_where_it_is():
    flight = Flight()
    flight.vehicle.refuse[Command.FOLLOW_SETPOINTS] = ["temporarily rejected"] * 1000
    flight.run_to(Phase.LANDING)
    assert flight.vehicle.orders.count(Command.FOLLOW_SETPOINTS) > 3
    assert flight.run().phase is Phase.LANDED


def returning_by_itself(answers: list[str]) -> Flight:
    flight = Flight().exploring()
    flight.no_way = "walled in"
    flight.vehicle.refuse[Command.RETURN] = answers
    flight.tell(Operator.RETURN)
    return flight


def test_a_return_that_is_refused_time_and_again_becomes_a_landing():
    flight = returning_by_itself(["denied"] * 1000)
    flight.run()
    assert flight.phases[-3:] == [Phase.VEHICLE_RETURN, Phase.LANDING, Phase.LANDED]
    assert flight.vehicle.orders.count(Command.RETURN) == 3


@pytest.mark.parametrize("answers", [["denied"] * 2, ["timeout"] * 6, ["denied", "timeout", "denied", "timeout"]])
def test_a_return_whose_answer_is_lost_or_refused_once_or_twice_is_asked_for_again(answers):
    flight = returning_by_itself(answers.copy())
    flight.run()
    assert flight.phases[-2:] == [Phase.VEHICLE_RETURN, Phase.LANDED]
    assert np.hypot(*flight.vehicle.position[:2]) < 0.2
    assert flight.vehicle.orders.count(Command.RETURN) == len(answers) + 1


def test_a_return_that_was_taken_although_its_answer_was_lost_is_seen_in_the_mode():
    flight = returning_by_itself(["timeout"])
    flight.run_for(0.2)
    flight.vehicle.set_mode(FlightMode.RETURN, flight.now_s)
    flight.run_for(1.0)
    assert flight.course is None
    assert flight.run().phase is Phase.LANDED
    assert flight.vehicle.orders.count(Command.RETURN) == 1


@pytest.mark.parametrize("wish", [Operator.RETURN, Operator.LAND, Operator.LEAVE])
@pytest.mark.parametrize("phase", [Phase.WAITING_READY, Phase.CHECKING, Phase.ARMING])
def test_the_operator_stops_it_before_take_off(phase, wish):
    flight = Flight()
    flight.vehicle.refuse[Command.ARM] = ["denied"] * 1000
    flight.run(lambda f: f.phase is phase)
    flight.tell(wish)
    assert flight.run().phase is Phase.ABORTED
    assert not flight.vehicle.armed
    assert not flight.setpoints


@pytest.mark.parametrize("wish", [Operator.RETURN, Operator.LAND, Operator.LEAVE])
@pytest.mark.parametrize("refusals", [[], ["timeout", "denied"]])
def test_a_vehicle_that_was_armed_already_is_disarmed_before_the_flight_ends(wish, refusals):
    flight = Flight().run_to(Phase.ARMING)
    flight.run(lambda f: f.vehicle.armed)
    flight.vehicle.refuse[Command.DISARM] = refusals.copy()
    flight.tell(wish)
    flight.run()
    assert flight.phases[-2:] == [Phase.DISARMING, Phase.ABORTED]
    assert not flight.vehicle.armed
    assert flight.vehicle.orders == [Command.ARM, *[Command.DISARM] * (len(refusals) + 1)]


def test_an_order_to_arm_that_is_not_shown_yet_is_undone_too():
    flight = Flight()
    flight.vehicle.refuse[Command.ARM] = ["timeout"]
    flight.run_to(Phase.ARMING)
    flight.tell(Operator.RETURN)
    flight.run()
    assert flight.withdrawn[-1] is Phase.DISARMING
    assert flight.vehicle.orders == [Command.ARM, Command.DISARM]


def test_a_vehicle_that_does_not_say_that_it_disarmed_is_warned_of():
    flight = Flight().run_to(Phase.ARMING)
    flight.run(lambda f: f.vehicle.armed)
    flight.vehicle.refuse[Command.DISARM] = ["denied"] * 1000
    flight.tell(Operator.RETURN)
    assert flight.run().phase is Phase.ABORTED
    assert "mind the motors" in flight.executive.why


def test_motors_that_stop_in_the_air_end_the_flight_and_the_stream():
    flight = Flight().exploring()
    flight.vehicle.armed = False
    flight.run_for(0.1)
    assert flight.phase is Phase.ABORTED
    assert flight.course is None
    assert "disarmed" in flight.executive.why
