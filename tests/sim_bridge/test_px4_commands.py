"""PX4's heartbeat, commands, arming, parameters and telemetry, as MAVLink bytes show them."""

import math
import struct

import pytest
from pyproj import Proj

from sim_bridge.px4.vehicle import Px4
from sim_bridge.state import GeodeticPoint
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import (
    HOLD,
    LAND,
    MISSION,
    NAN,
    OFFBOARD,
    POSCTL,
    RETURN,
    TAKEOFF,
    GroundStation,
    mavlink,
)

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
TEMPORARILY_REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
READY_BIT = 0x10000000


def station(ready_after_s: float = 1.0, **config) -> GroundStation:
    gs = GroundStation(Px4(VehicleConfig(GROUND, ready_after_s=ready_after_s, **config)))
    gs.wait(ready_after_s + 3.0)
    return gs


def int_parameter(value) -> int:
    assert value.param_type == mavlink.MAV_PARAM_TYPE_INT32
    return struct.unpack("<i", struct.pack("<f", value.param_value))[0]


def test_the_heartbeat_comes_once_a_second_and_is_a_px4_quadrotors():
    gs = GroundStation(Px4(VehicleConfig(GROUND)))
    gs.wait(20.0)
    assert len(gs.all("HEARTBEAT")) in (20, 21)
    heartbeat = gs.last("HEARTBEAT")
    assert (heartbeat.autopilot, heartbeat.type) == (mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR)
    assert heartbeat.base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


def test_it_is_ready_some_36_seconds_after_boot():
    gs = GroundStation(Px4(VehicleConfig(GROUND)))
    gs.wait(30.0)
    assert gs.status == mavlink.MAV_STATE_UNINIT
    assert not any(status.onboard_control_sensors_health & READY_BIT for status in gs.all("SYS_STATUS"))
    gs.wait(10.0)
    assert gs.status == mavlink.MAV_STATE_STANDBY
    ready = [
        at_s for at_s, m in gs.heard if m.get_type() == "SYS_STATUS" and m.onboard_control_sensors_health & READY_BIT
    ]
    assert 34.0 <= ready[0] <= 38.0


def test_arming_before_it_is_ready_is_temporarily_rejected_and_says_why_in_two_chunks():
    gs = GroundStation(Px4(VehicleConfig(GROUND)))
    gs.wait(5.0)
    assert gs.arm() == TEMPORARILY_REJECTED
    assert "Arming denied" in gs.said
    chunks = gs.all("STATUSTEXT")[-2:]
    assert [chunk.chunk_seq for chunk in chunks] == [0, 1]
    assert chunks[0].id == chunks[1].id != 0
    gs.wait(40.0)
    assert gs.arm() == ACCEPTED


def test_the_heartbeat_shows_a_change_up_to_a_second_after_the_ack():
    gs = station()
    while gs.times("HEARTBEAT")[-1] < gs.now_s - 0.02:
        gs.wait(0.01)
    assert gs.arm() == ACCEPTED
    gs.wait(0.5)
    assert not gs.armed
    gs.wait(0.6)
    assert gs.armed
    assert gs.status == mavlink.MAV_STATE_ACTIVE


@pytest.mark.parametrize("mode", [POSCTL, HOLD, RETURN, LAND])
def test_modes_are_main_and_sub_mode(mode):
    gs = station()
    gs.take_off()
    assert gs.px4_mode(mode) == ACCEPTED
    gs.wait(1.1)
    assert gs.last("HEARTBEAT").custom_mode == mode[1] << 24 | mode[0] << 16


