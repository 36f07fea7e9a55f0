"""How ArduPilot takes missions, fences and rally points: item by item into the old ones, rounded, and with a check."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from sim_bridge.codec import mavlink
from sim_bridge.vehicle.plan_items import (
    ABSOLUTE_FRAMES,
    FENCE_CIRCLES,
    FENCE_POLYGONS,
    PLACE_FRAMES,
    RELATIVE_FRAMES,
    Item,
    unsigned,
)

_MISSION, _FENCE, _RALLY = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)
MOST_ITEMS = {_MISSION: 650, _FENCE: 84, _RALLY: 84}
"""By kind of plan; more are refused."""

_INVALID_PARAM = (
    mavlink.MAV_MISSION_INVALID_PARAM1,
    mavlink.MAV_MISSION_INVALID_PARAM2,
    mavlink.MAV_MISSION_INVALID_PARAM3,
    mavlink.MAV_MISSION_INVALID_PARAM4,
)
_POLE_E7 = 900_000_000
# Which of p1 … p4 may be NaN, by command; of all others none.
_MAY_BE_NAN = {
    mavlink.MAV_CMD_NAV_WAYPOINT: (3,),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: (3,),
    mavlink.MAV_CMD_NAV_LAND: (0, 3),
    mavlink.MAV_CMD_NAV_TAKEOFF: (3,),
}
_COMMANDS = {
    _MISSION: (
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
        mavlink.MAV_CMD_NAV_LOITER_TURNS,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT,
        mavlink.MAV_CMD_NAV_DELAY,
        mavlink.MAV_CMD_CONDITION_DELAY,
        mavlink.MAV_CMD_CONDITION_YAW,
        mavlink.MAV_CMD_DO_JUMP,
        mavlink.MAV_CMD_DO_CHANGE_SPEED,
        mavlink.MAV_CMD_DO_SET_HOME,
        mavlink.MAV_CMD_DO_LAND_START,
        mavlink.MAV_CMD_DO_SET_ROI,
        mavlink.MAV_CMD_DO_DIGICAM_CONTROL,
        mavlink.MAV_CMD_DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
    ),
    _FENCE: (*FENCE_POLYGONS, *FENCE_CIRCLES, mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT),
    _RALLY: (mavlink.MAV_CMD_NAV_RALLY_POINT,),
}


def check(kind: int, item: Item, count: int) -> int:
    """MAV_MISSION_ACCEPTED, or why an item of an upload of so many is refused; a fence is judged as a whole."""
    if item.command not in _COMMANDS[kind]:
        return mavlink.MAV_MISSION_UNSUPPORTED
    placed = item.frame in PLACE_FRAMES
    if not placed and (kind != _MISSION or item.frame != mavlink.MAV_FRAME_MISSION):
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    if kind == _FENCE:
        return mavlink.MAV_MISSION_ACCEPTED
    if kind == _RALLY and item.frame not in RELATIVE_FRAMES:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    for index, value in enumerate(item.params):
        if not math.isfinite(value) and index not in _MAY_BE_NAN.get(item.command, ()):
            return _INVALID_PARAM[index]
    if placed and abs(item.latitude_e7) > _POLE_E7:
        return mavlink.MAV_MISSION_INVALID_PARAM5_X
    if placed and abs(item.longitude_e7) > 2 * _POLE_E7:
        return mavlink.MAV_MISSION_INVALID_PARAM6_Y
    if not math.isfinite(item.altitude_m):
        return mavlink.MAV_MISSION_INVALID_PARAM7
    if item.command == mavlink.MAV_CMD_DO_JUMP and not 1 <= unsigned(item.params[0], 16) < count:
        return mavlink.MAV_MISSION_ERROR
    return mavlink.MAV_MISSION_ACCEPTED


def fence_fault(items: Sequence[Item]) -> str:
    """Why a whole fence is refused; empty: it is not."""
    index = 0
    while index < len(items):
        item, length = items[index], 1
        if item.command in FENCE_POLYGONS:
            length = _corners(item)
            ring = items[index : index + length]
            if length < 3:
                return f"Invalid vertex count ({length})"
            if any((each.command, _corners(each)) != (item.command, length) for each in ring):
                return f"Unexpected vertex in a polygon of {length}"
            if len(ring) < length:
                return "Incorrect item count"
        elif item.command in FENCE_CIRCLES and not item.params[0] > 0.0:
            return "Non-positive circle radius"
        index += length
    if any(abs(item.latitude_e7) > _POLE_E7 or abs(item.longitude_e7) > 2 * _POLE_E7 for item in items):
        return "Bad lat or lon"
    return ""


def _corners(item: Item) -> int:
    """How many corners a vertex says that its polygon has."""
    return unsigned(item.params[0], 8)


def kept(kind: int, item: Item) -> Item:
    """Whole seconds and metres, centimetres of altitude, no headings, no radii; frames without `_INT`."""
    if kind == _FENCE and item.command in FENCE_POLYGONS:
        return dataclasses.replace(item, params=(float(_corners(item)), 0.0, 0.0, 0.0))
    if kind != _MISSION or item.frame not in PLACE_FRAMES:
        return item
    absolute = item.frame in ABSOLUTE_FRAMES
    p1, p2, p3, _ = item.params
    if item.command == mavlink.MAV_CMD_NAV_WAYPOINT:
        p2 = p3 = 0.0
    return dataclasses.replace(
        item,
        frame=mavlink.MAV_FRAME_GLOBAL if absolute else mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        params=(*(float(int(value)) if math.isfinite(value) else 0.0 for value in (p1, p2, p3)), 0.0),
        altitude_m=round(100.0 * item.altitude_m) / 100.0,
    )
