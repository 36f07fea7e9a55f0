"""Silence, and a vehicle that is heard again."""

import numpy as np
import pytest

from mission.executive.events import Operator, StreamLate
from mission.executive.phases import Phase
from sim_bridge.state import Command, FlightMode
from tests.mission.rehearsed_flight import LIMITS, Flight, largest_jump_mps


def test_a_short_silence_brakes_on_the_course_and_goes_on_when_heard_again():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run_for(5.0)
    assert flight.phase is Phase.BLIND
    assert np.linalg.norm(flight.vehicle.velocity) < 1e-9
    flight.vehicle.silent = False
    flight.run_for(0.2)
    assert flight.phase is Phase.FOLLOWING
    assert flight.run().phase is Phase.LANDED
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_a_silence_while_paused_comes_back_to_the_pause():
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run_for(3.0)
    flight.vehicle.silent = True
    flight.run_for(4.0)
    assert flight.phase is Phase.BLIND
    flight.vehicle.silent = False
    flight.run_for(1.0)
    assert flight.phase is Phase.HOLDING
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.FOLLOWING


def test_a_long_silence_stops_the_stream_and_tells_the_vehicle_to_return():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run_for(15.0)
    assert flight.course is None
    assert flight.vehicle.orders[-1] is Command.RETURN
    flight.vehicle.silent = False
    flight.run()
    assert Phase.VEHICLE_RETURN in flight.phases
    assert flight.phase is Phase.LANDED


def test_a_vehicle_held_by_its_failsafe_is_rejoined_with_a_proven_way():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run_for(3.0)
    flight.vehicle.failsafe = True
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.vehicle.position = flight.vehicle.position + np.array([0.0, 4.0, 0.0])
    flight.run_for(2.0)
    flight.vehicle.silent = False
    flight.run_for(1.0)
    assert flight.phase is Phase.ENTERING
    flight.vehicle.failsafe = False
    assert flight.run().phase is Phase.LANDED
    assert flight.executive.explored


@pytest.mark.parametrize("ours_was_late", [True, False])
def test_a_failsafe_after_a_stream_of_ours_that_was_late_is_rejoined_and_any_other_is_left_alone(ours_was_late):
    flight = Flight().exploring()
    if ours_was_late:
        flight.tell(StreamLate())
    flight.vehicle.failsafe = True
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.run_for(2.0)
    if not ours_was_late:
        assert flight.phase is Phase.OVERRIDDEN
        return
    assert flight.phase is Phase.ENTERING
    flight.vehicle.failsafe = False
    assert flight.run().phase is Phase.LANDED
    assert flight.executive.explored


def test_a_pilot_is_not_fought_after_a_stream_of_ours_that_was_late():
    flight = Flight().exploring()
    flight.tell(StreamLate())
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.run_for(2.0)
    assert flight.phase is Phase.OVERRIDDEN


def test_a_vehicle_that_is_never_heard_again_ends_the_flight():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run()
    assert flight.phase is Phase.ABORTED
