"""What a vehicle tells about its batteries, as one charge."""

import pytest

from sim_bridge.codec import mavlink
from sim_bridge.frames import VehicleFrame
from sim_bridge.link.telemetry import Telemetry
from tests.sim_bridge.vehicle_messages import ORIGIN, complete, position


def battery(identity, percent, function=mavlink.MAV_BATTERY_FUNCTION_ALL):
    return mavlink.MAVLink_battery_status_message(identity, function, 3, 32767, [4000] * 10, 100, -1, -1, percent)


def charge_of(*messages):
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    for message in messages:
        telemetry.receive(message)
    (state,) = telemetry.receive(position(1033))
    return state.battery_fraction


def test_of_several_batteries_the_emptiest_counts_whichever_spoke_last():
    assert charge_of(battery(0, 30), battery(1, 70)) == 0.3
    assert charge_of(battery(1, 70), battery(0, 30)) == 0.3


def test_a_battery_that_falls_silent_is_not_forgotten():
    assert charge_of(battery(0, 30), battery(0, -1), battery(1, 70), battery(1, 69)) == 0.3


def test_a_battery_that_is_charged_or_changed_is_believed():
    assert charge_of(battery(0, 30), battery(0, 60)) == 0.6


def test_a_battery_of_the_payload_does_not_matter():
    assert charge_of(battery(1, 5, mavlink.MAV_BATTERY_FUNCTION_PAYLOAD)) == 0.77


def test_the_age_is_that_of_the_battery_that_was_silent_for_longest():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(position(2000))
    telemetry.receive(battery(0, 50))
    telemetry.receive(position(32_000))
    telemetry.receive(battery(1, 70))
    (state,) = telemetry.receive(position(42_000))
    assert state.battery_age_s == pytest.approx(42.0, abs=1.1)


def test_a_charge_that_is_not_told_after_a_restart_grows_old():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(position(500_000))
    telemetry.receive(battery(0, 50))
    telemetry.receive(position(1000))
    complete(telemetry)
    telemetry.receive(position(60_000))
    telemetry.receive(mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0))
    (state,) = telemetry.receive(position(61_000))
    assert state.battery_fraction == 0.5
    assert state.battery_age_s == pytest.approx(60.0)
