"""The vehicle's own fence: whether an uploaded one is valid, and whether the vehicle is outside of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from sim_bridge.codec import mavlink
from sim_bridge.state import GeodeticPoint, Vector
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.plan_items import FENCE_CIRCLES, FENCE_POLYGONS, Item, unsigned

_INCLUSIONS = (
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION,
)


@dataclasses.dataclass(frozen=True)
class Polygon:
    """A ring; where it crosses itself, every second crossing is inside, as in both firmwares.

    Attributes:
        corners_m: North, east.
    """

    corners_m: tuple[tuple[float, float], ...]

    def holds(self, north_m: float, east_m: float) -> bool:
        """Whether a place lies inside."""
        inside = False
        for (x0, y0), (x1, y1) in zip(self.corners_m, self.corners_m[1:] + self.corners_m[:1], strict=True):
            if (y0 >= east_m) != (y1 >= east_m) and north_m <= (x1 - x0) * (east_m - y0) / (y1 - y0) + x0:
                inside = not inside
        return inside


@dataclasses.dataclass(frozen=True)
class Circle:
    """A disc; one whose radius is not a number holds nothing, one without an end everything.

    Attributes:
        centre_m: North, east.
        radius_m: Its sign does not matter.
    """

    centre_m: tuple[float, float]
    radius_m: float

    def holds(self, north_m: float, east_m: float) -> bool:
        """Whether a place lies inside."""
        x, y = north_m - self.centre_m[0], east_m - self.centre_m[1]
        return x * x + y * y < self.radius_m * self.radius_m


@dataclasses.dataclass(frozen=True)
class Area:
    """One polygon or circle of a fence.

    Attributes:
        shape: In the vehicle's map.
        inclusion: Whether to stay inside; else to stay out.
    """

    shape: Polygon | Circle
    inclusion: bool

    def breached(self, position_ned_m: Vector) -> bool:
        """Whether a place lies where the vehicle must not be."""
        return self.shape.holds(*position_ned_m[:2]) != self.inclusion


def areas_of(items: Sequence[Item], body: Body) -> list[Area]:
    """The areas of an uploaded fence; what is no area is left out, and a polygon that lacks corners holds nothing."""
    found: list[Area] = []
    index = 0
    while index < len(items):
        item, length = items[index], 1
        inclusion = item.command in _INCLUSIONS
        if item.command in FENCE_POLYGONS:
            length = max(1, unsigned(item.params[0], 16))
            corners = tuple(_place(corner, body) for corner in items[index : index + length])
            found.append(Area(Polygon(corners if len(corners) == length else ()), inclusion))
        elif item.command in FENCE_CIRCLES:
            found.append(Area(Circle(_place(item, body), item.params[0]), inclusion))
        index += length
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
