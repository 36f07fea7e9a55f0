"""Flying an uploaded mission, item after item; nothing in it was checked for sense, as on the real vehicles."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sim_bridge.body import Body
from sim_bridge.codec import Message, mavlink
from sim_bridge.guidance import climb, go_to, is_at
from sim_bridge.kinematics import Target
from sim_bridge.plan_storage import item_lat_lon_e7
from sim_bridge.state import GeodeticPoint, Vector

REACHED_HEIGHT_M = 0.8
_ABSOLUTE = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)


class MissionRun:
    """Where a mission stands.

    Args:
        first: Index of the first item to fly (ArduPilot's item 0 is home).
    """

    def __init__(self, first: int = 0) -> None:
        self.first = first
        self.current = first
        self.reached: int | None = None
        self.ends_with: int | None = None
        """MAV_CMD of a LAND or RETURN item that was come to."""
        self._arrived_s: float | None = None
        self._speed_mps: float | None = None

    def restart(self, at: int | None = None) -> None:
        """Begin again, or go on from an item."""
        self.current = self.first if at is None else at
        self.reached = self.ends_with = self._arrived_s = None

    def target(
        self, items: Sequence[Message], body: Body, now_s: float, cruise_mps: float, radius_m: float
    ) -> Target | None:
        """What to do now; None: the mission is over (or ends with `ends_with`)."""
        while self.current < len(items):
            item = items[self.current]
            match item.command:
                case mavlink.MAV_CMD_NAV_WAYPOINT | mavlink.MAV_CMD_NAV_LOITER_TIME:
                    place = self._place(item, body)
                    wanted = (
                        item.param2 if item.command == mavlink.MAV_CMD_NAV_WAYPOINT and item.param2 > 0 else radius_m
                    )
                    if self._stays(is_at(body, place, wanted, REACHED_HEIGHT_M), item.param1, now_s):
                        return go_to(body, place, self._speed_mps or cruise_mps)
                case mavlink.MAV_CMD_NAV_TAKEOFF:
                    x, y, _ = body.rotor.position_ned_m
                    place = (x, y, self._place(item, body)[2])
                    if self._stays(is_at(body, place, math.inf, REACHED_HEIGHT_M), 0.0, now_s):
                        return climb(place, place[2], 1.5, body.rotor.yaw_rad)
                case mavlink.MAV_CMD_NAV_LAND | mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                    self.ends_with = item.command
                    return None
                case mavlink.MAV_CMD_DO_CHANGE_SPEED:
                    self._speed_mps = item.param2 if item.param2 > 0.0 else None
                    self.current += 1
                case _:
                    self.current += 1
        return None

    def _stays(self, arrived: bool, hold_s: float, now_s: float) -> bool:
        """Whether to go on with this item; else the next is current."""
        if arrived and self._arrived_s is None:
            self._arrived_s = now_s
            self.reached = self.current
        if self._arrived_s is not None and now_s - self._arrived_s >= (hold_s if math.isfinite(hold_s) else 0.0):
            self.current += 1
            self._arrived_s = None
            return False
        return True

    @staticmethod
    def _place(item: Message, body: Body) -> Vector:
        latitude_e7, longitude_e7 = item_lat_lon_e7(item)
        home = body.geodetic(body.home_ned_m).altitude_amsl_m
        altitude = item.z if math.isfinite(item.z) else home
        amsl = altitude if item.frame in _ABSOLUTE else home + altitude
        return body.local_ned(GeodeticPoint(latitude_e7 * 1e-7, longitude_e7 * 1e-7, amsl))
