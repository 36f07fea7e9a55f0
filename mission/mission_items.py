"""A plan as MAVLink mission items: take-off, the waypoints with their speeds, and the end."""

from __future__ import annotations

import dataclasses
import enum
import math

from mission.plan_file import PlanFile, PlannedWaypoint
from sim_bridge.frames import geodetic_from_enu, yaw_ned_from_enu
from sim_bridge.state import GeodeticPoint, Vector

SLOWEST_MPS = 0.2
"""Below this an autopilot may take a speed for "as it was"."""

SPEED_STEP = 0.1
"""Speeds nearer than this share to the one in force are not commanded again."""

ARDUPILOT_MOST_ITEMS = 650

OUTDOOR_ACCEPTANCE_M = 2.0
"""An estimate that wanders by 0.8 m, and a vehicle that passes a corner by a metre at 4 m/s."""

RELATIVE_TO_HOME = 3
"""MAV_FRAME_GLOBAL_RELATIVE_ALT."""

NOT_A_PLACE = 2
"""MAV_FRAME_MISSION: a command without coordinates."""


class Command(enum.IntEnum):
    """MAV_CMD numbers of the items used."""

    WAYPOINT = 16
    RETURN_TO_LAUNCH = 20
    LAND = 21
    TAKEOFF = 22
    CHANGE_SPEED = 178


@dataclasses.dataclass(frozen=True)
class MissionItem:
    """One item.

    Attributes:
        command: What it is.
        frame: MAV_FRAME of the place.
        params: p1 … p4; None: left to the autopilot (NaN).
        latitude_deg: Of the place; 0 for commands without one.
        longitude_deg: Likewise.
        altitude_m: Above home.
    """

    command: Command
    frame: int
    params: tuple[float | None, float | None, float | None, float | None]
    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    altitude_m: float = 0.0

    @property
    def is_place(self) -> bool:
        """Whether the item has coordinates."""
        return self.frame != NOT_A_PLACE


def home_of(plan: PlanFile) -> GeodeticPoint:
    """Where the vehicle takes off, with its altitude above sea level."""
    return geodetic_from_enu(plan.flight.home_enu_m, plan.origin.point())


def acceptance_radius_m(plan: PlanFile) -> float:
    """How near a waypoint counts as reached: two metres, more where the margin allows, less indoors.

    With one metre PX4 1.15 overshot a corner by 1.2 m, turned back and left the leg by 15 m before it came again: what
    it does not reach in passing it circles (docs/autopilots.md).
    """
    return min(max(OUTDOOR_ACCEPTANCE_M, plan.limits.clearance_margin_m), max(0.2, 0.1 * _shortest_side_m(plan)))


def _shortest_side_m(plan: PlanFile) -> float:
    low, high = plan.limits.box_min_enu_m, plan.limits.box_max_enu_m
    return min(high[0] - low[0], high[1] - low[1])


def mission_items(plan: PlanFile) -> tuple[MissionItem, ...]:
    """The whole flight as items, home not among them.

    Raises:
        ValueError: More items than the autopilot holds.
    """
    origin = plan.origin.point()
    home = home_of(plan)

    def at(command: Command, position_enu_m: Vector, params: tuple[float | None, ...]) -> MissionItem:
        place = geodetic_from_enu(position_enu_m, origin)
        p1, p2, p3, p4 = params
        # Not the difference of "up": over kilometres the ground curves away below the local plane.
        height_m = place.altitude_amsl_m - home.altitude_amsl_m
        return MissionItem(
            command, RELATIVE_TO_HOME, (p1, p2, p3, p4), place.latitude_deg, place.longitude_deg, height_m
        )

    def pace(speed_mps: float) -> MissionItem:
        return MissionItem(Command.CHANGE_SPEED, NOT_A_PLACE, (1.0, round(speed_mps, 2), -1.0, 0.0))

    east, north, up = plan.flight.home_enu_m
    items = [at(Command.TAKEOFF, (east, north, up + plan.flight.takeoff_altitude_m), (0.0, 0.0, 0.0, None))]
    in_force = math.nan
    radius_m = acceptance_radius_m(plan)
    for waypoint in plan.waypoints:
        wanted = max(waypoint.speed_mps, SLOWEST_MPS)
        if not abs(wanted - in_force) <= SPEED_STEP * in_force:
            items.append(pace(wanted))
            in_force = wanted
        items.append(at(Command.WAYPOINT, waypoint.position_enu_m, (0.0, radius_m, 0.0, _yaw_deg(waypoint))))
    match plan.flight.end:
        case "return":
            items.append(MissionItem(Command.RETURN_TO_LAUNCH, NOT_A_PLACE, (0.0, 0.0, 0.0, 0.0)))
        case "land":
            below = (*plan.waypoints[-1].position_enu_m[:2], up)
            items.append(at(Command.LAND, below, (0.0, 0.0, 0.0, None)))
    if plan.flight.autopilot == "ardupilot" and len(items) >= ARDUPILOT_MOST_ITEMS:
        raise ValueError(
            f"the plan needs {len(items)} mission items and ArduPilot holds {ARDUPILOT_MOST_ITEMS}: plan a shorter "
            "duration_s, or fly it with --mode offboard"
        )
    return tuple(items)


def item_times_s(plan: PlanFile) -> tuple[float, ...]:
    """Time along the curve that has passed when an item is reached, for every item up to the last waypoint.

    Raises:
        ValueError: More items than the autopilot holds.
    """
    items, waypoints = mission_items(plan), iter(plan.waypoints)
    last = max(number for number, item in enumerate(items) if item.command is Command.WAYPOINT)
    passed_s, times_s = plan.waypoints[0].time_s, []
    for item in items[: last + 1]:
        if item.command is Command.WAYPOINT:
            passed_s = next(waypoints).time_s
        times_s.append(passed_s)
    return tuple(times_s)


def _yaw_deg(waypoint: PlannedWaypoint) -> float | None:
    """Clockwise from north, where it was planned; None: the autopilot looks where it goes."""
    if waypoint.yaw_enu_rad is None:
        return None
    return round(math.degrees(yaw_ned_from_enu(waypoint.yaw_enu_rad)) % 360.0, 1)
