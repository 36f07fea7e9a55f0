"""Messages of a vehicle, for the parts of the link that need none."""

import os

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.link.telemetry import READY_BIT, Telemetry
from sim_bridge.state import GeodeticPoint

ORIGIN = GeodeticPoint(47.3977, 8.5456, 488.0)


def heartbeat(custom_mode: int = 4 << 16 | 3 << 24, armed: bool = False, status: int = 3, autopilot: int = 12):
    base = 1 | (128 if armed else 0)
    return mavlink.MAVLink_heartbeat_message(2, autopilot, base, custom_mode, status, 3)


def position(time_ms: int, x: float = 0.0, y: float = 0.0, z: float = 0.0):
    return mavlink.MAVLink_local_position_ned_message(time_ms, x, y, z, 1.0, 2.0, 3.0)


def home(altitude_amsl_m: float):
    millimetres = round(1e3 * altitude_amsl_m)
    return mavlink.MAVLink_home_position_message(473977000, 85456000, millimetres, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)


def complete(telemetry: Telemetry) -> None:
    for message in (
        heartbeat(),
        mavlink.MAVLink_gps_global_origin_message(473977000, 85456000, 488000),
        home(489.5),
        mavlink.MAVLink_attitude_message(900, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0),
        mavlink.MAVLink_sys_status_message(READY_BIT, READY_BIT, READY_BIT, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_extended_sys_state_message(0, 2),
        position(1000),
    ):
        telemetry.receive(message)
