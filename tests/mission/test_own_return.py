"""What the vehicle's own return takes, against the built-in vehicles, and what is kept in the battery for it."""

import dataclasses
import math

import numpy as np
import pytest

from mission.executive.energy import Consumption
from mission.executive.events import Checked
from mission.executive.monitors import Alarm
from mission.executive.own_return import SETTLING_S, Cone, OwnReturn
from mission.executive.phases import Phase
from mission.flying import preflight
from mission.flying.return_settings import copter_return, px4_return
from mission.flying.vehicle_settings import Reach, settings_of
from mission.flying.ways import along
from mission.site.descent import Descent
from planner.problem import Limits
from sim_bridge.ardupilot import defaults as ardupilot_defaults
from sim_bridge.dialects import Autopilot
from sim_bridge.px4 import defaults as px4_defaults
from tests.mission.flying_vehicle import ENERGY, STATE
from tests.mission.rehearsed_flight import Flight
from tests.mission.test_monitors import MONITORS
from tests.sim_bridge import test_ardupilot as copter
from tests.sim_bridge import test_px4_plans as px4
from tests.sim_bridge.ground_station import OFFBOARD, POSITION_ONLY, RETURN

HOME = (0.0, 0.0, 0.0)
PLACES_NED_M = [(120.0, 0.0, -12.0), (0.0, -40.0, -5.0), (12.0, 0.0, -8.0), (60.0, 0.0, -80.0)]


def px4_alone_s(away, parameters) -> float:
    gs = px4.station(parameters=parameters)
    gs.take_off(5.0)
    gs.wait(1.0, do=lambda: gs.setpoint(away, mask=POSITION_ONLY))
    gs.px4_mode(OFFBOARD)
    gs.wait(70.0, do=lambda: gs.setpoint(away, mask=POSITION_ONLY))
    assert math.dist(gs.position, away) < 1.0
    gs.px4_mode(RETURN)
    return seconds_to_the_ground(gs)


def copter_alone_s(away, parameters) -> float:
    gs = copter.station(parameters=parameters)
    copter.take_off(gs, 5.0)
    for _ in range(70):
        gs.setpoint(away, mask=POSITION_ONLY)
        gs.wait(1.0)
    assert math.dist(gs.position, away) < 1.0
    assert copter.set_mode(gs, copter.RTL) == copter.ACCEPTED
    return seconds_to_the_ground(gs)


def seconds_to_the_ground(gs) -> float:
    begun_s = gs.vehicle.body.time_s
    gs.wait_for(lambda: gs.vehicle.body.on_ground, within_s=400.0)
    return gs.vehicle.body.time_s - begun_s


@pytest.mark.parametrize("away", PLACES_NED_M)
@pytest.mark.parametrize(
    ("alone_s", "read", "defaults", "changes"),
    [
        (px4_alone_s, px4_return, px4_defaults.PARAMETERS, {}),
        (px4_alone_s, px4_return, px4_defaults.PARAMETERS, {"RTL_RETURN_ALT": 20.0, "MPC_LAND_SPEED": 0.4}),
        (copter_alone_s, copter_return, ardupilot_defaults.PARAMETERS, {}),
        (copter_alone_s, copter_return, ardupilot_defaults.PARAMETERS, {"RTL_ALT": 4000, "RTL_SPEED": 300}),
    ],
    ids=["px4", "px4, set otherwise", "ardupilot", "ardupilot, set otherwise"],
)
def test_a_vehicle_left_alone_is_home_within_what_is_reckoned_and_little_sooner(alone_s, read, defaults, changes, away):
    north, east, down = away
    reckoned_s = read((defaults | changes).get).home_s((east, north, -down), HOME)
    took_s = alone_s(away, tuple(changes.items()))
    # The built-in vehicles settle at once.
    assert 0.85 * (reckoned_s - SETTLING_S) - 2.0 < took_s < reckoned_s


