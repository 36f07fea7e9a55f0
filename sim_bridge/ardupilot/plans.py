"""How ArduPilot takes missions, fences and rally points: item by item into the old ones, rounded, and with a check."""

from __future__ import annotations

import dataclasses
import math

from sim_bridge.codec import mavlink
from sim_bridge.vehicle.plan_items import (
    ABSOLUTE_FRAMES,
    FENCE_CIRCLES,
    FENCE_POLYGONS,
    PLACE_FRAMES,
    RELATIVE_FRAMES,
    Item,
)
from sim_bridge.vehicle.plan_storage import Manners

_MISSION, _FENCE, _RALLY = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)
_INVALID_PARAM = (
    mavlink.MAV_MISSION_INVALID_PARAM1,
    mavlink.MAV_MISSION_INVALID_PARAM2,
    mavlink.MAV_MISSION_INVALID_PARAM3,
    mavlink.MAV_MISSION_INVALID_PARAM4,
)
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


def _check(kind: int, item: Item) -> int:
    if item.command not in _COMMANDS[kind]:
        return mavlink.MAV_MISSION_UNSUPPORTED
    if item.frame not in (*PLACE_FRAMES, mavlink.MAV_FRAME_MISSION):
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    if kind == _RALLY and item.frame not in RELATIVE_FRAMES:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    for index, value in enumerate(item.params):
        if not math.isfinite(value) and index not in _MAY_BE_NAN.get(item.command, ()):
            return _INVALID_PARAM[index]
    if item.frame in PLACE_FRAMES:
        if abs(item.latitude_e7) > 900_000_000:
            return mavlink.MAV_MISSION_INVALID_PARAM5_X
        if abs(item.longitude_e7) > 1_800_000_000:
            return mavlink.MAV_MISSION_INVALID_PARAM6_Y
    if not math.isfinite(item.altitude_m):
        return mavlink.MAV_MISSION_INVALID_PARAM7
    return mavlink.MAV_MISSION_ACCEPTED


def _kept(kind: int, item: Item) -> Item:
    """Whole seconds and metres, centimetres of altitude, no headings, no radii; frames without `_INT`."""
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


ARDUPILOT_MANNERS = Manners(
    asks_int=False,
    retry_s=1.0,
    give_up_s=8.0,
    gives_up_with_ack=True,
    busy=mavlink.MAV_MISSION_DENIED,
    out_of_turn=mavlink.MAV_MISSION_INVALID_SEQUENCE,
    repeats_last_ack=False,
    replaces_in_place=True,
    most_items={_MISSION: 650, _FENCE: 84, _RALLY: 84},
    check=_check,
    kept=_kept,
)
