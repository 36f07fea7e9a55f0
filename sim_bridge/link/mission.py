"""Missions, fences and rally points: uploaded, read back, and compared by what they mean.

An accepted upload proves nothing: PX4 accepts latitude 95 and a fence that does not hold its home, and says so in a
text afterwards or not at all; ArduPilot stores in its own frame and rounds. So everything is read back and compared,
and after a fence the vehicle's words are listened to. PX4 judges a fence only where it is another than the one it
holds: it is cleared first.

A transfer that failed is tried again after a silence: PX4 drops what is left of one five seconds after the last word,
and takes every word before that for part of it; ArduPilot drops another station's after eight.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence

from mavsdk.plugins.geofence import Geofence, GeofenceError
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw, MissionRawError
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.dialects import Autopilot
from sim_bridge.link.client import Link, LinkError
from sim_bridge.state import GeodeticPoint

# A ten-millionth of a degree is a centimetre; ArduPilot keeps heights in centimetres.
_SAME_DEG = 2e-6
_SAME_M = 0.1
_SAME_PARAM = 0.02
_LISTEN_S = 1.0
_TRIES = 5
_PX4_DROPS_AFTER_S = 5.5
_ARDUPILOT_DROPS_ANOTHERS_AFTER_S = 8.5
_PAUSE_S = 0.3
_PASSING = ("BUSY", "DENIED", "ERROR", "INVALID_SEQUENCE", "PROTOCOL_ERROR", "TIMEOUT", "TRANSFER_CANCELLED", "UNKNOWN")
"""What another try may do away with."""
_HELD_UP = (
    f", {_TRIES} times; another ground station may be in the middle of a transfer: let it end, or restart the vehicle"
)
_PLACES = (
    mavlink.MAV_CMD_NAV_WAYPOINT,
    mavlink.MAV_CMD_NAV_TAKEOFF,
    mavlink.MAV_CMD_NAV_LAND,
    mavlink.MAV_CMD_NAV_RALLY_POINT,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
)


@dataclasses.dataclass(frozen=True)
class Item:
    """One item of a mission, fence or rally list.

    Attributes:
        command: MAV_CMD.
        params: p1 … p4; None: left to the autopilot.
        place: Where, with its altitude above sea level; None: the command has no place.
    """

    command: int
    params: tuple[float | None, float | None, float | None, float | None] = (0.0, 0.0, 0.0, 0.0)
    place: GeodeticPoint | None = None


def upload_mission(link: Link, items: Sequence[Item]) -> int:
    """Upload a mission and check that it is the one the vehicle holds.

    Returns:
        The number of the first of these items in the vehicle's own counting.

    Raises:
        LinkError: It was refused, or what was read back means something else.
    """
    raw = MissionRaw(link.system)
    listed = list(items)
    first = 0
    if link.autopilot is Autopilot.ARDUPILOT:
        # Its item 0 is home, whatever is sent.
        listed, first = [Item(mavlink.MAV_CMD_NAV_WAYPOINT, place=_home(link)), *listed], 1
    _upload(link, "mission", listed, mavlink.MAV_MISSION_TYPE_MISSION, raw.upload_mission, raw.download_mission, first)
    return first


def upload_fence(
    link: Link, inclusion: Sequence[GeodeticPoint], exclusions: Sequence[Sequence[GeodeticPoint]] = ()
) -> None:
    """Upload a fence: a polygon to stay in and polygons to stay out of.

    Raises:
        LinkError: It was refused, read back differently, or the vehicle says that it does not hold.
    """
    raw = MissionRaw(link.system)

    def send(packed: list[MissionItem]) -> None:
        # Clearing is acknowledged to whom PX4 talked with last: reading first makes that us.
        if link.autopilot is Autopilot.PX4 and raw.download_geofence():
            Geofence(link.system).clear_geofence()
        raw.upload_geofence(packed)

    items = _ring(mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, inclusion)
    for polygon in exclusions:
        items += _ring(mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION, polygon)
    began_s = time.monotonic()
    _upload(link, "fence", items, mavlink.MAV_MISSION_TYPE_FENCE, send, raw.download_geofence)
    time.sleep(_LISTEN_S)
    said = [text for text in link.texts_since(began_s) if _complains(text)]
    if said:
        raise LinkError(f'the vehicle took the fence and says that it does not hold: "{"; ".join(said)}"')


def upload_rally_points(link: Link, points: Sequence[GeodeticPoint]) -> None:
    """Upload rally points.

    Raises:
        LinkError: They were refused, or read back differently.
    """
    raw = MissionRaw(link.system)
    items = [Item(mavlink.MAV_CMD_NAV_RALLY_POINT, place=point) for point in points]
    _upload(
        link, "rally points", items, mavlink.MAV_MISSION_TYPE_RALLY, raw.upload_rally_points, raw.download_rallypoints
    )


def _ring(command: int, polygon: Sequence[GeodeticPoint]) -> list[Item]:
    return [Item(command, (float(len(polygon)), 0.0, 0.0, 0.0), point) for point in polygon]


def _complains(text: str) -> bool:
    lowered = text.lower()
    return "fence" in lowered and any(word in lowered for word in ("invalid", "outside", "violat", "home"))


def _home(link: Link) -> GeodeticPoint:
    if link.home is None:
        raise LinkError("the vehicle has not told where its home is")
    return link.home


def _upload(
    link: Link,
    what: str,
    items: Sequence[Item],
    kind: int,
    send: Callable[[list[MissionItem]], object],
    fetch: Callable[[], list[MissionItem]],
    skip: int = 0,
) -> None:
    wanted = [_packed(item, number, kind, link) for number, item in enumerate(items)]
    held = _round_trip(link, what, wanted, send, fetch, _TRIES)
    if (difference := _difference(wanted[skip:], held[skip:], _home(link).altitude_amsl_m)) is not None:
        raise LinkError(f"the vehicle holds another {what} than was sent: {difference}")


def _round_trip(
    link: Link,
    what: str,
    items: list[MissionItem],
    send: Callable[[list[MissionItem]], object],
    fetch: Callable[[], list[MissionItem]],
    tries: int,
) -> list[MissionItem]:
    """Send, and read back what is held."""
    try:
        send(items)
        return fetch()
    except (MissionRawError, GeofenceError) as error:
        passing = error.result.name in _PASSING
        if passing and tries > 1:
            time.sleep(_silence_s(link.autopilot, error))
            return _round_trip(link, what, items, send, fetch, tries - 1)
        words, said = error.result.name.lower().replace("_", " "), link.last_words()
        reason = f"the {what} was not taken: {words}" + (f' ("{said}")' if said else "")
        raise LinkError(reason + (_HELD_UP if passing else "")) from error


def _silence_s(autopilot: Autopilot, error: MissionRawError | GeofenceError) -> float:
    """How long to say nothing before the next try."""
    if autopilot is Autopilot.PX4:
        return _PX4_DROPS_AFTER_S
    return _ARDUPILOT_DROPS_ANOTHERS_AFTER_S if error.result.name == "DENIED" else _PAUSE_S


def _packed(item: Item, number: int, kind: int, link: Link) -> MissionItem:
    frame, latitude, longitude, height_m = mavlink.MAV_FRAME_MISSION, 0.0, 0.0, 0.0
    if item.place is not None:
        latitude, longitude = item.place.latitude_deg, item.place.longitude_deg
        relative = link.autopilot is Autopilot.ARDUPILOT or kind != mavlink.MAV_MISSION_TYPE_MISSION
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT if relative else mavlink.MAV_FRAME_GLOBAL
        height_m = item.place.altitude_amsl_m - (_home(link).altitude_amsl_m if relative else 0.0)
        if kind == mavlink.MAV_MISSION_TYPE_FENCE:
            height_m = 0.0
    # ArduPilot may refuse NaN where it reads nothing: 0 there.
    unset = 0.0 if link.autopilot is Autopilot.ARDUPILOT else math.nan
    p1, p2, p3, p4 = (unset if value is None else value for value in item.params)
    if link.autopilot is Autopilot.ARDUPILOT and item.command == mavlink.MAV_CMD_NAV_WAYPOINT:
        # Copter keeps a waypoint's delay alone; how near is near enough is its parameter WPNAV_RADIUS.
        p2 = p3 = p4 = 0.0
    current = int(number == 0 and kind == mavlink.MAV_MISSION_TYPE_MISSION)
    return MissionItem(
        seq=number,
        frame=frame,
        command=item.command,
        current=current,
        autocontinue=1,
        param1=p1,
        param2=p2,
        param3=p3,
        param4=p4,
        x=round(latitude * 1e7),
        y=round(longitude * 1e7),
        z=height_m,
        mission_type=kind,
    )


def _difference(wanted: Sequence[MissionItem], held: Sequence[MissionItem], home_amsl_m: float) -> str | None:
    """The first difference of meaning; None: they mean the same."""
    if len(wanted) != len(held):
        return f"{len(wanted)} items were sent and {len(held)} are held"
    for number, (sent, kept) in enumerate(zip(wanted, held, strict=True)):
        if sent.command != kept.command:
            return f"item {number} was command {sent.command} and is {kept.command}"
        if sent.command in _PLACES:
            for name in ("x", "y"):
                apart = abs(getattr(sent, name) - getattr(kept, name)) * 1e-7
                if apart > _SAME_DEG:
                    return f"item {number} lies {apart:.7f}° away from where it was sent"
            heights = [_amsl_m(item, home_amsl_m) for item in (sent, kept)]
            if sent.mission_type != mavlink.MAV_MISSION_TYPE_FENCE and abs(heights[0] - heights[1]) > _SAME_M:
                return f"item {number} was sent at {heights[0]:.1f} m above sea level and is at {heights[1]:.1f} m"
        for name in ("param1", "param2", "param3", "param4"):
            before, after = getattr(sent, name), getattr(kept, name)
            if before and not math.isnan(before) and not abs(before - after) <= _SAME_PARAM * max(1.0, abs(before)):
                return f"item {number} has {name} {after:g} in the place of {before:g}"
    return None


def _amsl_m(item: MissionItem, home_amsl_m: float) -> float:
    relative = item.frame in (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
    return item.z + (home_amsl_m if relative else 0.0)