@pytest.mark.parametrize(
    ("station", "changes", "ends_m"),
    [(px4, {"RTL_LAND_DELAY": -1.0, "RTL_RETURN_ALT": 25.0}, 25.0), (copter, {"RTL_ALT_FINAL": 300}, 3.0)],
    ids=["px4", "ardupilot"],
)
def test_the_built_in_vehicle_stays_up_where_its_parameters_say_so(station, changes, ends_m):
    gs = station.station(parameters=tuple(changes.items()))
    away = (40.0, 0.0, -8.0)
    if station is px4:
        gs.take_off(5.0)
        gs.wait(1.0, do=lambda: gs.setpoint(away, mask=POSITION_ONLY))
        gs.px4_mode(OFFBOARD)
        gs.wait(20.0, do=lambda: gs.setpoint(away, mask=POSITION_ONLY))
        gs.px4_mode(RETURN)
    else:
        copter.take_off(gs, 5.0)
        gs.setpoint(away, mask=POSITION_ONLY)
        gs.wait(20.0)
        copter.set_mode(gs, copter.RTL)
    gs.wait(120.0)
    assert gs.armed
    assert math.hypot(*gs.position[:2]) < 1.0
    assert gs.vehicle.body.rotor.height_m == pytest.approx(ends_m, abs=1.0)


def test_right_above_home_no_more_is_reckoned_than_a_climb_that_px4_leaves_out():
    away = (3.0, 0.0, -8.0)
    reckoned_s = px4_return(px4_defaults.PARAMETERS.get).home_s((0.0, 3.0, 8.0), HOME)
    assert 0.3 * reckoned_s < px4_alone_s(away, ()) < reckoned_s


def test_it_goes_up_across_waits_and_comes_down():
    own = OwnReturn(30.0, 5.0, 2.0, Descent(1.5, 0.5, 10.0), "", wait_s=5.0)
    down_s = SETTLING_S + 20.0 / 1.5 + 10.0 / 0.5
    assert own.home_s((100.0, 0.0, 10.0), HOME) == pytest.approx(1.15 * (20.0 / 2.0 + 100.0 / 5.0) + 5.0 + down_s)
    assert own.home_s((100.0, 0.0, 60.0), HOME) == pytest.approx(1.15 * 100.0 / 5.0 + 5.0 + down_s + 30.0 / 1.5)


def test_near_home_it_climbs_less():
    own = OwnReturn(60.0, 5.0, 2.0, Descent(1.5), "", cone=Cone(slope=1.0, within_m=10.0, least_m=5.0))
    everywhere = dataclasses.replace(own, cone=None)
    assert own.home_s((8.0, 0.0, 2.0), HOME) < everywhere.home_s((8.0, 0.0, 2.0), HOME) - 40.0
    assert own.home_s((11.0, 0.0, 2.0), HOME) == everywhere.home_s((11.0, 0.0, 2.0), HOME)


def test_what_makes_no_sense_is_as_from_the_factory():
    usual = px4_return({}.get), copter_return({}.get)
    assert px4_return(lambda _: math.nan) == usual[0]
    assert copter_return(lambda _: -1.0) == usual[1]
    # A speed of zero would be a return that never ends.
    for read in (px4_return, copter_return):
        assert math.isfinite(read(lambda _: 0.0).home_s((50.0, 0.0, 5.0), HOME))


def test_the_charge_is_kept_for_whichever_way_home_takes_longer():
    state = dataclasses.replace(STATE, position_enu_m=(100.0, 0.0, 30.0))
    consumption = Consumption.begin(0.23, 0.0, ENERGY)
    assert MONITORS.alarms(state, HOME, consumption, None) == ()
    high = px4_return({"RTL_RETURN_ALT": 180.0}.get)
    alone = dataclasses.replace(MONITORS, energy=ENERGY.told(high))
    assert alone.alarms(state, HOME, consumption, None) == (Alarm.BATTERY_LOW,)
    # To the least charge that brings it home, with the reserve.
    enough = high.home_s(state.position_enu_m, HOME) / ENERGY.endurance_s + 0.5 * ENERGY.reserve_fraction
    for share, found in ((0.999, (Alarm.BATTERY_LOW,)), (1.001, ())):
        assert alone.alarms(state, HOME, Consumption.begin(share * enough, 0.0, ENERGY), None) == found


