"""Monitors on telemetry, the energy of the way home, and the checks before arming."""

import dataclasses
import math

import numpy as np
import pytest

from mission import preflight
from mission.course import Course
from mission.monitors import Alarm, Consumption, Energy, Monitors
from planner.problem import Limits
from sim_bridge.link_autopilot import Autopilot
from sim_bridge.state import FlightMode, LandedState, VehicleState

ENERGY = Energy(1200.0, 0.15, 8.0, 3.0, 1.5)
STATE = VehicleState(
    time_s=100.0,
    position_enu_m=(100.0, 0.0, 30.0),
    velocity_enu_mps=(0.0, 0.0, 0.0),
    yaw_enu_rad=0.0,
    armed=True,
    mode=FlightMode.EXTERNAL,
    mode_name="OFFBOARD",
    landed=LandedState.IN_AIR,
    battery_fraction=0.8,
    waiting_for=(),
    failsafe=False,
    home_enu_m=(0.0, 0.0, 0.0),
)
MONITORS = Monitors(
    clearance_m=lambda place: float(place[0]) - 50.0,
    least_clearance_m=1.0,
    fence_distance_m=lambda place: 200.0 - float(place[0]),
    fence_tolerance_m=1.0,
    max_track_error_m=3.0,
    energy=ENERGY,
    cruise_height_m=30.0,
)
WANTED = Limits(8.0, 3.0, 1.5, 3.0)


def alarms(place=(100.0, 0.0, 30.0), battery=0.8, course_at=None):
    state = dataclasses.replace(STATE, position_enu_m=place, battery_fraction=battery)
    point = None if course_at is None else Course.standing(course_at, 0.0, 0.0).at(0.0)
    consumption = Consumption.begin(1.0, 0.0, ENERGY)
    return MONITORS.alarms(state, (0.0, 0.0, 0.0), consumption, point)


def test_where_all_is_well_nothing_alarms():
    assert alarms(course_at=(101.0, 0.0, 30.0)) == ()


@pytest.mark.parametrize(
    ("changes", "alarm"),
    [
        ({"place": (201.5, 0.0, 30.0)}, Alarm.OUTSIDE),
        ({"place": (50.5, 0.0, 30.0)}, Alarm.TOO_CLOSE),
        ({"battery": 0.15}, Alarm.BATTERY_LOW),
        ({"course_at": (104.0, 0.0, 30.0)}, Alarm.OFF_TRACK),
    ],
)
def test_each_alarm_is_raised_by_what_it_is_about(changes, alarm):
    assert alarms(**changes) == (alarm,)


def test_the_fence_forgives_what_an_estimate_wanders():
    assert alarms(place=(200.5, 0.0, 30.0)) == ()


def test_the_way_home_takes_longer_from_farther_away_and_from_above():
    home = (0.0, 0.0, 0.0)
    near = ENERGY.way_home_s((10.0, 0.0, 30.0), home, 30.0)
    far = ENERGY.way_home_s((810.0, 0.0, 30.0), home, 30.0)
    high = ENERGY.way_home_s((10.0, 0.0, 60.0), home, 30.0)
    assert far - near == pytest.approx(1.15 * 100.0)
    assert high - near == pytest.approx(1.15 * 20.0)
    # From 30 m: 20 m at 1.5 m/s, the last 10 at 0.6.
    assert near == pytest.approx(1.15 * 10.0 / 8.0 + 20.0 / 1.5 + 10.0 / 0.6)


def test_consumption_is_what_the_file_says_until_enough_was_measured():
    consumption = Consumption.begin(1.0, 0.0, ENERGY)
    assert consumption.observed(0.9, 30.0, ENERGY).fraction_per_s == pytest.approx(1.0 / 1200.0)
    assert consumption.observed(0.98, 100.0, ENERGY).fraction_per_s == pytest.approx(1.0 / 1200.0)
    assert consumption.observed(0.8, 100.0, ENERGY).fraction_per_s == pytest.approx(0.002)


def test_a_thrifty_vehicle_is_not_believed_to_be_thriftier_than_the_file():
    assert Consumption.begin(1.0, 0.0, ENERGY).observed(0.95, 600.0, ENERGY).fraction_per_s == pytest.approx(1 / 1200.0)


