"""One item of a mission, a fence or a list of rally points, as a vehicle keeps it."""

from __future__ import annotations

import dataclasses
import math

from sim_bridge.codec import Message, mavlink
from sim_bridge.state import GeodeticPoint

Peer = tuple[int, int]
"""System and component of whoever is talked to."""

ABSOLUTE_FRAMES = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)
RELATIVE_FRAMES = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
PLACE_FRAMES = (*ABSOLUTE_FRAMES, *RELATIVE_FRAMES)
FENCE_POLYGONS = (
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
)
_LARGEST = 2**31 - 1
FENCE_CIRCLES = (mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)


@dataclasses.dataclass(frozen=True)
class Item:
    """What MISSION_ITEM_INT carries, without its addresses.

    Attributes:
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: p1 … p4.
        latitude_e7: 1e-7 degrees (p5 where the frame has no place).
        longitude_e7: Likewise (p6).
        altitude_m: As the frame says (p7).
        autocontinue: Whether the next item follows by itself.
    """

    command: int
    frame: int
    params: tuple[float, float, float, float]
    latitude_e7: int
    longitude_e7: int
    altitude_m: float
    autocontinue: int = 1

    @classmethod
    def from_message(cls, message: Message) -> Item:
        """Read MISSION_ITEM_INT or MISSION_ITEM, whose coordinates are degrees."""
        x, y = message.x, message.y
        if not isinstance(message, mavlink.MAVLink_mission_item_int_message):
            scale = 1e7 if message.frame in PLACE_FRAMES else 1.0
            x, y = (_whole(scale * value) for value in (x, y))
        params = (message.param1, message.param2, message.param3, message.param4)
        return cls(message.command, message.frame, params, x, y, message.z, message.autocontinue)

    def to_message(self, peer: Peer, seq: int, kind: int, as_int: bool, current: int = 0) -> Message:
        """Write it, in the form that was asked for."""
        head = (*peer, seq, self.frame, self.command, current, self.autocontinue, *self.params)
        if as_int:
            place = (self.latitude_e7, self.longitude_e7, self.altitude_m)
            return mavlink.MAVLink_mission_item_int_message(*head, *place, kind)
        scale = 1e-7 if self.frame in PLACE_FRAMES else 1.0
        place = (scale * self.latitude_e7, scale * self.longitude_e7, self.altitude_m)
        return mavlink.MAVLink_mission_item_message(*head, *place, kind)

    def place(self, home_amsl_m: float) -> GeodeticPoint:
        """Where it is; an altitude that is not a number is home's."""
        altitude_m = self.altitude_m if math.isfinite(self.altitude_m) else 0.0
        amsl_m = altitude_m if self.frame in ABSOLUTE_FRAMES else home_amsl_m + altitude_m
        return GeodeticPoint(self.latitude_e7 * 1e-7, self.longitude_e7 * 1e-7, amsl_m)


def unsigned(value: float, bits: int) -> int:
    """A number as C++ puts it into an unsigned field: its lowest bits, and nought if it is far too big."""
    return int(value) & ((1 << bits) - 1) if abs(value) <= _LARGEST else 0


def _whole(value: float) -> int:
    """The nearest number that fits the field."""
    return max(-_LARGEST, min(_LARGEST, round(value))) if math.isfinite(value) else 0
