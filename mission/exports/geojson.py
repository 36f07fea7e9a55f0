"""GeoJSON (RFC 7946): longitude, latitude, altitude; exterior rings counter-clockwise."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from mission.plan_file import Corner, PlanFile, PlannedCandidate, Vector
from sim_bridge.frames import geodetics_from_enu
from sim_bridge.state import GeodeticPoint

MOST_OTHERS = 48
"""Candidates beside the selected one on a map: of more a person sees none, and plan.json has them all."""


def lon_lat_alt(positions_enu_m: Sequence[Vector], origin: GeodeticPoint) -> list[list[float]]:
    """Positions as formats with the longitude first have them: degrees to about a millimetre, metres AMSL."""
    return [
        [round(place.longitude_deg, 8), round(place.latitude_deg, 8), round(place.altitude_amsl_m, 3)]
        for place in geodetics_from_enu(positions_enu_m, origin)
    ]


def others_of(plan: PlanFile) -> list[tuple[int, PlannedCandidate]]:
    """The candidates beside the selected one with their numbers: the best `MOST_OTHERS`, in the order of the set."""

    def rank(other: tuple[int, PlannedCandidate]) -> tuple[bool, float]:
        return not other[1].feasible, math.inf if other[1].cost is None else other[1].cost

    others = [(index, candidate) for index, candidate in enumerate(plan.candidates) if index != plan.selected]
    return sorted(sorted(others, key=rank)[:MOST_OTHERS])


def _ring(corners_m: Sequence[Corner], origin: GeodeticPoint) -> list[list[float]]:
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(corners_m, [*corners_m[1:], corners_m[0]], strict=True))
    ordered = list(corners_m) if area > 0.0 else list(reversed(corners_m))
    return [place[:2] for place in lon_lat_alt([(*corner, 0.0) for corner in [*ordered, ordered[0]]], origin)]


def _feature(kind: str, coordinates: object, **properties: object) -> dict[str, object]:
    return {
        "type": "Feature",
        "geometry": {"type": kind, "coordinates": coordinates},
        "properties": properties,
    }


def feature_collection(plan: PlanFile) -> str:
    """The selected path, the best other candidates, the waypoints, home, the fence and the no-fly volumes."""
    origin = plan.origin.point()
    places = lon_lat_alt([waypoint.position_enu_m for waypoint in plan.waypoints], origin)
    features = [
        _feature(
            "LineString",
            places,
            role="path",
            name=plan.name,
            ergodic_metric=plan.metric.ergodic_metric,
            duration_s=plan.trajectory.time_s[-1] - plan.trajectory.time_s[0],
            candidates=len(plan.candidates),
        )
    ]
    for index, candidate in others_of(plan):
        features.append(
            _feature(
                "LineString",
                lon_lat_alt(candidate.position_enu_m, origin),
                role="candidate",
                number=index,
                seed_pattern=candidate.seed_pattern,
                feasible=candidate.feasible,
                ergodic_metric=candidate.ergodic_metric,
            )
        )
    for index, (waypoint, place) in enumerate(zip(plan.waypoints, places, strict=True)):
        features.append(
            _feature(
                "Point",
                place,
                role="waypoint",
                number=index,
                time_s=waypoint.time_s,
                speed_mps=waypoint.speed_mps,
            )
        )
    features.append(_feature("Point", lon_lat_alt([plan.flight.home_enu_m], origin)[0], role="home"))
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
