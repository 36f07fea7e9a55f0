"""What a vehicle tells by itself: which messages, how often, and what is in them."""

from __future__ import annotations

import math

from sim_bridge.body import Body
from sim_bridge.codec import Message, mavlink

CELLS = 4
FULL_CELL_V = 4.2
EMPTY_CELL_V = 3.5
SENSORS = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS
    | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    | mavlink.MAV_SYS_STATUS_AHRS
)
READY = mavlink.MAV_SYS_STATUS_PREARM_CHECK


class Streams:
    """Which messages are due.

    Args:
        rates_hz: Message id to times a second.
    """

    def __init__(self, rates_hz: dict[int, float]) -> None:
        self._interval_s = {message: 1.0 / rate for message, rate in rates_hz.items() if rate > 0.0}
        self._due_s = dict.fromkeys(self._interval_s, 0.0)

    def set_interval(self, message_id: int, interval_us: float, default_hz: float, now_s: float) -> None:
        """MAV_CMD_SET_MESSAGE_INTERVAL: −1 stops, 0 is the default, else microseconds."""
        if interval_us < 0.0:
            self._interval_s.pop(message_id, None)
            self._due_s.pop(message_id, None)
            return
        self._interval_s[message_id] = 1e-6 * interval_us if interval_us > 0.0 else 1.0 / max(default_hz, 0.1)
        self._due_s[message_id] = now_s

    def interval_us(self, message_id: int) -> float:
        """How often a message comes; −1: not at all."""
        interval_s = self._interval_s.get(message_id)
        return -1.0 if interval_s is None else 1e6 * interval_s

    def due(self, now_s: float) -> list[int]:
        """Messages to send now."""
        found = []
        for message_id, due_s in self._due_s.items():
            if now_s >= due_s:
                interval_s = self._interval_s[message_id]
                self._due_s[message_id] = due_s + interval_s if now_s - due_s < interval_s else now_s + interval_s
                found.append(message_id)
        return found


def body_message(message_id: int, body: Body, now_s: float, ready: bool, landed_state: int) -> Message | None:
    """A message about the body; None: not one of these."""
    rotor = body.rotor
    boot_ms = int(now_s * 1e3)
    x, y, z = rotor.position_ned_m
    vx, vy, vz = rotor.velocity_ned_mps
    match message_id:
        case mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            return mavlink.MAVLink_local_position_ned_message(boot_ms, x, y, z, vx, vy, vz)
        case mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            here = body.geodetic()
            heading = round(math.degrees(rotor.yaw_rad) % 360.0 * 100.0) % 36000
            return mavlink.MAVLink_global_position_int_message(
                boot_ms, _e7(here.latitude_deg), _e7(here.longitude_deg), round(here.altitude_amsl_m * 1e3),
                round((body.home_ned_m[2] - z) * 1e3), _cm(vx), _cm(vy), _cm(vz), heading,
            )  # fmt: skip
        case mavlink.MAVLINK_MSG_ID_ATTITUDE:
            # Tilt as the acceleration asks for it, in the heading's frame.
            ax, ay, _ = rotor.acceleration_ned_mps2
            forward = ax * math.cos(rotor.yaw_rad) + ay * math.sin(rotor.yaw_rad)
            right = -ax * math.sin(rotor.yaw_rad) + ay * math.cos(rotor.yaw_rad)
            roll, pitch = math.atan2(right, 9.81), -math.atan2(forward, 9.81)
            return mavlink.MAVLink_attitude_message(boot_ms, roll, pitch, rotor.yaw_rad, 0.0, 0.0, 0.0)
        case mavlink.MAVLINK_MSG_ID_SYS_STATUS:
            health = SENSORS | (READY if ready else 0)
            voltage, percent = _battery(rotor.battery)
            return mavlink.MAVLink_sys_status_message(
                SENSORS | READY, SENSORS | READY, health, 200, round(voltage * 1e3), 1500, percent,
                0, 0, 0, 0, 0, 0,
            )  # fmt: skip
        case mavlink.MAVLINK_MSG_ID_BATTERY_STATUS:
            voltage, percent = _battery(rotor.battery)
            cells = [round(voltage / CELLS * 1e3)] * CELLS + [65535] * (10 - CELLS)
            return mavlink.MAVLink_battery_status_message(0, 1, 3, 32767, cells, 1500, -1, -1, percent)
        case mavlink.MAVLINK_MSG_ID_HOME_POSITION:
            home = body.geodetic(body.home_ned_m)
            return mavlink.MAVLink_home_position_message(
                _e7(home.latitude_deg), _e7(home.longitude_deg), round(home.altitude_amsl_m * 1e3),
                *body.home_ned_m, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0,
            )  # fmt: skip
        case mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN:
            origin = body.origin
            return mavlink.MAVLink_gps_global_origin_message(
                _e7(origin.latitude_deg), _e7(origin.longitude_deg), round(origin.altitude_amsl_m * 1e3)
            )
        case mavlink.MAVLINK_MSG_ID_GPS_RAW_INT:
            here = body.geodetic()
            speed = round(math.hypot(vx, vy) * 100.0)
            return mavlink.MAVLink_gps_raw_int_message(
                int(now_s * 1e6), mavlink.GPS_FIX_TYPE_3D_FIX, _e7(here.latitude_deg), _e7(here.longitude_deg),
                round(here.altitude_amsl_m * 1e3), 80, 120, min(speed, 65535), 0, 14,
            )  # fmt: skip
        case mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE:
            return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, landed_state)
        case mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS:
            good = 0x1F | 0x20 | 0x100
            return mavlink.MAVLink_estimator_status_message(
                int(now_s * 1e6), good, 0.1, 0.1, 0.1, 0.1, 0.0, 0.0, 0.4, 0.6
            )
        case mavlink.MAVLINK_MSG_ID_SYSTEM_TIME:
            return mavlink.MAVLink_system_time_message(0, boot_ms)
        case mavlink.MAVLINK_MSG_ID_VFR_HUD:
            speed = math.hypot(vx, vy)
            heading = int(math.degrees(rotor.yaw_rad)) % 360
            return mavlink.MAVLink_vfr_hud_message(speed, speed, heading, 40, body.geodetic().altitude_amsl_m, -vz)
        case _:
            return None


def status_texts(severity: int, text: str, text_id: int) -> list[Message]:
    """A line of text, in chunks of fifty bytes where it is longer."""
    data = text.encode()
    if len(data) < 50:
        return [mavlink.MAVLink_statustext_message(severity, data)]
    chunks = [data[start : start + 50] for start in range(0, len(data), 50)]
    if len(chunks[-1]) == 50:
        chunks.append(b"")
    return [mavlink.MAVLink_statustext_message(severity, chunk, text_id, number) for number, chunk in enumerate(chunks)]


def _battery(charge: float) -> tuple[float, int]:
    return CELLS * (EMPTY_CELL_V + (FULL_CELL_V - EMPTY_CELL_V) * charge), int(100.0 * charge)


def _e7(degrees: float) -> int:
    return round(degrees * 1e7)


def _cm(speed_mps: float) -> int:
    return max(-32768, min(32767, round(100.0 * speed_mps)))
