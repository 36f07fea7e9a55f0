"""Where it comes down: straight down, past whatever is known to stand there."""

from __future__ import annotations

import math
from collections.abc import Callable

from mission.executive.events import FlightEnd
from mission.site.column import ground_up_m, nearest_in_column
from planner.problem import Problem
from sim_bridge.state import Vector, VehicleState


class Landing:
    """Chooses where to land, against what is known now.

    Args:
        known: What is known now.
        least_clearance_m: From the vehicle's hull to what stands beside the way down.
        rally_m: Above where it may land instead of home, at whatever height.
        height_m: Above its landing place it begins to descend.
    """

    def __init__(
        self, known: Callable[[], Problem], least_clearance_m: float, rally_m: tuple[Vector, ...], height_m: float
    ) -> None:
        self._known = known
        self._least_clearance_m = least_clearance_m
        self._rally_m = rally_m
        self._height_m = height_m

    def above(self, place_m: Vector) -> Vector:
        """Where the descent to a place begins, and the climb from it ends."""
        return place_m[0], place_m[1], place_m[2] + self._height_m

    def below(self, position_m: Vector, home_up_m: float) -> Vector:
        """The ground below a position; as high as home where no terrain is known."""
        ground_m = ground_up_m(self._known().obstacles, position_m[:2], home_up_m)
        return position_m[0], position_m[1], ground_m

    def clear(self, place_m: Vector, top_up_m: float | None = None, from_up_m: float = -math.inf) -> bool:
        """Whether nothing stands in the column above a place.

        Args:
            place_m: On the ground.
            top_up_m: Upper end of the column; None: where descents begin.
            from_up_m: Lower end, where that is not the ground.
        """
        known = self._known()
        needed_m = known.vehicle_radius_m + self._least_clearance_m
        top_m = self.above(place_m)[2] if top_up_m is None else top_up_m
        low_m = max(place_m[2] + needed_m, from_up_m)
        return nearest_in_column(known.obstacles, place_m[:2], low_m, top_m).distance_m >= needed_m

    def clear_at_end(self, end_m: Vector, home_m: Vector, end: FlightEnd) -> bool:
        """Whether it can land where an exploration ends, or at home, as it was asked to.

        Args:
            end_m: Where it ends.
            home_m: Home.
            end: What happens then.
        """
        if end is FlightEnd.LAND:
            return self.clear(self.below(end_m, home_m[2]), end_m[2])
        return self.clear(home_m)

    def consequence(self, home_m: Vector, state: VehicleState) -> str:
        """What becomes of the landing where home is not clear, in words; empty: it is.

        Args:
            home_m: Home.
            state: What the vehicle tells.
        """
        if self.clear(home_m):
            return ""
        if not state.aloft:
            return "it stands above home: the vehicle will not take off"
        place_m = self.place(home_m, state.position_enu_m)
        if place_m is None:
            return (
                "it stands above home, and no rally point is clear: the vehicle will wait above home until it is told "
                "to land or is taken over"
            )
        return f"it stands above home: the vehicle will land at the rally point ({place_m[0]:.0f}, {place_m[1]:.0f})"

    def place(self, home_m: Vector, position_m: Vector) -> Vector | None:
        """Home, or the nearest rally point where something stands there; None: nowhere is clear.

        Args:
            home_m: Home.
            position_m: Where the vehicle is.
        """
        rally_m = [self.below(place_m, home_m[2]) for place_m in self._rally_m]
        nearest = sorted(rally_m, key=lambda place_m: math.dist(place_m, position_m))
        return next((place_m for place_m in (home_m, *nearest) if self.clear(place_m)), None)
