"""Whoever else takes control has it."""

import numpy as np
import pytest

from mission.executive.events import (
    Operator,
)
from mission.executive.phases import Phase
from sim_bridge.state import Command, FlightMode
from tests.mission.rehearsed_flight import Flight


def test_a_mode_change_by_the_pilot_stops_the_stream_at_once_and_is_never_fought():
    flight = Flight().exploring()
    flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    orders = len(flight.vehicle.orders)
    flight.run_to(Phase.OVERRIDDEN)
    assert flight.withdrawn[-1] is Phase.OVERRIDDEN
    sent = len(flight.setpoints)
    flight.run_for(60.0)
    assert flight.phase is Phase.OVERRIDDEN
    assert len(flight.setpoints) == sent
    assert len(flight.vehicle.orders) == orders
    assert flight.executive.offboard_lost == 1


@pytest.mark.parametrize("phase", [Phase.TAKING_OFF, Phase.TRANSIT, Phase.RETURNING, Phase.LANDING])
def test_the_pilot_wins_in_every_phase(phase):
    flight = Flight().run_to(phase).run_for(3.5)
    assert flight.phase is phase
    flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN)
    orders = len(flight.vehicle.orders)
    flight.run_for(20.0)
    assert len(flight.vehicle.orders) == orders


def test_after_an_override_the_operator_takes_over_again_and_the_rest_is_flown():
    flight = Flight().exploring()
    flown_s = flight.executive.explored_s(flight.now_s)
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN)
    flight.vehicle.position = flight.vehicle.position + np.array([5.0, -8.0, 3.0])
    flight.run_for(5.0)
    flight.tell(Operator.RESUME)
    flight.run_to(Phase.FOLLOWING)
    assert flight.executive.explored_s(flight.now_s) >= flown_s
    assert flight.run().phase is Phase.LANDED
    assert flight.executive.explored


def test_the_last_order_of_a_flight_that_is_left_is_not_withdrawn():
    flight = Flight().exploring()
    flight.tell(Operator.LAND)
    flight.tell(Operator.LEAVE)
    assert flight.phase is Phase.ABORTED
    assert flight.withdrawn[-1] is Phase.LANDING


def test_a_failsafe_of_the_vehicle_is_told_apart_from_the_pilot():
    flight = Flight().exploring()
    flight.vehicle.failsafe = True
    flight.vehicle.set_mode(FlightMode.RETURN, flight.now_s)
    flight.run()
    assert Phase.OVERRIDDEN in flight.phases
    assert "failsafe" in flight.executive.why or flight.phase is Phase.LANDED
    assert flight.phase is Phase.LANDED
    assert not flight.executive.explored


def test_a_pilot_who_takes_off_before_the_order_to_is_taken_has_the_vehicle():
    flight = Flight()
    flight.vehicle.set_mode(FlightMode.PILOT, -5.0)
    flight.vehicle.refuse[Command.TAKE_OFF] = ["denied"] * 1000
    flight.run_to(Phase.TAKING_OFF)
    flight.vehicle.position = np.array([0.0, 0.0, 4.0])
    flight.run_for(6.0)
    assert flight.phase is Phase.OVERRIDDEN
    assert Command.LAND not in flight.vehicle.orders
