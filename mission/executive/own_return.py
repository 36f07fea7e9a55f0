"""The vehicle's own way home: what it does by its parameters when this program cannot steer it any more."""

from __future__ import annotations

import dataclasses
import math

from mission.site.descent import Descent
from sim_bridge.state import Vector

# Speeding up and braking.
_RAMPS = 1.15

SETTLING_S = 15.0
"""Stopping, turning and settling before each part: PX4's own simulation took 13 s longer than its parts, Copter's 7."""


@dataclasses.dataclass(frozen=True)
class Cone:
    """Near home a vehicle climbs less.

    Attributes:
        slope: Height above home a metre from it.
        within_m: From how far on; infinite: everywhere.
        least_m: The least height, right above home.
    """

    slope: float
    within_m: float
    least_m: float


@dataclasses.dataclass(frozen=True)
class OwnReturn:
    """Up, across, a wait above home, and down.

    Attributes:
        height_m: Height above home at which it crosses, unless it is higher already.
        cruise_mps: Horizontal speed.
        climb_mps: Speed upwards.
        descent: How it lands.
        named: The parameters that decide most of it, for a person.
        wait_s: How long it waits above home.
        cone: Where it climbs less; None: nowhere.
    """

    height_m: float
    cruise_mps: float
    climb_mps: float
    descent: Descent
    named: str
    wait_s: float = 0.0
    cone: Cone | None = None

    def home_s(self, position_m: Vector, home_m: Vector) -> float:
        """Time from a place to the ground at home.

        Args:
            position_m: Where the vehicle is.
            home_m: Where it lands; a rally point it would choose instead is nearer.
        """
        across_m = math.dist(position_m[:2], home_m[:2])
        up_m = position_m[2] - home_m[2]
        crossing_m = max(up_m, self._least_height_m(across_m))
        level_s = (crossing_m - up_m) / self.climb_mps + across_m / self.cruise_mps
        return SETTLING_S + _RAMPS * level_s + self.wait_s + self.descent.to_ground_s(crossing_m)

    def _least_height_m(self, across_m: float) -> float:
        if self.cone is None or across_m > self.cone.within_m:
            return self.height_m
        return min(self.height_m, max(self.cone.slope * across_m, self.cone.least_m))