def test_take_off_is_above_sea_level_and_ends_in_hold():
    gs = station()
    home = gs.last("HOME_POSITION")
    assert gs.arm() == ACCEPTED
    target_amsl_m = home.altitude * 1e-3 + 15.0
    gs.command(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, target_amsl_m)
    gs.wait(3.0)
    assert gs.custom_mode == TAKEOFF
    assert gs.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_TAKEOFF
    gs.wait(20.0)
    assert gs.custom_mode == HOLD
    here = gs.last("GLOBAL_POSITION_INT")
    assert here.alt * 1e-3 == pytest.approx(target_amsl_m, abs=1.0)
    assert here.relative_alt * 1e-3 == pytest.approx(15.0, abs=1.0)
    assert gs.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_IN_AIR


def test_land_comes_down_where_it_is_and_disarms_by_itself():
    gs = station()
    gs.take_off(12.0)
    north, east, _ = gs.position
    assert gs.command(mavlink.MAV_CMD_NAV_LAND) == ACCEPTED
    gs.wait(5.0)
    assert gs.custom_mode == LAND
    assert gs.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_LANDING
    gs.wait_for(lambda: not gs.armed, within_s=40.0)
    assert gs.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    assert math.hypot(gs.position[0] - north, gs.position[1] - east) < 1.5
    assert "landing" in gs.said.lower()


def test_an_armed_vehicle_that_does_not_take_off_disarms_by_itself():
    gs = station()
    assert gs.arm() == ACCEPTED
    gs.wait(8.0)
    assert gs.armed
    gs.wait(5.0)
    assert not gs.armed


def test_disarming_in_the_air_is_refused_unless_forced():
    gs = station()
    gs.take_off()
    assert gs.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0) in (DENIED, TEMPORARILY_REJECTED)
    gs.wait(1.1)
    assert gs.armed
    assert "denied" in gs.said.lower()
    assert gs.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0) == ACCEPTED
    gs.wait(1.1)
    assert not gs.armed


def test_an_unknown_command_is_unsupported_and_one_for_another_system_fails():
    gs = station()
    assert gs.command(31999) == mavlink.MAV_RESULT_UNSUPPORTED
    assert gs.command(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT) == mavlink.MAV_RESULT_UNSUPPORTED
    assert gs.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, system=7) == mavlink.MAV_RESULT_FAILED
    gs.wait(1.1)
    assert not gs.armed


def test_a_mission_cannot_be_started_without_one():
    gs = station()
    gs.take_off()
    assert gs.px4_mode(MISSION) in (DENIED, TEMPORARILY_REJECTED)
    gs.wait(1.1)
    assert gs.custom_mode == HOLD


def test_parameters_travel_bytewise():
    gs = station()
    (asked,) = gs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"COM_OBL_RC_ACT", -1))
    assert int_parameter(asked) == 0
    five = struct.unpack("<f", struct.pack("<i", 5))[0]
    (told,) = gs.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", five, mavlink.MAV_PARAM_TYPE_INT32))
    assert int_parameter(told) == 5
    (real,) = gs.send(mavlink.MAVLink_param_set_message(1, 1, b"MPC_XY_CRUISE", 7.5, mavlink.MAV_PARAM_TYPE_REAL32))
    assert (real.param_type, real.param_value) == (mavlink.MAV_PARAM_TYPE_REAL32, 7.5)


def test_an_unknown_parameter_gets_no_reply():
    gs = station()
    assert gs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"NO_SUCH", -1)) == []


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("COM_OBL_RC_ACT", 0),
        ("COM_OF_LOSS_T", 1.0),
        ("GF_ACTION", 2),
        ("MPC_XY_CRUISE", 5.0),
        ("MPC_XY_VEL_MAX", 12.0),
        ("MPC_Z_VEL_MAX_UP", 3.0),
        ("MPC_Z_VEL_MAX_DN", 1.5),
        ("MPC_ACC_HOR", 3.0),
        ("MPC_ACC_HOR_MAX", 5.0),
        ("MPC_YAWRAUTO_MAX", 45.0),
        ("MPC_JERK_AUTO", 4.0),
        ("NAV_ACC_RAD", 10.0),
    ],
)
def test_parameters_have_px4s_defaults(name, value):
    gs = station()
    (told,) = gs.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
    assert (int_parameter(told) if isinstance(value, int) else told.param_value) == pytest.approx(value)


