"""What ArduCopter answers, to whom, and what it refuses, as MAVLink bytes show it."""

import math

import pytest

from tests.sim_bridge.ground_station import NAN, mavlink
from tests.sim_bridge.test_ardupilot import (
    ACCEPTED,
    GROUND,
    GUIDED,
    STABILIZE,
    mode,
    set_mode,
    station,
    take_off,
)
from tests.sim_bridge.test_ardupilot_plans import item, upload

FAILED = mavlink.MAV_RESULT_FAILED


def test_guided_then_arming_then_take_off_is_the_only_order():
    gs = station()
    height = (0, 0, 0, 0, 0, 0, 15.0)
    assert gs.command(mavlink.MAV_CMD_NAV_TAKEOFF, *height) == FAILED
    assert gs.arm() == ACCEPTED
    assert mode(gs) == STABILIZE
    assert gs.command(mavlink.MAV_CMD_NAV_TAKEOFF, *height) == FAILED
    assert gs.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0) == ACCEPTED
    assert set_mode(gs, GUIDED) == ACCEPTED
    assert gs.command(mavlink.MAV_CMD_NAV_TAKEOFF, *height) == FAILED
    assert gs.arm() == ACCEPTED
    assert gs.command(mavlink.MAV_CMD_NAV_TAKEOFF, *height) == ACCEPTED
    gs.wait(20.0)
    assert gs.vehicle.body.rotor.height_m == pytest.approx(15.0, abs=1.5)
    gs.wait(5.0, do=lambda: gs.setpoint((30.0, 0.0, -20.0)))
    assert gs.velocity[0] > 2.0


def test_a_command_for_another_system_is_neither_obeyed_nor_answered():
    gs = station()
    set_guided = (1.0, float(GUIDED), 0, 0, 0, 0, 0)
    for message in (
        mavlink.MAVLink_command_long_message(7, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, *set_guided),
        mavlink.MAVLink_command_int_message(7, 1, 0, mavlink.MAV_CMD_DO_SET_MODE, 0, 0, *set_guided),
        mavlink.MAVLink_command_long_message(7, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1.0, *(0,) * 6),
        mavlink.MAVLink_param_request_list_message(7, 1),
        mavlink.MAVLink_mission_request_list_message(7, 1, 0),
    ):
        assert gs.send(message) == []
    gs.wait(1.1)
    assert mode(gs) == STABILIZE
    assert not gs.armed


def test_setpoints_for_another_system_move_nothing():
    gs = station()
    take_off(gs)
    before = gs.position
    gs.wait(6.0, do=lambda: gs.setpoint((60.0, 0.0, -20.0), system=7))
    assert math.dist(gs.position, before) < 1.0


def test_ping_and_timesync_are_answered():
    gs = station()
    (pong,) = gs.send(mavlink.MAVLink_ping_message(1234, 7, 0, 0))
    assert (pong.get_type(), pong.time_usec, pong.seq) == ("PING", 1234, 7)
    (sync,) = gs.send(mavlink.MAVLink_timesync_message(0, 987))
    assert (sync.get_type(), sync.ts1) == ("TIMESYNC", 987)
    assert sync.tc1 == pytest.approx(gs.now_s * 1e9, rel=1e-3)
    # An answer is not answered.
    assert gs.send(mavlink.MAVLink_timesync_message(1, 987)) == []


def test_ftp_is_answered_with_a_nak_and_the_version_on_request():
    gs = station()
    payload = (9).to_bytes(2, "little") + bytes([0, 4, 5]) + b"\0" * 246
    (reply,) = gs.send(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
    nak = 129
    assert bytes(reply.payload)[3] == nak
    assert gs.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == ACCEPTED
    version = gs.last("AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 16 == 4 << 8 | 5
    assert version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST


def test_all_that_a_client_needs_comes_when_it_is_asked_for():
    gs = station()
    kinds = (
        "SYS_STATUS", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE", "HOME_POSITION", "GPS_GLOBAL_ORIGIN",
        "EXTENDED_SYS_STATE", "BATTERY_STATUS", "POSITION_TARGET_LOCAL_NED", "MISSION_CURRENT",
    )  # fmt: skip
    for kind in kinds:
        which = getattr(mavlink, f"MAVLINK_MSG_ID_{kind}")
        assert gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, which, 100_000.0) == ACCEPTED
    take_off(gs)
    gs.forget()
    gs.wait(10.0, do=lambda: gs.setpoint((0.0, 0.0, -20.0)))
    assert 9 <= len(gs.all("HEARTBEAT")) <= 11
    for kind in kinds:
        assert 95 <= len(gs.all(kind)) <= 105, kind
    health = gs.last("SYS_STATUS").onboard_control_sensors_health
    assert health & 0x20
    assert health & 0x10000000


@pytest.mark.parametrize(
    ("command", "refused"),
    [
        (mavlink.MAV_CMD_NAV_WAYPOINT, {0, 1, 2}),
        (mavlink.MAV_CMD_NAV_TAKEOFF, {0, 1, 2}),
        (mavlink.MAV_CMD_NAV_LAND, {1, 2}),
        (mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, {0, 1, 2, 3}),
        (mavlink.MAV_CMD_DO_CHANGE_SPEED, {0, 1, 2, 3}),
    ],
)
def test_nan_in_a_parameter_that_is_not_used_may_be_refused_and_nought_is_taken(command, refused):
    gs = station()
    assert upload(gs, [item(0), item(1, command=command)]) == mavlink.MAV_MISSION_ACCEPTED
    invalid = mavlink.MAV_MISSION_INVALID_PARAM1
    for place in range(4):
        params = tuple(NAN if index == place else 0.0 for index in range(4))
        verdict = upload(gs, [item(0), item(1, command=command, params=params)])
        assert verdict == (invalid + place if place in refused else mavlink.MAV_MISSION_ACCEPTED)


def test_heights_come_back_in_whole_centimetres_above_home():
    gs = station()
    upload(gs, [item(0), item(1, height_m=20.12345)])
    (back,) = gs.send(mavlink.MAVLink_mission_request_int_message(1, 1, 1, 0))
    assert back.frame == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    assert back.z == pytest.approx(20.12, abs=1e-4)
    assert (back.x, back.y) == (round(GROUND.latitude_deg * 1e7), round(GROUND.longitude_deg * 1e7))
