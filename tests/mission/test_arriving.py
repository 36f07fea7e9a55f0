"""The exploration begins where and when the vehicle stands, not when the curve of the way there has ended."""

import numpy as np
import pytest

from mission.executive.events import Operator
from mission.executive.phases import Phase
from sim_bridge.state import FlightMode
from sim_bridge.vehicle.kinematics import Airframe
from tests.mission.moving_vehicle import PX4_SIH_DRAG, MovingVehicle
from tests.mission.rehearsed_flight import Flight

SLUGGISH = Airframe(velocity_gain=0.9, lag_s=0.4, integral_gain=0.1)
"""Swings past the end of a way at 1.2 m/s and comes back; Copter was seen to at 2.3 m/s."""


def begun(flight: Flight) -> tuple[float, float]:
    """How far from the start of the exploration it begins, metres, and how fast the vehicle is then, m/s."""
    flight.run_to(Phase.FOLLOWING)
    exploration = flight.executive.exploration
    begins_m = exploration.motion_at(exploration.start_s).position_m
    return float(np.linalg.norm(flight.vehicle.position - begins_m)), float(np.linalg.norm(flight.vehicle.velocity))


@pytest.mark.parametrize(
    "airframe", [Airframe(), Airframe(drag=PX4_SIH_DRAG), SLUGGISH], ids=["its own", "PX4's simulated drag", "sluggish"]
)
def test_the_exploration_begins_when_the_vehicle_stands_at_its_start(airframe):
    flight = Flight()
    flight.vehicle = MovingVehicle(airframe)
    apart_m, speed_mps = begun(flight)
    assert apart_m <= 0.5
    assert speed_mps <= 0.5
    assert not any("come to rest" in text for text in flight.said)


def test_a_vehicle_that_never_comes_there_is_not_waited_for_for_ever():
    flight = Flight().run_to(Phase.TRANSIT)
    flight.push = np.array([0.0, 0.9, 0.0])
    flight.run_to(Phase.FOLLOWING)
    assert any("has not come to rest at the start" in text for text in flight.said)
    assert 0.8 < abs(flight.vehicle.position[1]) < 1.0


def test_it_comes_to_rest_before_it_explores_on_after_an_override():
    flight = Flight()
    flight.vehicle = MovingVehicle(SLUGGISH)
    flight.exploring().run_for(5.0)
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN)
    flight.vehicle.position = flight.vehicle.position + np.array([0.0, -8.0, 3.0])
    flight.run_for(5.0).tell(Operator.RESUME)
    flight.run_to(Phase.FOLLOWING)
    assert flight.executive.course is not None
    begins_m = flight.executive.course.at(flight.now_s).motion.position_m
    assert np.linalg.norm(flight.vehicle.position - begins_m) <= 0.5
    assert np.linalg.norm(flight.vehicle.velocity) <= 0.5


def test_a_vehicle_that_is_taken_over_in_motion_comes_to_rest_before_its_way_begins():
    flight = Flight()
    flight.vehicle = MovingVehicle(Airframe())
    flight.exploring()
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN).run_for(5.0)
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.ENTERING
    flight.vehicle.velocity = np.array([4.0, 0.0, 0.0])
    flight.run(lambda _: flight.vehicle.mode is FlightMode.EXTERNAL)
    flight.vehicle.velocity = np.array([4.0, 0.0, 0.0])
    flight.run_to(Phase.TRANSIT)
    assert flight.executive.course is not None
    begins_m = flight.executive.course.at(flight.now_s).motion.position_m
    assert np.linalg.norm(flight.vehicle.position - begins_m) <= 0.5
    assert np.linalg.norm(flight.vehicle.velocity) <= 0.5