def test_the_list_of_parameters_is_complete_and_numbered():
    gs = station()
    values = gs.send(mavlink.MAVLink_param_request_list_message(1, 1))
    values += [m for m in gs.wait(10.0) if m.get_type() == "PARAM_VALUE"]
    assert sorted(value.param_index for value in values) == list(range(values[0].param_count))


def test_what_is_for_another_system_is_not_answered():
    gs = station()
    assert gs.send(mavlink.MAVLink_param_request_list_message(2, 1)) == []
    assert gs.send(mavlink.MAVLink_mission_request_list_message(2, 1, 0)) == []


def test_ping_and_timesync_are_answered():
    gs = station()
    (pong,) = gs.send(mavlink.MAVLink_ping_message(1234, 7, 0, 0))
    assert (pong.get_type(), pong.time_usec, pong.seq) == ("PING", 1234, 7)
    assert (pong.target_system, pong.target_component) == (245, 190)
    (sync,) = gs.send(mavlink.MAVLink_timesync_message(0, 987))
    assert (sync.get_type(), sync.ts1) == ("TIMESYNC", 987)
    assert sync.tc1 == pytest.approx(gs.now_s * 1e9, rel=1e-3)


def test_ftp_is_answered_with_a_nak():
    gs = station()
    payload = (9).to_bytes(2, "little") + bytes([0, 4, 5]) + b"\0" * 246
    (reply,) = gs.send(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
    data = bytes(reply.payload)
    assert int.from_bytes(data[:2], "little") == 10
    nak = 129
    assert (data[3], data[5]) == (nak, 4)
    assert (reply.target_system, reply.target_component) == (245, 190)


def test_the_version_is_told_on_request_and_says_1_15_2():
    gs = station()
    result = gs.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    assert result == ACCEPTED
    gs.wait(0.1)
    version = gs.last("AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 8 == 1 << 16 | 15 << 8 | 2
    for capability in (
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT,
        mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE,
        mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2,
    ):
        assert version.capabilities & capability


def test_the_messages_a_client_needs_come_by_themselves():
    gs = station()
    gs.take_off()
    gs.setpoint((0.0, 0.0, -20.0))
    gs.wait(1.0, do=lambda: gs.setpoint((0.0, 0.0, -20.0)))
    gs.px4_mode(OFFBOARD)
    gs.forget()
    gs.wait(10.0, do=lambda: gs.setpoint((0.0, 0.0, -20.0)))
    told = {message.get_type() for _, message in gs.heard}
    assert told >= {
        "HEARTBEAT", "SYS_STATUS", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE", "HOME_POSITION",
        "GPS_GLOBAL_ORIGIN", "EXTENDED_SYS_STATE", "BATTERY_STATUS", "POSITION_TARGET_LOCAL_NED",
        "MISSION_CURRENT", "ESTIMATOR_STATUS",
    }  # fmt: skip
    assert 280 <= len(gs.all("LOCAL_POSITION_NED")) <= 320
    status = gs.last("SYS_STATUS")
    assert status.onboard_control_sensors_health & 0x20
    assert status.onboard_control_sensors_health & READY_BIT


def test_message_rates_can_be_changed_stopped_and_asked_for():
    gs = station()
    which = mavlink.MAVLINK_MSG_ID_ATTITUDE
    assert gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, which, 20_000.0) == ACCEPTED
    assert gs.command(mavlink.MAV_CMD_GET_MESSAGE_INTERVAL, which) == ACCEPTED
    gs.wait(0.1)
    assert gs.last("MESSAGE_INTERVAL").interval_us == 20_000
    gs.forget()
    gs.wait(4.0)
    assert 190 <= len(gs.all("ATTITUDE")) <= 210
    assert gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, which, -1.0) == ACCEPTED
    gs.forget()
    gs.wait(2.0)
    assert gs.all("ATTITUDE") == []


