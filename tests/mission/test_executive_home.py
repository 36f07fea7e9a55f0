"""What sends a flight home: charge and fence."""

import dataclasses

import pytest

from mission.executive.events import FlightMethod, MissionPlace, Operator
from mission.executive.phases import Phase
from sim_bridge.state import FlightMode
from tests.mission.rehearsed_flight import FAR_AWAY, Flight


def test_the_way_home_is_flown_when_the_charge_is_what_it_needs():
    flight = Flight()
    flight.vehicle.battery = 0.2
    flight.run()
    assert flight.phase is Phase.LANDED
    assert not flight.executive.explored
    assert Phase.RETURNING in flight.phases
    # The reserve is still there, and was not wasted either.
    assert 0.15 <= flight.vehicle.battery <= 0.18


def test_a_hungry_vehicle_turns_back_earlier():
    lazy, hungry = Flight(), Flight()
    lazy.vehicle.battery = hungry.vehicle.battery = 0.5
    hungry.vehicle.drain_per_s = 3.0 / 1200.0
    charges = []
    for flight in (lazy, hungry):
        flight.run(lambda f: f.phase is Phase.TURNING_BACK)
        charges.append(flight.vehicle.battery)
        assert flight.run().phase is Phase.LANDED
        assert flight.vehicle.battery >= 0.14
    assert charges[1] < charges[0] or not hungry.executive.explored


def test_outside_the_fence_it_turns_back():
    flight = Flight().exploring()
    flight.fence_east_m = float(flight.vehicle.position[0]) - 2.0
    flight.run_for(0.1)
    assert flight.phase is Phase.TURNING_BACK
    assert flight.run().phase is Phase.LANDED


def fly_low_on_charge(flight):
    flight.vehicle.battery = 0.1


def fly_outside(flight):
    flight.fence_east_m = float(flight.vehicle.position[0]) - 2.0


def fly_too_close(flight):
    flight.obstacle = flight.vehicle.position.copy()


@pytest.mark.parametrize("alarm", [fly_low_on_charge, fly_outside, fly_too_close])
def test_a_mission_that_the_vehicle_flies_by_itself_is_watched_and_called_off(alarm):
    flight = Flight(method=FlightMethod.MISSION)
    flight.places = (MissionPlace(1, (0.0, 0.0, 10.0)), MissionPlace(3, (20.0, 0.0, 10.0)))
    flight.run_to(Phase.AUTO_MISSION).run_for(5.0)
    alarm(flight)
    flight.run_for(0.2)
    assert flight.phase is Phase.VEHICLE_RETURN
    flight.run_for(0.2)
    assert flight.vehicle.mode is FlightMode.RETURN
    flight.obstacle, flight.fence_east_m = FAR_AWAY, 1000.0
    assert flight.run().phase is Phase.LANDED


def test_a_climb_that_drifts_out_of_the_fence_lands():
    flight = Flight().run_to(Phase.TAKING_OFF).run_for(2.0)
    flight.fence_east_m = -5.0
    flight.run_for(0.2)
    assert flight.phase is Phase.LANDING


@pytest.mark.parametrize("alarm", [fly_low_on_charge, fly_outside])
def test_what_alarms_before_setpoints_are_taken_has_them_taken_to_fly_home(alarm):
    flight = Flight().run_to(Phase.ENTERING)
    alarm(flight)
    flight.run_for(0.2)
    assert flight.phase is Phase.TAKING_BACK
    flight.fence_east_m = 1000.0
    assert flight.run().phase is Phase.LANDED
    assert Phase.RETURNING in flight.phases


def test_a_vehicle_that_never_told_its_home_returns_by_itself():
    flight = Flight().exploring()
    flight.executive._vehicle.home_m = None
    flight.tell(Operator.RETURN)
    assert flight.phase is Phase.VEHICLE_RETURN
    assert any("has not told where its home is" in text for text in flight.said)


def telling(flight, **told):
    """A vehicle that tells something else of its charge than is true."""
    true_state = flight.vehicle.state
    flight.vehicle.state = lambda now_s: dataclasses.replace(true_state(now_s), **told)


@pytest.mark.parametrize("told", [{"battery_fraction": 1.0}, {"battery_fraction": 1.0, "battery_age_s": 40.0}])
def test_a_charge_that_does_not_fall_is_reckoned_and_that_is_said_once(told):
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    telling(flight, **told)
    flight.run(limit_s=3000.0)
    assert flight.phase is Phase.LANDED
    assert Phase.RETURNING in flight.phases
    assert 0.13 <= flight.vehicle.battery <= 0.18
    assert sum("reckoned with what vehicle.endurance_s leaves" in text for text in flight.said) == 1


def test_a_charge_that_is_told_as_it_is_is_not_doubted():
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run(limit_s=3000.0)
    assert not any("reckoned" in text for text in flight.said)


def test_nothing_is_said_of_a_charge_that_is_enough():
    assert [text for text in Flight().exploring().said if "charge" in text] == []


def test_a_vehicle_that_never_tells_its_charge_is_flown_home_where_it_flies_already():
    flight = Flight()
    telling(flight, battery_fraction=None)
    flight.run()
    assert Phase.FOLLOWING not in flight.phases
    assert flight.phase is Phase.LANDED


def test_the_checks_begin_when_the_charge_is_told_or_it_has_had_the_time_to():
    flight, silent = Flight(), Flight()
    telling(silent, battery_fraction=None)
    for one in (flight, silent):
        one.run_to(Phase.CHECKING)
    assert flight.now_s < 4.0
    assert silent.now_s > 10.0
