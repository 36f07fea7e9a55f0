"""QGroundControl's `.plan`: mission, fence and rally points in one JSON file (file version 1, parts version 2)."""

from __future__ import annotations

import json

from mission.mission_items import MissionItem, home_of, mission_items
from mission.plan_file import Corner, PlanFile
from sim_bridge.frames import geodetic_from_enu

RELATIVE_ALTITUDE_MODE = 1
QUADROTOR = 2


def _item(item: MissionItem, number: int) -> dict[str, object]:
    params = [*item.params, item.latitude_deg, item.longitude_deg, item.altitude_m]
    simple: dict[str, object] = {
        "type": "SimpleItem",
        "autoContinue": True,
        "command": int(item.command),
        "doJumpId": number,
        "frame": item.frame,
        "params": params,
    }
    if item.is_place:
        simple |= {"AltitudeMode": RELATIVE_ALTITUDE_MODE, "Altitude": item.altitude_m, "AMSLAltAboveTerrain": None}
    return simple


def qgroundcontrol_plan(plan: PlanFile) -> str:
    """The plan as QGroundControl opens it.

    Raises:
        ValueError: More items than the autopilot holds.
    """
    origin = plan.origin.point()

    def corners(polygon_enu_m: list[Corner]) -> list[list[float]]:
        places = [geodetic_from_enu((east, north, 0.0), origin) for east, north in polygon_enu_m]
        return [[place.latitude_deg, place.longitude_deg] for place in places]

    def fence(polygon_enu_m: list[Corner], inclusion: bool) -> dict[str, object]:
        return {"polygon": corners(polygon_enu_m), "inclusion": inclusion, "version": 1}

    home = home_of(plan)
    rally = [geodetic_from_enu(point, origin) for point in plan.flight.rally_enu_m]
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            "firmwareType": 12 if plan.flight.autopilot == "px4" else 3,
            "vehicleType": QUADROTOR,
            "globalPlanAltitudeMode": RELATIVE_ALTITUDE_MODE,
            "cruiseSpeed": plan.limits.max_speed_mps,
            "hoverSpeed": plan.limits.max_speed_mps,
            "plannedHomePosition": [home.latitude_deg, home.longitude_deg, home.altitude_amsl_m],
            "items": [_item(item, number) for number, item in enumerate(mission_items(plan), start=1)],
        },
        "geoFence": {
            "version": 2,
            "circles": [],
            "polygons": [
                fence(plan.flight.fence_enu_m, True),
                *(fence(zone.polygon_enu_m, False) for zone in plan.flight.no_fly),
            ],
        },
        "rallyPoints": {
            "version": 2,
            "points": [
                [place.latitude_deg, place.longitude_deg, place.altitude_amsl_m - home.altitude_amsl_m]
                for place in rally
            ],
        },
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"
