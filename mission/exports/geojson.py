"""GeoJSON (RFC 7946): longitude, latitude, altitude; exterior rings counter-clockwise."""

from __future__ import annotations

import json
from collections.abc import Sequence

from mission.plan_file import Corner, PlanFile, Vector
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.state import GeodeticPoint


def lon_lat_alt(position_enu_m: Vector, origin: GeodeticPoint) -> list[float]:
    """A position as the formats with longitude first have it: degrees to about a millimetre, metres above sea level."""
    place = geodetic_from_enu(position_enu_m, origin)
    return [round(place.longitude_deg, 8), round(place.latitude_deg, 8), round(place.altitude_amsl_m, 3)]


def _ring(corners_m: Sequence[Corner], origin: GeodeticPoint) -> list[list[float]]:
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(corners_m, [*corners_m[1:], corners_m[0]], strict=True))
    ordered = list(corners_m) if area > 0.0 else list(reversed(corners_m))
    return [lon_lat_alt((east, north, 0.0), origin)[:2] for east, north in [*ordered, ordered[0]]]


def _feature(kind: str, coordinates: object, **properties: object) -> dict[str, object]:
    return {
        "type": "Feature",
        "geometry": {"type": kind, "coordinates": coordinates},
        "properties": properties,
    }


def feature_collection(plan: PlanFile) -> str:
    """The selected path, the other candidates, the waypoints, home, the fence and the no-fly volumes."""
    origin = plan.origin.point()
    features = [
        _feature(
            "LineString",
            [lon_lat_alt(waypoint.position_enu_m, origin) for waypoint in plan.waypoints],
            role="path",
            name=plan.name,
            ergodic_metric=plan.metric.ergodic_metric,
            duration_s=plan.trajectory.time_s[-1] - plan.trajectory.time_s[0],
        )
    ]
    for index, candidate in enumerate(plan.candidates):
        if index != plan.selected:
            features.append(
                _feature(
                    "LineString",
                    [lon_lat_alt(position, origin) for position in candidate.position_enu_m],
                    role="candidate",
                    number=index,
                    seed_pattern=candidate.seed_pattern,
                    feasible=candidate.feasible,
                    ergodic_metric=candidate.ergodic_metric,
                )
            )
    for index, waypoint in enumerate(plan.waypoints):
        features.append(
            _feature(
                "Point",
                lon_lat_alt(waypoint.position_enu_m, origin),
                role="waypoint",
                number=index,
                time_s=waypoint.time_s,
                speed_mps=waypoint.speed_mps,
            )
        )
    features.append(_feature("Point", lon_lat_alt(plan.flight.home_enu_m, origin), role="home"))
    features.append(
        _feature(
            "Polygon",
            [_ring(plan.flight.fence_enu_m, origin)],
            role="fence",
            floor_m=plan.limits.box_min_enu_m[2],
            ceiling_m=plan.limits.box_max_enu_m[2],
        )
    )
    for zone in plan.flight.no_fly:
        features.append(
            _feature(
                "Polygon",
                [_ring(zone.polygon_enu_m, origin)],
                role="no-fly",
                floor_m=zone.floor_m,
                ceiling_m=zone.ceiling_m,
            )
        )
    return json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False) + "\n"
