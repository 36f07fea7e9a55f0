"""Buildings from GeoJSON: polygons with a height become upright prisms."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from mission.mission_file.obstacle import GeoJson
from mission.site.nearness import demand_near
from mission.site.scans import Frame
from sim_bridge.frames import enu_from_geodetic
from sim_bridge.state import GeodeticPoint


@dataclasses.dataclass(frozen=True)
class Building:
    """An upright prism.

    Attributes:
        polygon_m: Shape (corner, 2), local ENU, the last corner not repeated.
        floor_m: Height of its lower end.
        ceiling_m: Height of its upper end.
    """

    polygon_m: Float[np.ndarray, "corner 2"]
    floor_m: float
    ceiling_m: float


def read_buildings(entry: GeoJson, frame: Frame) -> tuple[Building, ...]:
    """Every polygon of a GeoJSON file as a building; courtyards (inner rings) are filled.

    Args:
        entry: The file, and which properties hold the heights.
        frame: Where they are put.

    Raises:
        ValueError: Not GeoJSON, a geometry that is not a polygon, or a height that is missing or makes no sense; with
            the number of the feature, counted from zero. Or none of them is near the site.
    """
    name = entry.file.name
    try:
        document = json.loads(entry.file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{name} cannot be read: {error.strerror or error}") from error
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{name} is not JSON: {error}") from error
    match document:
        case {"type": "FeatureCollection", "features": [*features]}:
            pass
        case {"type": "Feature"}:
            features = [document]
        case _:
            raise ValueError(f"{name} is not GeoJSON: a FeatureCollection is needed")
    buildings = []
    for number, feature in enumerate(features):
        try:
            buildings += _buildings_of(feature, entry, frame.origin)
        except ValueError as error:
            raise ValueError(f"{name}, feature {number}: {error}") from error
    if not buildings:
        raise ValueError(f"{name} holds no polygons")
    footprints = [building.polygon_m for building in buildings]
    hint = "are latitude and longitude exchanged? GeoJSON has the longitude first"
    demand_near(name, footprints, frame.low_m, frame.high_m, hint)
    return tuple(buildings)


def _buildings_of(feature: Any, entry: GeoJson, origin: GeodeticPoint) -> Iterator[Building]:
    match feature:
        case {"geometry": {"type": "Polygon", "coordinates": rings}}:
            polygons = [rings]
        case {"geometry": {"type": "MultiPolygon", "coordinates": [*polygons]}}:
            pass
        case {"geometry": {"type": str(other)}}:
            raise ValueError(f"its geometry is a {other}, and a Polygon or MultiPolygon is needed")
        case _:
            raise ValueError("it has no geometry")
    properties = feature.get("properties")
    base_m = _height(properties, entry.base_property, default=0.0)
    top_m = _height(properties, entry.height_property, default=None)
    if not base_m < top_m:
        raise ValueError(f"it ends at {top_m:g} m, which is not above its base at {base_m:g} m")
    for rings in polygons:
        yield Building(_outer_ring_m(rings, origin), entry.ground_m + base_m, entry.ground_m + top_m)


def _height(properties: Any, key: str, default: float | None) -> float:
    value = properties.get(key, default) if isinstance(properties, dict) else default
    if value is None:
        raise ValueError(f"it has no property '{key}': add it, or name another with height_property")
    try:
        height = float(value)
    except (TypeError, ValueError):
        height = math.nan
    if not math.isfinite(height):
        raise ValueError(f"its property '{key}' is {value!r}, and metres are needed")
    return height


def _outer_ring_m(rings: Any, origin: GeodeticPoint) -> Float[np.ndarray, "corner 2"]:
    import shapely

    try:
        ring = np.array([[float(number) for number in place[:2]] for place in rings[0]])
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise ValueError("its coordinates are not [longitude, latitude] pairs") from error
    if ring.ndim != 2 or ring.shape[1:] != (2,) or len(ring) < 4 or not np.isfinite(ring).all():
        raise ValueError("its outer ring needs at least four [longitude, latitude] pairs, the last as the first")
    if np.abs(ring[:, 0]).max() > 180.0 or np.abs(ring[:, 1]).max() > 90.0:
        raise ValueError("its coordinates are not degrees: GeoJSON has longitude and latitude, WGS84")
    places = [GeodeticPoint(float(lat), float(lon), origin.altitude_amsl_m) for lon, lat in ring[:-1]]
    corners = np.array([enu_from_geodetic(place, origin)[:2] for place in places])
    if not shapely.Polygon(corners).is_valid:
        raise ValueError("its outline crosses itself")
    return corners
