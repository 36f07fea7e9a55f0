"""What was learned stands in a climb, below the end of a path, above home, or on the legs of an uploaded mission."""

import numpy as np
import pytest

from mission.executive.events import FlightEnd, FlightMethod, MissionPlace, Operator
from mission.executive.phases import Phase
from planner.obstacles import Sphere
from sim_bridge.state import Command, MissionProgress
from tests.mission.rehearsed_flight import CORNERS, Flight

ABOVE_HOME = Sphere(np.array([0.0, 0.0, 4.0]), 2.0)
ON_A_LEG = Sphere(np.array([60.0, 20.0, 12.5]), 3.0)
RALLY = (30.0, -20.0, 0.0)
PLACES = tuple(MissionPlace(number, tuple(corner)) for number, corner in enumerate(CORNERS.tolist(), start=1))


def apart_m(flight: Flight) -> float:
    return float(np.linalg.norm(flight.vehicle.position - ABOVE_HOME.center_m)) - ABOVE_HOME.radius_m


def test_a_climb_into_what_was_learned_is_not_begun():
    flight = Flight()
    flight.vehicle.refuse[Command.ARM] = ["denied"] * 3
    flight.run_to(Phase.ARMING)
    flight.learn(ABOVE_HOME)
    assert "will not take off" in flight.executive.consequence()
    flight.run()
    assert flight.phase is Phase.ABORTED
    assert Command.TAKE_OFF not in flight.vehicle.orders


def test_a_climb_below_what_was_learned_is_ended():
    flight = Flight().run_to(Phase.TAKING_OFF).run_for(1.0)
    flight.learn(ABOVE_HOME)
    highest = []
    flight.run(lambda flown: highest.append(flown.vehicle.position[2]) or False)
    assert flight.phase is Phase.LANDED
    assert max(highest) < 2.0


def test_above_a_home_that_is_not_clear_it_waits_until_it_is_told_to_land():
    flight = Flight().exploring()
    flight.learn(ABOVE_HOME)
    assert "will wait above home" in flight.executive.consequence()
    flight.run_to(Phase.HOLDING).run_for(30.0)
    assert flight.executive.why == "no place to land is clear: it stands above home"
    assert flight.phase is Phase.HOLDING
    assert apart_m(flight) > 3.0
    flight.vehicle.battery = 0.1
    flight.run_for(5.0)
    assert flight.phase is Phase.HOLDING
    flight.tell(Operator.LAND)
    assert flight.run().phase is Phase.LANDED


@pytest.mark.parametrize("phase", [Phase.FOLLOWING, Phase.RETURNING])
def test_it_lands_at_a_rally_point_where_home_is_not_clear(phase):
    east, north, _ = RALLY
    flight = Flight(rally_m=((east, north, 30.0),)).run_to(phase)
    flight.learn(ABOVE_HOME)
    assert "rally point (30, -20)" in flight.executive.consequence()
    flight.run()
    assert flight.phase is Phase.LANDED
    assert flight.vehicle.position == pytest.approx(np.array(RALLY), abs=0.1)


def test_a_landing_into_what_was_learned_is_broken_off():
    flight = Flight(rally_m=(RALLY,)).run_to(Phase.LANDING)
    flight.learn(ABOVE_HOME)
    least = []
    flight.run(lambda flown: least.append(apart_m(flown)) or False)
    assert flight.phase is Phase.LANDED
    assert flight.vehicle.position == pytest.approx(np.array(RALLY), abs=0.1)
    assert min(least) > 0.5


def test_a_landing_is_not_gone_on_with_where_it_was_blocked_while_it_was_paused():
    flight = Flight(rally_m=(RALLY,)).run_to(Phase.LANDING).run_for(1.0)
    flight.tell(Operator.PAUSE)
    flight.run_for(3.0)
    assert flight.phase is Phase.RETURN_PAUSED
    flight.learn(ABOVE_HOME)
    flight.run_for(3.0)
    assert flight.phase is Phase.RETURN_PAUSED
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.TAKING_BACK
    flight.run()
    assert flight.vehicle.position == pytest.approx(np.array(RALLY), abs=0.1)


def test_where_something_stands_below_the_end_it_lands_at_home():
    flight = Flight(end=FlightEnd.LAND).exploring()
    east, north, _ = CORNERS[-1]
    flight.learn(Sphere(np.array([east, north, 3.0]), 2.0))
    flight.run()
    assert flight.phase is Phase.LANDED
    assert np.hypot(*flight.vehicle.position[:2]) < 0.1
    assert any("lands at home" in text for text in flight.said)


@pytest.mark.parametrize(
    ("obstacle", "phase"),
    [(ON_A_LEG, Phase.TAKING_OFF), (ON_A_LEG, Phase.AUTO_MISSION), (ABOVE_HOME, Phase.AUTO_MISSION)],
)
def test_an_uploaded_mission_that_leads_into_what_was_learned_is_left_for_a_proven_way_home(obstacle, phase):
    flight = Flight(method=FlightMethod.MISSION, rally_m=(RALLY,))
    flight.places = PLACES
    flight.run_to(phase)
    flight.learn(obstacle)
    flight.run()
    expected = [Phase.AUTO_HOLD, Phase.TAKING_BACK, Phase.RETURNING, Phase.LANDING, Phase.LANDED]
    assert flight.phases[-5:] == expected


def test_an_uploaded_mission_is_not_gone_on_with_where_it_is_blocked():
    flight = Flight(method=FlightMethod.MISSION)
    flight.places = PLACES
    flight.run_to(Phase.AUTO_MISSION).run_for(2.0)
    flight.tell(Operator.PAUSE)
    flight.learn(ON_A_LEG)
    flight.run_for(10.0)
    assert flight.phase is Phase.AUTO_HOLD
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.AUTO_HOLD
    assert flight.run_to(Phase.TAKING_BACK).run().phase is Phase.LANDED


def test_legs_of_an_uploaded_mission_that_are_behind_block_nothing():
    flight = Flight(method=FlightMethod.MISSION)
    flight.places = PLACES
    flight.run_to(Phase.AUTO_MISSION)
    flight.tell(MissionProgress(3, 3))
    flight.learn(ON_A_LEG)
    flight.run_for(3.0)
    assert flight.phase is Phase.AUTO_MISSION
