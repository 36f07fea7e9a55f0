"""The vehicle's own fence: whether an uploaded one is valid, and whether the vehicle is outside of it."""

from __future__ import annotations

from collections.abc import Sequence

import shapely

from sim_bridge.body import Body
from sim_bridge.codec import Message, mavlink
from sim_bridge.plan_storage import item_lat_lon_e7
from sim_bridge.state import GeodeticPoint, Vector

_POLYGONS = (
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
)
_CIRCLES = (mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)
_INCLUSIONS = (
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION,
)


class FenceWatch:
    """Areas to stay in and out of, in the vehicle's map."""

    def __init__(self) -> None:
        self._inside: list[shapely.Polygon] = []
        self._outside: list[shapely.Polygon] = []
        self.enforced = False

    def load(self, items: Sequence[Message], body: Body) -> bool:
        """Take an uploaded fence.

        Returns:
            Whether it is valid: it contains home. One that is not is kept by the vehicle and not enforced.
        """
        self._inside, self._outside = [], []
        index = 0
        while index < len(items):
            item = items[index]
            shapes = self._inside if item.command in _INCLUSIONS else self._outside
            if item.command in _POLYGONS:
                count = max(1, int(item.param1))
                corners = [_place(corner, body) for corner in items[index : index + count]]
                if len(corners) >= 3:
                    shapes.append(shapely.Polygon(corners))
                index += count
            else:
                if item.command in _CIRCLES and item.param1 > 0.0:
                    shapes.append(shapely.Point(_place(item, body)).buffer(item.param1))
                index += 1
        self.enforced = bool(self._inside or self._outside) and not self.breached(body.home_ned_m)
        return self.enforced or not items

    def breached(self, position_ned_m: Vector) -> bool:
        """Whether a place lies where the vehicle must not be."""
        here = shapely.Point(position_ned_m[:2])
        out_of_all = bool(self._inside) and not all(shape.covers(here) for shape in self._inside)
        return out_of_all or any(shape.covers(here) for shape in self._outside)


def _place(item: Message, body: Body) -> tuple[float, float]:
    latitude_e7, longitude_e7 = item_lat_lon_e7(item)
    north, east, _ = body.local_ned(GeodeticPoint(latitude_e7 * 1e-7, longitude_e7 * 1e-7, 0.0))
    return north, east
