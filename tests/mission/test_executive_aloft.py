"""A vehicle that is in the air before the flight begins: whose it is, and what becomes of it."""

import numpy as np
import pytest

from mission.executive.events import Operator
from mission.executive.phases import Phase
from sim_bridge.state import Command, FlightMode
from tests.mission.rehearsed_flight import Flight


def met_in_the_air(mode: FlightMode, failsafe: bool = False, resumed: bool = True) -> Flight:
    flight = Flight(resumed=resumed)
    flight.vehicle.armed = True
    flight.vehicle.position = np.array([30.0, 5.0, 12.0])
    flight.vehicle.failsafe = failsafe
    flight.vehicle.set_mode(mode, -5.0)
    flight.vehicle.ready_after_s = 1e9
    return flight


@pytest.mark.parametrize("mode", [FlightMode.HOLD, FlightMode.EXTERNAL])
def test_a_resumed_flight_takes_a_vehicle_over_that_nobody_steers(mode):
    flight = met_in_the_air(mode)
    flight.run()
    assert flight.phases[:3] == [Phase.WAITING_READY, Phase.CHECKING_ALOFT, Phase.ENTERING]
    assert Phase.ARMING not in flight.phases
    assert Phase.TAKING_OFF not in flight.phases
    assert flight.phase is Phase.LANDED
    assert flight.executive.explored


@pytest.mark.parametrize("mode", [FlightMode.RETURN, FlightMode.LAND])
def test_a_resumed_flight_takes_a_vehicle_over_that_a_failsafe_brings_down(mode):
    flight = met_in_the_air(mode, failsafe=True)
    flight.run_to(Phase.ENTERING)
    assert Phase.OVERRIDDEN not in flight.phases


@pytest.mark.parametrize("mode", [FlightMode.PILOT, FlightMode.RETURN, FlightMode.MISSION, FlightMode.OTHER])
def test_a_resumed_flight_leaves_a_vehicle_to_who_steers_it_until_the_operator_resumes(mode):
    flight = met_in_the_air(mode)
    flight.vehicle.drain_per_s = 0.0
    flight.run_to(Phase.OVERRIDDEN).run_for(2.0)
    assert flight.vehicle.orders == []
    assert flight.setpoints == []
    flight.vehicle.position = np.array([30.0, 5.0, 12.0])
    flight.tell(Operator.RESUME)
    flight.run_to(Phase.TRANSIT)
    assert flight.vehicle.orders == [Command.FOLLOW_SETPOINTS]


@pytest.mark.parametrize("mode", [FlightMode.PILOT, FlightMode.HOLD, FlightMode.EXTERNAL])
def test_a_flight_that_is_not_resumed_never_takes_a_flying_vehicle(mode):
    flight = met_in_the_air(mode, resumed=False)
    flight.run()
    assert flight.phases == [Phase.WAITING_READY, Phase.ABORTED]
    assert "mission resume" in flight.executive.why
    assert flight.vehicle.orders == []
    assert flight.setpoints == []


@pytest.mark.parametrize("phase", [Phase.CHECKING, Phase.ARMING])
def test_a_vehicle_that_somebody_takes_off_with_meanwhile_is_theirs(phase):
    flight = Flight()
    flight.checks_end = phase is not Phase.CHECKING
    flight.vehicle.refuse[Command.ARM] = ["denied"] * 1000
    flight.run_to(phase)
    flight.vehicle.armed = True
    flight.vehicle.position = np.array([0.0, 0.0, 5.0])
    flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    orders = len(flight.vehicle.orders)
    flight.run()
    assert flight.phase is Phase.ABORTED
    assert flight.vehicle.armed
    assert len(flight.vehicle.orders) == orders
    assert flight.withdrawn[-1] is Phase.ABORTED


def test_checks_that_fail_in_the_air_bring_the_vehicle_home():
    flight = met_in_the_air(FlightMode.HOLD)
    flight.problems = ("the battery has 20%, the flight needs 50%",)
    flight.run()
    assert flight.problems[0] in flight.said
    assert Phase.FOLLOWING not in flight.phases
    assert flight.phases[-4:] == [Phase.TAKING_BACK, Phase.RETURNING, Phase.LANDING, Phase.LANDED]


def test_checks_that_fail_in_the_air_with_no_proven_way_home_let_the_vehicle_return_by_itself():
    flight = met_in_the_air(FlightMode.HOLD)
    flight.problems, flight.no_way = ("no way leads from here to home",), "walled in"
    flight.run()
    assert flight.phases[-3:] == [Phase.TAKING_BACK, Phase.VEHICLE_RETURN, Phase.LANDED]


def test_checks_that_fail_leave_a_vehicle_that_is_steered_to_who_steers_it():
    flight = met_in_the_air(FlightMode.PILOT)
    flight.problems = ("GF_ACTION is 0: set it to 2",)
    flight.run()
    assert flight.phase is Phase.ABORTED
    assert flight.problems[0] in flight.said
    assert flight.vehicle.orders == []


@pytest.mark.parametrize("wish", [Operator.RETURN, Operator.LAND])
@pytest.mark.parametrize(("mode", "obeys"), [(FlightMode.HOLD, True), (FlightMode.PILOT, False)])
def test_the_operator_calls_back_during_the_checks_what_nobody_else_steers(mode, obeys, wish):
    flight = met_in_the_air(mode)
    flight.checks_end = False
    flight.run_to(Phase.CHECKING_ALOFT)
    flight.tell(wish)
    flight.run()
    assert flight.phase is (Phase.LANDED if obeys else Phase.ABORTED)
    assert flight.vehicle.armed is not obeys


def test_checks_in_the_air_that_never_end_bring_the_vehicle_home():
    flight = met_in_the_air(FlightMode.HOLD)
    flight.checks_end = False
    assert flight.run().phase is Phase.LANDED
    assert Phase.RETURNING in flight.phases


@pytest.mark.parametrize("no_way", ["", "walled in"])
def test_a_pilot_who_does_not_let_go_when_the_operator_resumes_keeps_it(no_way):
    flight = Flight().exploring()
    flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN).run_for(5.0)
    flight.vehicle.refuse[Command.FOLLOW_SETPOINTS] = ["denied: the sticks are held"] * 1000
    flight.no_way = no_way
    flight.tell(Operator.RESUME)
    flight.run_to(Phase.OVERRIDDEN)
    assert Command.LAND not in flight.vehicle.orders
    assert Command.RETURN not in flight.vehicle.orders