def test_a_flight_that_turns_back_for_it_says_how_long_it_takes_and_by_which_parameters():
    flight = Flight()
    flight.run_to(Phase.CHECKING)
    # From nowhere would so slow a return end before the battery does.
    slow = dataclasses.replace(px4_return({}.get), cruise_mps=0.02)
    flight.tell(Checked((), energy=flight.executive.monitors.energy.told(slow)))
    flight.run_to(Phase.RETURNING)
    (said,) = [text for text in flight.said if "the charge left is less" in text]
    assert "own return takes" in said
    assert "MPC_XY_CRUISE and RTL_RETURN_ALT" in said


def test_the_vehicle_lands_as_slowly_as_it_says():
    slow = dataclasses.replace(px4_return({}.get), descent=Descent(9.0, 0.3, 12.0))
    told = ENERGY.told(slow)
    # Never faster than the mission's own limits.
    assert told.descent == Descent(ENERGY.descent.fast_mps, 0.3, 12.0)
    assert told.way_home_s(HOME, HOME, 10.0) > ENERGY.way_home_s(HOME, HOME, 10.0)


def test_a_charge_that_does_not_last_for_a_vehicle_that_is_left_alone_is_refused_and_why():
    # Far out in the middle of the path, and back at home at its end.
    curve = along(np.array([[0.0, 0.0, 20.0], [600.0, 0.0, 20.0], [5.0, 0.0, 20.0]]), Limits(8.0, 3.0, 1.5, 3.0))
    own = OwnReturn(30.0, 2.0, 2.0, Descent(1.5), "RTL_SPEED and RTL_ALT")
    energy = ENERGY.told(own)
    far_s = 0.5 * curve.duration_s + own.home_s((600.0, 0.0, 20.0), HOME)
    needed = (30.0 + far_s) / energy.endurance_s + 0.5 * energy.reserve_fraction

    def found(charge):
        return preflight.own_return_problems(charge, energy, 30.0, curve, curve.start_s, HOME)

    assert found(needed + 0.002) == []
    (problem,) = found(needed - 0.002)
    assert f"its own return takes {own.home_s((600.0, 0.0, 20.0), HOME):.0f} s from there" in problem
    assert "RTL_SPEED and RTL_ALT" in problem
    # From the end alone it would be enough.
    assert (30.0 + curve.duration_s + own.home_s((5.0, 0.0, 20.0), HOME)) / energy.endurance_s < needed - 0.1
    half_way_s = 0.5 * (curve.start_s + curve.end_s)
    assert preflight.own_return_problems(needed - 0.05, energy, 30.0, curve, half_way_s, HOME) == []


@pytest.mark.parametrize(
    ("autopilot", "changes", "words"),
    [
        (Autopilot.PX4, {"RTL_LAND_DELAY": -1.0}, "RTL_LAND_DELAY is -1"),
        (Autopilot.ARDUPILOT, {"RTL_ALT_FINAL": 500.0}, "RTL_ALT_FINAL is 500"),
    ],
)
def test_a_return_that_does_not_end_on_the_ground_is_said(autopilot, changes, words):
    defaults = {Autopilot.PX4: px4_defaults.PARAMETERS, Autopilot.ARDUPILOT: ardupilot_defaults.PARAMETERS}[autopilot]
    wanted, reach = Limits(5.0, 2.0, 1.0, 2.0), Reach(80.0, 40.0, 0.0)
    before, after = (settings_of(autopilot, (defaults | more).get, wanted, reach).notes for more in ({}, changes))
    (note,) = set(after) - set(before)
    assert words in note
    assert "never lands" in note
    assert "set it to 0" in note
