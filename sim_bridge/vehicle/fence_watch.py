"""The vehicle's own fence: whether an uploaded one is valid, and whether the vehicle is outside of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import shapely

from sim_bridge.codec import mavlink
from sim_bridge.state import GeodeticPoint, Vector
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.plan_items import FENCE_CIRCLES, FENCE_POLYGONS, Item

_INCLUSIONS = (
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION,
)


@dataclasses.dataclass(frozen=True)
class Area:
    """One polygon or circle of a fence.

    Attributes:
        shape: In the vehicle's map: north, east, metres.
        inclusion: Whether to stay inside; else to stay out.
    """

    shape: shapely.Polygon
    inclusion: bool

    def breached(self, position_ned_m: Vector) -> bool:
        """Whether a place lies where the vehicle must not be."""
        return self.shape.covers(shapely.Point(position_ned_m[:2])) != self.inclusion


def areas_of(items: Sequence[Item], body: Body) -> list[Area]:
    """The areas of an uploaded fence; what is no area is left out."""
    found: list[Area] = []
    index = 0
    while index < len(items):
        item = items[index]
        inclusion = item.command in _INCLUSIONS
        if item.command in FENCE_POLYGONS:
            count = max(1, int(item.params[0]))
            corners = [_place(corner, body) for corner in items[index : index + count]]
            if len(corners) >= 3:
                found.append(Area(shapely.Polygon(corners), inclusion))
            index += count
        else:
            if item.command in FENCE_CIRCLES and item.params[0] > 0.0:
                found.append(Area(shapely.Point(_place(item, body)).buffer(item.params[0]), inclusion))
            index += 1
    return found


class FenceWatch:
    """The areas that are enforced."""

    def __init__(self) -> None:
        self._areas: list[Area] = []

    def load(self, items: Sequence[Item], body: Body, *, must_contain: Sequence[Vector]) -> list[Vector]:
        """Take an uploaded fence.

        Args:
            items: As uploaded.
            body: Whose map is used.
            must_contain: Places that each area must allow; one that does not is not enforced.

        Returns:
            Those of the places that some area does not allow.
        """
        areas = areas_of(items, body)
        self._areas = [area for area in areas if not any(area.breached(place) for place in must_contain)]
        return [place for place in must_contain if any(area.breached(place) for area in areas)]

    def breached(self, position_ned_m: Vector) -> bool:
        """Whether a place lies where the vehicle must not be."""
        return any(area.breached(position_ned_m) for area in self._areas)


def _place(item: Item, body: Body) -> tuple[float, float]:
    north, east, _ = body.local_ned(GeodeticPoint(item.latitude_e7 * 1e-7, item.longitude_e7 * 1e-7, 0.0))
    return north, east
