"""What is put into the vehicle before it arms: its fence, rally points, and the mission that it is to fly by itself."""

from __future__ import annotations

from mission.executive.events import MissionPlace
from mission.mission_items import Command, mission_items
from mission.plan_file import PlanFile
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.link.client import Link
from sim_bridge.link.mission import Item, upload_fence, upload_mission, upload_rally_points
from sim_bridge.state import GeodeticPoint


def upload_safety(link: Link, plan: PlanFile) -> None:
    """Upload the fence and the rally points of a plan.

    Raises:
        LinkError: The vehicle does not hold them as they were sent.
    """
    origin = plan.origin.point()

    def corners(polygon_enu_m: list[tuple[float, float]]) -> list[GeodeticPoint]:
        return [geodetic_from_enu((east, north, 0.0), origin) for east, north in polygon_enu_m]

    upload_fence(link, corners(plan.flight.fence_enu_m), [corners(zone.polygon_enu_m) for zone in plan.flight.no_fly])
    if plan.flight.rally_enu_m:
        upload_rally_points(link, [geodetic_from_enu(point, origin) for point in plan.flight.rally_enu_m])


def upload_plan(link: Link, plan: PlanFile) -> tuple[MissionPlace, ...]:
    """Upload a plan as a mission.

    Returns:
        Where it leads: the end of the climb, and every waypoint of the exploration.

    Raises:
        LinkError: The vehicle does not hold it as it was sent.
        ValueError: More items than the autopilot holds.
    """
    home_amsl_m = geodetic_from_enu(plan.flight.home_enu_m, plan.origin.point()).altitude_amsl_m
    items = mission_items(plan)
    sent = [
        Item(
            int(item.command),
            item.params,
            GeodeticPoint(item.latitude_deg, item.longitude_deg, home_amsl_m + item.altitude_m)
            if item.is_place
            else None,
        )
        for item in items
    ]
    first = upload_mission(link, sent)
    east, north, up = plan.flight.home_enu_m
    climb_m = (east, north, up + plan.flight.takeoff_altitude_m)
    numbers = [number for number, item in enumerate(items) if item.command is Command.WAYPOINT]
    waypoints = zip(numbers, plan.waypoints, strict=True)
    return (
        MissionPlace(first, climb_m),
        *(MissionPlace(first + number, waypoint.position_enu_m) for number, waypoint in waypoints),
    )