def test_without_a_told_battery_there_is_no_battery_alarm():
    state = dataclasses.replace(STATE, battery_fraction=None)
    assert MONITORS.alarms(state, (0.0, 0.0, 0.0), None, None) == ()


def settings(autopilot=Autopilot.PX4, **parameters):
    return preflight.settings_of(autopilot, lambda name: parameters.get(name), WANTED)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"COM_OBL_RC_ACT": 0.0}, ("COM_OBL_RC_ACT is 0", "descends", "set it to 5")),
        ({"COM_OBL_RC_ACT": 2.0}, ("falls",)),
        ({"COM_OBL_RC_ACT": 6.0}, ("stops the motors",)),
        ({"COM_OF_LOSS_T": 30.0}, ("COM_OF_LOSS_T is 30", "too late", "set it to 1")),
        ({"COM_OF_LOSS_T": 0.1}, ("a short gap",)),
        ({"GF_ACTION": 0.0}, ("GF_ACTION is 0", "set it to 2")),
    ],
)
def test_px4_settings_that_are_not_safe_are_refused_with_the_parameter_to_change(parameters, words):
    (problem,) = settings(**parameters).problems
    for word in words:
        assert word in problem


@pytest.mark.parametrize("action", [3.0, 4.0, 5.0])
def test_safe_px4_settings_pass(action):
    assert settings(COM_OBL_RC_ACT=action, COM_OF_LOSS_T=1.0, GF_ACTION=2.0).problems == ()


def test_a_fence_without_a_consequence_is_refused_on_copter():
    (problem,) = settings(Autopilot.ARDUPILOT, FENCE_ENABLE=1.0, FENCE_ACTION=0.0).problems
    assert "FENCE_ACTION" in problem


def test_limits_are_the_smaller_of_the_two_and_it_is_said():
    found = settings(MPC_XY_VEL_MAX=5.0, MPC_Z_VEL_MAX_UP=9.0, MPC_Z_VEL_MAX_DN=1.0)
    assert found.limits == Limits(5.0, 3.0, 1.0, 3.0)
    assert len(found.notes) == 2


def test_copters_centimetres_are_metres():
    found = settings(Autopilot.ARDUPILOT, WPNAV_SPEED=500.0, WPNAV_ACCEL=250.0)
    assert found.limits.max_speed_mps == 5.0
    assert found.limits.max_acceleration_mps2 == 2.5


def test_a_curve_is_slowed_down_until_every_limit_holds():
    allowed = Limits(4.0, 3.0, 1.0, 1.5)
    factor = preflight.slowing_factor(WANTED, allowed)
    assert factor == pytest.approx(2.0)
    assert WANTED.max_acceleration_mps2 / factor**2 <= allowed.max_acceleration_mps2
    assert preflight.slowing_factor(WANTED, WANTED) == 1.0


class Field:
    """A wall at east 10."""

    keep_out_m = 2.0

    def __init__(self):
        self.obstacles = self

    def distance(self, points):
        return np.abs(points[:, 0] - 10.0)


def test_a_vehicle_at_another_place_is_refused():
    state = dataclasses.replace(STATE, position_enu_m=(3000.0, 0.0, 0.0))
    (problem,) = preflight.place_problems(state, (0.0, 0.0, 0.0), Field(), 20.0)
    assert "3000 m from the mission's home" in problem


def test_a_climb_beside_an_obstacle_is_refused():
    state = dataclasses.replace(STATE, position_enu_m=(9.0, 0.0, 0.0))
    (problem,) = preflight.place_problems(state, (9.0, 0.0, 0.0), Field(), 20.0)
    assert "1.0 m from an obstacle" in problem
    away = dataclasses.replace(STATE, position_enu_m=(0.0, 0.0, 0.0))
    assert preflight.place_problems(away, (0.0, 0.0, 0.0), Field(), 20.0) == []


def test_a_charge_that_does_not_last_is_refused_with_the_reckoning():
    state = dataclasses.replace(STATE, battery_fraction=0.5)
    (problem,) = preflight.energy_problems(state, ENERGY, 60.0, 400.0, 90.0)
    needed = math.ceil(100.0 * (550.0 / 1200.0 + 0.15))
    assert f"the flight needs {needed}%" in problem
    assert preflight.energy_problems(state, ENERGY, 60.0, 200.0, 90.0) == []
