"""Whole flights by the executive, in virtual time."""

import numpy as np
import pytest

from mission.executive.events import (
    FlightEnd,
    FlightMethod,
    MissionPlace,
    Operator,
)
from mission.executive.phases import FINAL, Phase
from planner.obstacles import Sphere
from sim_bridge.state import (
    Command,
    FlightMode,
    MissionProgress,
    StatusText,
)
from tests.mission.rehearsed_flight import CORNERS, FAR_AWAY, LIMITS, Flight, largest_jump_mps


def test_a_flight_explores_everything_returns_and_lands():
    flight = Flight().run()
    assert flight.phases == [
        Phase.WAITING_READY,
        Phase.CHECKING,
        Phase.ARMING,
        Phase.TAKING_OFF,
        Phase.ENTERING,
        Phase.TRANSIT,
        Phase.FOLLOWING,
        Phase.TURNING_BACK,
        Phase.RETURNING,
        Phase.LANDING,
        Phase.LANDED,
    ]
    assert flight.executive.explored
    assert flight.executive.offboard_lost == 0
    assert np.hypot(*flight.vehicle.position[:2]) < 0.1
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_it_says_what_it_waits_for():
    flight = Flight().run_to(Phase.CHECKING)
    assert "waiting for its pre-arm checks" in flight.said


def test_a_failed_check_ends_before_anything_is_armed():
    flight = Flight()
    flight.problems = ("COM_OBL_RC_ACT is 0: set it to 5",)
    flight.run()
    assert flight.phase is Phase.ABORTED
    assert flight.vehicle.orders == []
    assert flight.problems[0] in flight.said


@pytest.mark.parametrize("end", [FlightEnd.LAND, FlightEnd.HOLD])
def test_the_end_is_what_the_mission_says(end):
    flight = Flight(end=end).run()
    assert flight.phase is (Phase.LANDED if end is FlightEnd.LAND else Phase.HANDED_OVER)
    assert np.allclose(flight.vehicle.position[:2], CORNERS[-1][:2], atol=0.2)
    assert flight.executive.explored


def test_without_a_proven_way_home_the_vehicle_returns_by_itself():
    flight = Flight().exploring()
    flight.no_way = "walled in"
    flight.tell(Operator.RETURN)
    flight.run()
    assert Phase.VEHICLE_RETURN in flight.phases
    assert flight.phase is Phase.LANDED


def test_without_a_proven_way_to_the_start_it_lands_where_it_took_off():
    flight = Flight()
    flight.no_way = "walled in"
    flight.run()
    assert flight.phase is Phase.LANDED
    assert Phase.TRANSIT not in flight.phases


def test_an_uploaded_mission_is_flown_by_the_vehicle_and_only_watched():
    flight = Flight(method=FlightMethod.MISSION)
    flight.places = (MissionPlace(1, (0.0, 0.0, 10.0)), MissionPlace(3, (20.0, 0.0, 10.0)))
    flight.run_to(Phase.AUTO_MISSION).run_for(5.0)
    assert flight.course is None
    flight.tell(Operator.PAUSE)
    flight.run_for(3.0)
    assert flight.vehicle.mode is FlightMode.HOLD
    flight.tell(Operator.RESUME)
    flight.run_for(3.0)
    assert flight.vehicle.mode is FlightMode.MISSION
    flight.tell(MissionProgress(2, 3))
    assert flight.phase is Phase.AUTO_MISSION
    flight.tell(MissionProgress(3, 3))
    flight.run()
    assert flight.phase is Phase.LANDED
    assert flight.executive.explored


def test_words_of_the_vehicle_are_passed_on():
    flight = Flight()
    flight.tell(StatusText(4, "Preflight Fail: compass"))
    assert flight.said == ["vehicle: Preflight Fail: compass"]


@pytest.mark.parametrize("seed", range(30))
def test_whatever_happens_in_whatever_order_the_flight_ends(seed):
    random = np.random.default_rng(seed)
    flight = Flight()
    for _ in range(12):
        flight.run_for(float(random.uniform(0.5, 15.0)))
        if flight.executive.finished:
            break
        match random.integers(9):
            case 0:
                flight.tell(random.choice(np.array([Operator.PAUSE, Operator.RESUME], dtype=object)))
            case 1:
                flight.tell(Operator.RETURN)
            case 2:
                flight.vehicle.silent = not flight.vehicle.silent
            case 3:
                flight.obstacle = flight.vehicle.position.copy() if flight.obstacle is FAR_AWAY else FAR_AWAY
            case 4:
                flight.vehicle.battery = float(random.uniform(0.1, 1.0))
            case 5:
                command = random.choice(np.array(list(Command), dtype=object))
                flight.vehicle.refuse[command] = ["denied"] * int(random.integers(1, 4))
            case 6:
                flight.no_way = "" if flight.no_way else "walled in"
            case 7:
                flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
            case 8:
                course = flight.executive.course
                if course is not None:
                    flight.learn(Sphere(course.motion_at(float(random.uniform(0.0, 40.0))).position_m, 2.0))
    flight.vehicle.silent = False
    flight.obstacle = FAR_AWAY
    flight.vehicle.refuse.clear()
    for wish in (Operator.RETURN, Operator.LAND):
        flight.run_for(60.0)
        if not flight.executive.finished:
            flight.tell(wish)
    flight.run()
    assert flight.phase in FINAL
    given_up = flight.executive.why == "the vehicle was never heard again"
    assert not flight.vehicle.armed or given_up or flight.phase is Phase.HANDED_OVER
    assert flight.course is None
