"""What a vehicle tells by itself: which messages, how often, and what is in them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

from sim_bridge.codec import Message, mavlink
from sim_bridge.state import GRAVITY_MPS2, Vector
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.kinematics import STILL, Target

CELLS = 4
FULL_CELL_V = 4.2
EMPTY_CELL_V = 3.5
_NO_CELL_MV = 65535
_LARGEST_FLOAT = 3.4e38
_SENSORS = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS
    | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    | mavlink.MAV_SYS_STATUS_AHRS
)
_READY = mavlink.MAV_SYS_STATUS_PREARM_CHECK
# Attitude, both velocities, horizontal position relative and absolute, vertical position absolute.
_ESTIMATOR_GOOD = 1 | 2 | 4 | 8 | 16 | 32
_ESTIMATOR_LOST = 1 | 4 | 32


class Streams:
    """Which messages are due.

    Args:
        rates_hz: Message id to times a second.
    """

    def __init__(self, rates_hz: Mapping[int, float]) -> None:
        self._interval_s = {message: 1.0 / rate for message, rate in rates_hz.items() if rate > 0.0}
        self._due_s = dict.fromkeys(self._interval_s, 0.0)
        self.silent: set[int] = set()
        """Messages that do not come out though they should."""

    def set_interval(self, message_id: int, interval_us: float, default_hz: float, now_s: float) -> None:
        """MAV_CMD_SET_MESSAGE_INTERVAL: −1 stops, 0 is the default rate, else microseconds."""
        interval_s = 1e-6 * interval_us if interval_us > 0.0 else 1.0 / default_hz if default_hz > 0.0 else 0.0
        if interval_us < 0.0 or interval_s <= 0.0:
            self._interval_s.pop(message_id, None)
            self._due_s.pop(message_id, None)
            return
        self._interval_s[message_id] = interval_s
        self._due_s[message_id] = now_s

    def interval_us(self, message_id: int) -> int:
        """How often a message comes; −1: not at all."""
        interval_s = self._interval_s.get(message_id)
        return -1 if interval_s is None else min(2**31 - 1, round(1e6 * interval_s))

    def due(self, now_s: float) -> list[int]:
        """Messages to send now."""
        found = []
        for message_id, due_s in self._due_s.items():
            if now_s >= due_s:
                interval_s = self._interval_s[message_id]
                self._due_s[message_id] = due_s + interval_s if now_s - due_s < interval_s else now_s + interval_s
                if message_id not in self.silent:
                    found.append(message_id)
        return found


@dataclasses.dataclass(frozen=True)
class Standing:
    """What the autopilot adds to the body's messages.

    Attributes:
        boot_s: Time since boot.
        ready: Whether it can be armed.
        tells_checks: Whether it says that it has pre-arm checks; PX4 only says when they are passed.
        landed_state: MAV_LANDED_STATE.
        target: What it steers for; None: nothing.
    """

    boot_s: float
    ready: bool
    tells_checks: bool
    landed_state: int
    target: Target | None


def body_message(message_id: int, body: Body, standing: Standing) -> Message | None:
    """A message about the body; None: not one of these."""
    maker = _MAKERS.get(message_id)
    return None if maker is None else maker(body, standing)


def cell_volts(charge: float) -> float:
    """Voltage of a cell at a charge of 0 … 1."""
    return EMPTY_CELL_V + (FULL_CELL_V - EMPTY_CELL_V) * charge


def _local_position(body: Body, standing: Standing) -> Message:
    return mavlink.MAVLink_local_position_ned_message(_ms(standing), *body.position_ned_m, *body.rotor.velocity_ned_mps)


def _global_position(body: Body, standing: Standing) -> Message:
    here = body.geodetic()
    vx, vy, vz = body.rotor.velocity_ned_mps
    heading = round(math.degrees(body.rotor.yaw_rad) % 360.0 * 100.0) % 36000
    return mavlink.MAVLink_global_position_int_message(
        _ms(standing), _e7(here.latitude_deg), _e7(here.longitude_deg), _mm(here.altitude_amsl_m),
        _mm(here.altitude_amsl_m - body.home_amsl_m), _cm(vx), _cm(vy), _cm(vz), heading,
    )  # fmt: skip


def _attitude(body: Body, standing: Standing) -> Message:
    """Tilted as the acceleration needs it."""
    ax, ay, _ = body.rotor.acceleration_ned_mps2
    yaw = body.rotor.yaw_rad
    forward = ax * math.cos(yaw) + ay * math.sin(yaw)
    right = -ax * math.sin(yaw) + ay * math.cos(yaw)
    pitch = -math.atan2(forward, GRAVITY_MPS2)
    roll = math.atan2(right * math.cos(pitch), GRAVITY_MPS2)
    return mavlink.MAVLink_attitude_message(_ms(standing), roll, pitch, yaw, 0.0, 0.0, 0.0)


def _system_status(body: Body, standing: Standing) -> Message:
    health = _SENSORS | (_READY if standing.ready else 0)
    if not body.estimator.has_gps:
        health &= ~mavlink.MAV_SYS_STATUS_SENSOR_GPS
    present = _SENSORS | (_READY if standing.tells_checks else 0)
    return mavlink.MAVLink_sys_status_message(
        present, present, health, 200, round(1e3 * _volts(body)), 1500, _percent(body),
        0, 0, 0, 0, 0, 0,
    )  # fmt: skip


def _battery_status(body: Body, standing: Standing) -> Message:
    del standing
    cells = [round(1e3 * _volts(body) / CELLS)] * CELLS + [_NO_CELL_MV] * (10 - CELLS)
    return mavlink.MAVLink_battery_status_message(0, 1, 3, 32767, cells, 1500, -1, -1, _percent(body))


def _home_position(body: Body, standing: Standing) -> Message:
    del standing
    home = body.geodetic(body.home_ned_m)
    return mavlink.MAVLink_home_position_message(
        _e7(home.latitude_deg), _e7(home.longitude_deg), _mm(home.altitude_amsl_m),
        *_fitting(body.home_ned_m), [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0,
    )  # fmt: skip


def _global_origin(body: Body, standing: Standing) -> Message:
    del standing
    origin = body.origin
    return mavlink.MAVLink_gps_global_origin_message(
        _e7(origin.latitude_deg), _e7(origin.longitude_deg), _mm(origin.altitude_amsl_m)
    )


def _gps_raw(body: Body, standing: Standing) -> Message:
    here = body.geodetic()
    fix, satellites = (mavlink.GPS_FIX_TYPE_3D_FIX, 14) if body.estimator.has_gps else (mavlink.GPS_FIX_TYPE_NO_FIX, 0)
    speed = min(65535, round(100.0 * math.hypot(*body.rotor.velocity_ned_mps[:2])))
    return mavlink.MAVLink_gps_raw_int_message(
        int(standing.boot_s * 1e6), fix, _e7(here.latitude_deg), _e7(here.longitude_deg), _mm(here.altitude_amsl_m),
        80, 120, speed, 0, satellites,
    )  # fmt: skip


def _extended_state(body: Body, standing: Standing) -> Message:
    del body
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, standing.landed_state)


def _estimator_status(body: Body, standing: Standing) -> Message:
    flags = _ESTIMATOR_GOOD if body.position_valid else _ESTIMATOR_LOST
    return mavlink.MAVLink_estimator_status_message(
        int(standing.boot_s * 1e6), flags, 0.1, 0.1, 0.1, 0.1, 0.0, 0.0, 0.4, 0.6
    )


def _system_time(body: Body, standing: Standing) -> Message:
    del body
    return mavlink.MAVLink_system_time_message(0, _ms(standing))


def _hud(body: Body, standing: Standing) -> Message:
    del standing
    vx, vy, vz = body.rotor.velocity_ned_mps
    speed, heading = math.hypot(vx, vy), int(math.degrees(body.rotor.yaw_rad)) % 360
    throttle = 40 if body.armed and not body.on_ground else 0
    return mavlink.MAVLink_vfr_hud_message(speed, speed, heading, throttle, body.geodetic().altitude_amsl_m, -vz)


def _position_target(body: Body, standing: Standing) -> Message | None:
    del body
    target = standing.target
    if target is None:
        return None
    mask = sum(1 << axis for axis, value in enumerate(target.position_ned_m) if value is None)
    x, y, z = (0.0 if value is None else value for value in target.position_ned_m)
    return mavlink.MAVLink_position_target_local_ned_message(
        _ms(standing), mavlink.MAV_FRAME_LOCAL_NED, mask, *_fitting((x, y, z)),
        *_fitting(target.velocity_ned_mps or STILL), *_fitting(target.acceleration_ned_mps2),
        target.yaw_rad or 0.0, 0.0,
    )  # fmt: skip


_MAKERS = {
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _local_position,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _global_position,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: _attitude,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: _system_status,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: _battery_status,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: _home_position,
    mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: _global_origin,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: _gps_raw,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: _extended_state,
    mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: _estimator_status,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: _system_time,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: _hud,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: _position_target,
}


def _volts(body: Body) -> float:
    return CELLS * cell_volts(body.rotor.battery)


def _percent(body: Body) -> int:
    return int(100.0 * body.rotor.battery)


def _ms(standing: Standing) -> int:
    return int(1e3 * standing.boot_s + 0.5) & 0xFFFFFFFF


def _fitting(vector: Vector) -> Vector:
    """What fits the fields: absurd places can be asked for."""
    x, y, z = (max(-_LARGEST_FLOAT, min(_LARGEST_FLOAT, value)) for value in vector)
    return x, y, z


def _e7(degrees: float) -> int:
    return max(-(2**31), min(2**31 - 1, round(degrees * 1e7)))


def _mm(metres: float) -> int:
    return max(-(2**31), min(2**31 - 1, round(metres * 1e3)))


def _cm(speed_mps: float) -> int:
    return max(-32768, min(32767, round(100.0 * speed_mps)))
