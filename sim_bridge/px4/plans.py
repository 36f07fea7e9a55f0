"""How PX4 takes missions, fences and rally points: nearly anything is accepted."""

from __future__ import annotations

import dataclasses
import math

from sim_bridge.codec import mavlink
from sim_bridge.vehicle.plan_items import (
    ABSOLUTE_FRAMES,
    FENCE_CIRCLES,
    FENCE_POLYGONS,
    PLACE_FRAMES,
    Item,
    unsigned,
)

_MISSION, _FENCE, _RALLY = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)
MOST_ITEMS = {_MISSION: 2000, _FENCE: 64, _RALLY: 32}
"""By kind of plan; more are refused."""

_FENCE_ITEMS = (*FENCE_POLYGONS, *FENCE_CIRCLES, mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT)
_PLACES = (
    mavlink.MAV_CMD_NAV_WAYPOINT,
    mavlink.MAV_CMD_NAV_LOITER_UNLIM,
    mavlink.MAV_CMD_NAV_LOITER_TIME,
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
    mavlink.MAV_CMD_NAV_LAND,
    mavlink.MAV_CMD_NAV_TAKEOFF,
    mavlink.MAV_CMD_DO_SET_ROI,
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION,
    mavlink.MAV_CMD_CONDITION_GATE,
    mavlink.MAV_CMD_NAV_RALLY_POINT,
    *_FENCE_ITEMS,
)
_DEEDS = (
    mavlink.MAV_CMD_DO_JUMP,
    mavlink.MAV_CMD_DO_CHANGE_SPEED,
    mavlink.MAV_CMD_DO_SET_HOME,
    mavlink.MAV_CMD_DO_LAND_START,
    mavlink.MAV_CMD_DO_DIGICAM_CONTROL,
    mavlink.MAV_CMD_DO_MOUNT_CONFIGURE,
    mavlink.MAV_CMD_DO_MOUNT_CONTROL,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
    mavlink.MAV_CMD_IMAGE_START_CAPTURE,
    mavlink.MAV_CMD_IMAGE_STOP_CAPTURE,
    mavlink.MAV_CMD_VIDEO_START_CAPTURE,
    mavlink.MAV_CMD_VIDEO_STOP_CAPTURE,
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
    mavlink.MAV_CMD_SET_CAMERA_MODE,
    mavlink.MAV_CMD_NAV_DELAY,
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
    mavlink.MAV_CMD_DO_SET_ROI_NONE,
    mavlink.MAV_CMD_CONDITION_DELAY,
    mavlink.MAV_CMD_CONDITION_DISTANCE,
)
_TURNED_BY_P4 = (
    mavlink.MAV_CMD_NAV_WAYPOINT,
    mavlink.MAV_CMD_NAV_LOITER_UNLIM,
    mavlink.MAV_CMD_NAV_LAND,
    mavlink.MAV_CMD_NAV_TAKEOFF,
)


def check(kind: int, item: Item) -> int:
    """MAV_MISSION_ACCEPTED, or why an item is refused.

    No look at the numbers: a latitude of 95, a NaN or a place 50 km away passes.
    """
    if item.frame in PLACE_FRAMES:
        if item.command not in _PLACES:
            return mavlink.MAV_MISSION_UNSUPPORTED
    elif item.frame == mavlink.MAV_FRAME_MISSION:
        if item.command not in _DEEDS:
            return mavlink.MAV_MISSION_UNSUPPORTED
    else:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    misplaced = kind == _MISSION and item.command in (*_FENCE_ITEMS, mavlink.MAV_CMD_NAV_RALLY_POINT)
    too_few = kind == _FENCE and item.command in FENCE_POLYGONS and _corners(item) < 3
    if misplaced or too_few:
        return mavlink.MAV_MISSION_ERROR
    if kind == _RALLY and item.frame != mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    return mavlink.MAV_MISSION_ACCEPTED


def _corners(item: Item) -> int:
    """How many corners a vertex says that its polygon has."""
    return unsigned(item.params[0] + 0.5, 16)


def kept(kind: int, item: Item) -> Item:
    """Global frames come back as their integer twins, headings between 0 and 360 degrees, counts as whole numbers."""
    if item.frame not in PLACE_FRAMES:
        return item
    absolute = item.frame in ABSOLUTE_FRAMES
    frame = mavlink.MAV_FRAME_GLOBAL_INT if absolute else mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
    p1, p2, p3, p4 = item.params
    if kind == _MISSION and item.command in _TURNED_BY_P4 and math.isfinite(p4):
        p4 %= 360.0
    if kind == _FENCE and item.command in FENCE_POLYGONS:
        p1 = float(_corners(item))
    return dataclasses.replace(item, frame=frame, params=(p1, p2, p3, p4))
