"""Monitors on telemetry, and the energy of the way home."""

import dataclasses

import numpy as np
import pytest

from mission.executive.course import Course
from mission.executive.energy import Consumption, ProvenHome
from mission.executive.monitors import Alarm, Monitors
from mission.executive.own_return import OwnReturn
from mission.flying.ways import along
from mission.site.descent import Descent
from planner.problem import Limits
from tests.mission.flying_vehicle import ENERGY, STATE

MONITORS = Monitors(
    clearance_m=lambda places: places[..., 0] - 50.0,
    least_clearance_m=1.0,
    fence_distance_m=lambda place: 200.0 - float(place[0]),
    fence_tolerance_m=1.0,
    max_track_error_m=3.0,
    track_margin_m=1.0,
    energy=ENERGY,
    cruise_height_m=30.0,
)


def alarms(place=(100.0, 0.0, 30.0), battery=0.8, course_at=None):
    state = dataclasses.replace(STATE, position_enu_m=place)
    point = None if course_at is None else Course.standing(course_at, 0.0, 0.0).at(0.0)
    consumption = Consumption.begin(battery, 0.0, ENERGY)
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


def test_the_charge_is_kept_for_the_proven_way_home_where_that_is_longer_than_the_straight_one():
    state = dataclasses.replace(STATE, position_enu_m=(100.0, 0.0, 30.0))
    consumption = Consumption.begin(0.3, 0.0, ENERGY)

    def alarmed(proven, rate=1.0):
        return MONITORS.alarms(state, (0.0, 0.0, 0.0), consumption, None, rate, proven)

    assert alarmed(ProvenHome((100.0, 0.0, 30.0), 20.0)) == ()
    assert alarmed(ProvenHome((100.0, 0.0, 30.0), 160.0)) == (Alarm.BATTERY_LOW,)
    assert alarmed(ProvenHome((100.0, 0.0, 30.0), 100.0)) == ()
    assert alarmed(ProvenHome((100.0, 0.0, 30.0), 100.0), rate=0.5) == (Alarm.BATTERY_LOW,)


def test_what_is_left_of_a_proven_way_home_grows_with_the_distance_and_does_not_shrink_until_it_is_sought_again():
    proven, home = ProvenHome((100.0, 0.0, 0.0), 60.0), (0.0, 0.0, 0.0)
    assert proven.left_s((180.0, 0.0, 0.0), home, ENERGY, 1.0) == pytest.approx(60.0 + 80.0 / 8.0)
    assert proven.left_s((20.0, 0.0, 0.0), home, ENERGY, 1.0) == pytest.approx(60.0)


def test_the_way_home_takes_longer_from_farther_away_and_from_above():
    home = (0.0, 0.0, 0.0)
    near = ENERGY.way_home_s((10.0, 0.0, 30.0), home, 30.0)
    far = ENERGY.way_home_s((810.0, 0.0, 30.0), home, 30.0)
    high = ENERGY.way_home_s((10.0, 0.0, 60.0), home, 30.0)
    assert far - near == pytest.approx(1.15 * 100.0)
    assert high - near == pytest.approx(1.15 * 20.0)
    # From 30 m: 20 m at 1.5 m/s, the last 10 at 0.5.
    assert near == pytest.approx(1.15 * 10.0 / 8.0 + 20.0 / 1.5 + 10.0 / 0.5)


def test_consumption_is_what_the_file_says_until_enough_was_measured():
    consumption = Consumption.begin(1.0, 0.0, ENERGY)
    assert consumption.observed(0.9, 30.0, ENERGY).fraction_per_s == pytest.approx(1.0 / 1200.0)
    assert consumption.observed(0.98, 100.0, ENERGY).fraction_per_s == pytest.approx(1.0 / 1200.0)
    assert consumption.observed(0.8, 100.0, ENERGY).fraction_per_s == pytest.approx(0.002)


def test_a_thrifty_vehicle_is_not_believed_to_be_thriftier_than_the_file():
    assert Consumption.begin(1.0, 0.0, ENERGY).observed(0.95, 600.0, ENERGY).fraction_per_s == pytest.approx(1 / 1200.0)


def test_a_charge_that_was_never_told_is_a_low_one():
    assert MONITORS.alarms(STATE, (0.0, 0.0, 0.0), None, None) == (Alarm.BATTERY_LOW,)


def test_where_home_is_not_known_the_reserve_is_kept_all_the_same():
    low, enough = (Consumption.begin(charge, 0.0, ENERGY) for charge in (0.15, 0.16))
    assert MONITORS.alarms(STATE, None, low, None) == (Alarm.BATTERY_LOW,)
    assert MONITORS.alarms(STATE, None, enough, None) == ()


@pytest.mark.parametrize(("told", "left"), [(0.9, 0.4), (0.4, 0.4), (0.3, 0.3)])
def test_the_charge_is_the_smaller_of_what_is_told_and_what_the_endurance_leaves(told, left):
    assert Consumption.begin(0.9, 0.0, ENERGY).observed(told, 600.0, ENERGY).left_fraction == pytest.approx(left)


@pytest.mark.parametrize("rate", [1.0, 0.5])
@pytest.mark.parametrize("own_return", [None, OwnReturn(60.0, 2.0, 1.0, Descent(1.0), "slow")])
def test_the_charge_is_spare_along_a_curve_where_no_moment_of_it_calls_home(own_return, rate):
    # Farthest out in the middle, where the way home takes most, and back at its end, where most is flown.
    curve = along(np.array([[0.0, 0.0, 40.0], [150.0, 0.0, 40.0], [0.0, 0.0, 40.0]]), Limits(5.0, 2.0, 1.5, 3.0))
    home, from_s, begins_in_s = (0.0, 0.0, 0.0), 7.0, 12.0
    clear = dataclasses.replace(MONITORS, clearance_m=lambda places: np.full(places.shape[:-1], 50.0))
    monitors = clear if own_return is None else dataclasses.replace(clear, energy=ENERGY.told(own_return))

    def spare(left):
        consumption = Consumption.begin(left, 0.0, ENERGY)
        return monitors.spare_fraction(curve, from_s, begins_in_s, home, consumption, rate)

    def called_home(left):
        for curve_s in np.linspace(from_s, curve.end_s, 200):
            flown_s = begins_in_s + (curve_s - from_s) / rate
            place = dataclasses.replace(STATE, position_enu_m=tuple(curve.motion_at(curve_s).position_m.tolist()))
            consumption = Consumption.begin(left - flown_s / ENERGY.endurance_s, 0.0, ENERGY)
            if monitors.alarms(place, home, consumption, None, rate):
                return True
        return False

    enough = 0.9 - spare(0.9)
    assert spare(enough) == pytest.approx(0.0, abs=1e-12)
    assert 0.2 < enough < 0.9
    # The curve is looked at every second, in which a vehicle comes 5 m farther out.
    assert not called_home(enough + 0.005)
    assert called_home(enough - 0.001)
