"""What differs between PX4 and ArduPilot, seen from the ground: mode numbers, parameters, how things are asked for."""

from __future__ import annotations

import enum

from sim_bridge.state import FlightMode

_PX4_MAIN = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE"}
_PX4_AUTO = {
    1: ("AUTO.READY", FlightMode.OTHER),
    2: ("AUTO.TAKEOFF", FlightMode.TAKEOFF),
    3: ("AUTO.HOLD", FlightMode.HOLD),
    4: ("AUTO.MISSION", FlightMode.MISSION),
    5: ("AUTO.RTL", FlightMode.RETURN),
    6: ("AUTO.LAND", FlightMode.LAND),
    8: ("AUTO.FOLLOW_TARGET", FlightMode.OTHER),
    9: ("AUTO.PRECLAND", FlightMode.LAND),
}
_COPTER = {
    0: ("STABILIZE", FlightMode.PILOT),
    1: ("ACRO", FlightMode.PILOT),
    2: ("ALT_HOLD", FlightMode.PILOT),
    3: ("AUTO", FlightMode.MISSION),
    4: ("GUIDED", FlightMode.EXTERNAL),
    5: ("LOITER", FlightMode.PILOT),
    6: ("RTL", FlightMode.RETURN),
    7: ("CIRCLE", FlightMode.OTHER),
    9: ("LAND", FlightMode.LAND),
    16: ("POSHOLD", FlightMode.PILOT),
    17: ("BRAKE", FlightMode.HOLD),
    21: ("SMART_RTL", FlightMode.RETURN),
    27: ("AUTO_RTL", FlightMode.RETURN),
}


class Autopilot(enum.Enum):
    """Whose dialect a vehicle speaks (MAV_AUTOPILOT)."""

    PX4 = 12
    ARDUPILOT = 3


def flight_mode(autopilot: Autopilot, custom_mode: int) -> tuple[FlightMode, str]:
    """What a heartbeat's custom mode means, and the autopilot's name for it."""
    match autopilot:
        case Autopilot.PX4:
            main, sub = (custom_mode >> 16) & 0xFF, (custom_mode >> 24) & 0xFF
            if main == 4:
                name, mode = _PX4_AUTO.get(sub, (f"AUTO.{sub}", FlightMode.OTHER))
                return mode, name
            name = _PX4_MAIN.get(main, f"mode {main}.{sub}")
            if main == 6:
                return FlightMode.EXTERNAL, name
            return (FlightMode.PILOT if main in _PX4_MAIN else FlightMode.OTHER), name
        case Autopilot.ARDUPILOT:
            name, mode = _COPTER.get(custom_mode, (f"mode {custom_mode}", FlightMode.OTHER))
            return mode, name


GUIDED = 4
"""Copter's mode for setpoints, take-off commands and holding a place."""
BRAKE = 17
"""Copter's mode that stops and stays without anyone's sticks; LOITER would follow a throttle that is not there."""