def test_home_is_not_the_origin_and_lies_one_to_two_metres_off_in_height():
    gs = station()
    home, origin = gs.last("HOME_POSITION"), gs.last("GPS_GLOBAL_ORIGIN")
    assert 1.0 <= abs(home.altitude - origin.altitude) * 1e-3 <= 2.0
    assert (home.latitude, home.longitude) != (origin.latitude, origin.longitude)
    # LOCAL_NED counts from the origin: standing at home is not at zero.
    assert home.z == pytest.approx((origin.altitude - home.altitude) * 1e-3, abs=0.01)


def test_every_time_stamp_is_the_vehicles_time_since_boot():
    gs = station()
    gs.wait(5.0)
    for at_s, message in gs.heard:
        if message.get_type() in ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "ATTITUDE"):
            assert message.time_boot_ms * 1e-3 == pytest.approx(at_s, abs=0.011)


def test_the_battery_runs_down_in_the_time_it_says():
    gs = station()
    gs.take_off()
    before = gs.vehicle.body.rotor.battery
    gs.wait(120.0)
    used = before - gs.vehicle.body.rotor.battery
    assert used == pytest.approx(120.0 / 1200.0, rel=0.1)
    assert gs.last("BATTERY_STATUS").battery_remaining == pytest.approx(100.0 * gs.vehicle.body.rotor.battery, abs=1.0)


def test_a_return_climbs_crosses_and_lands_at_home():
    gs = station()
    gs.take_off(20.0)
    far = (60.0, -40.0, gs.position[2])
    gs.wait(1.0, do=lambda: gs.setpoint(far))
    gs.px4_mode(OFFBOARD)
    gs.wait(30.0, do=lambda: gs.setpoint(far))
    assert gs.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) == ACCEPTED
    heights = []
    gs.wait_for(lambda: heights.append(-gs.position[2]) or not gs.armed, within_s=240.0)
    home = gs.last("HOME_POSITION")
    assert math.hypot(gs.position[0] - home.x, gs.position[1] - home.y) < 1.5
    assert max(heights) > 20.0
    assert gs.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND


def test_a_long_command_is_in_progress_until_it_is_done():
    gs = station()
    assert gs.command(mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE, 1.0) == mavlink.MAV_RESULT_IN_PROGRESS
    gs.wait(10.0)
    assert gs.command(mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE, 1.0) == mavlink.MAV_RESULT_IN_PROGRESS
    assert 0 < gs.last("COMMAND_ACK").progress < 100
    gs.wait(15.0)
    assert gs.command(mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE, 1.0) == ACCEPTED


def test_the_estimate_wanders_by_the_better_part_of_a_metre():
    gs = station()
    offsets = []
    for _ in range(300):
        gs.wait(1.0)
        offsets.append(math.dist(gs.position, gs.vehicle.body.rotor.position_ned_m))
    assert 0.4 < max(offsets) < 1.2


def test_positions_of_the_map_are_those_of_a_sphere():
    gs = station()
    gs.take_off()
    far = (900.0, 700.0, -20.0)
    gs.wait(1.0, do=lambda: gs.setpoint(far))
    gs.px4_mode(OFFBOARD)
    gs.wait(150.0, do=lambda: gs.setpoint(far))
    here, origin = gs.last("GLOBAL_POSITION_INT"), gs.last("GPS_GLOBAL_ORIGIN")
    sphere = Proj(proj="aeqd", R=6_371_000.0, lat_0=origin.latitude * 1e-7, lon_0=origin.longitude * 1e-7)
    east, north = sphere(here.lon * 1e-7, here.lat * 1e-7)
    assert (north, east) == (pytest.approx(gs.position[0], abs=0.3), pytest.approx(gs.position[1], abs=0.3))
