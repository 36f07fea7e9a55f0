"""What flying costs and what the charge is: whether the way home can still be paid."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from mission.executive.own_return import OwnReturn
from mission.site.descent import Descent
from planner.problem import Limits
from planner.trajectory import Trajectory
from sim_bridge.state import Vector

# Until the way home is proven it is taken for little longer than the straight line.
_DETOUR = 1.15
_LEAST_OBSERVATION_S = 60.0
_LEAST_DROP = 0.03
# Of the reserve, what must be left after the vehicle's own return. (PX4 itself asks for a tenth more than its return
# takes, and 100 s: RTL_TIME_FACTOR, RTL_TIME_MARGIN.)
_KEPT_ALONE = 0.5

# The charge along a curve is looked at that often.
_PLACES_EVERY_S = 1.0

STALE_CHARGE_S = 20.0
"""Vehicles tell their charge every second or so; one that is older than this is not told any more."""


@dataclasses.dataclass(frozen=True)
class Energy:
    """What flying costs, as shares of a full battery.

    Attributes:
        endurance_s: Time a full battery lasts, from the mission file.
        reserve_fraction: What must be left after landing.
        cruise_mps: Horizontal speed on the way home.
        climb_mps: Speed upwards.
        descent: Speeds downwards.
        own_return: How it flies home when it is left alone; None: not asked yet.
    """

    endurance_s: float
    reserve_fraction: float
    cruise_mps: float
    climb_mps: float
    descent: Descent
    own_return: OwnReturn | None = None

    def within(self, limits: Limits) -> Energy:
        """The same for a vehicle that is slower than thought."""
        return dataclasses.replace(
            self,
            cruise_mps=min(self.cruise_mps, limits.max_speed_mps),
            climb_mps=min(self.climb_mps, limits.max_climb_mps),
            descent=dataclasses.replace(self.descent, fast_mps=min(self.descent.fast_mps, limits.max_descent_mps)),
        )

    def told(self, own_return: OwnReturn) -> Energy:
        """The same with how the vehicle lands and returns by itself."""
        landing = own_return.descent
        descent = dataclasses.replace(landing, fast_mps=min(self.descent.fast_mps, landing.fast_mps))
        return dataclasses.replace(self, descent=descent, own_return=own_return)

    def at_pace(self, rate: float) -> Energy:
        """The same for a vehicle that flies more slowly than it could.

        Args:
            rate: Share of its speeds, at most one.
        """
        return dataclasses.replace(
            self,
            cruise_mps=rate * self.cruise_mps,
            climb_mps=rate * self.climb_mps,
            descent=dataclasses.replace(self.descent, fast_mps=rate * self.descent.fast_mps),
        )

    def way_home_s(self, position_m: Vector, home_m: Vector, cruise_height_m: float) -> float:
        """Time from a place to the ground at home.

        Args:
            position_m: Where the vehicle is.
            home_m: Where it lands.
            cruise_height_m: Height above home from which it lands.
        """
        across_s = math.hypot(position_m[0] - home_m[0], position_m[1] - home_m[1]) / self.cruise_mps
        rise_m = home_m[2] + cruise_height_m - position_m[2]
        level_s = rise_m / self.climb_mps if rise_m > 0.0 else -rise_m / self.descent.fast_mps
        return _DETOUR * (across_s + level_s) + self.descent.to_ground_s(cruise_height_m)

    def needed_fraction(self, way_home_s: float, alone_s: float, fraction_per_s: float) -> float:
        """Charge that must be left, whoever flies home.

        A vehicle that is left alone is of what nobody planned, so its own return may take a part of the reserve.

        Args:
            way_home_s: Time until it is on the ground at home.
            alone_s: The same, if the vehicle returns by itself.
            fraction_per_s: What flying takes of the charge.
        """
        planned = way_home_s * fraction_per_s + self.reserve_fraction
        return max(planned, alone_s * fraction_per_s + _KEPT_ALONE * self.reserve_fraction)

    def alone_s(self, position_m: Vector, home_m: Vector) -> float:
        """How long the vehicle's own return takes; zero as long as it is not known.

        Args:
            position_m: Where the vehicle is.
            home_m: Where it lands.
        """
        return 0.0 if self.own_return is None else self.own_return.home_s(position_m, home_m)


@dataclasses.dataclass(frozen=True)
class ProvenHome:
    """How long the proven way home took from where it was sought last.

    Attributes:
        from_m: Where that was.
        duration_s: Time above home, at full pace.
    """

    from_m: Vector
    duration_s: float

    def left_s(self, position_m: Vector, home_m: Vector, energy: Energy, rate: float) -> float:
        """Time to above home from another place not far away.

        Args:
            position_m: The place.
            home_m: Home.
            energy: What flying costs.
            rate: Share of its speeds at which it is flown.
        """
        farther_m = math.dist(position_m, home_m) - math.dist(self.from_m, home_m)
        return (self.duration_s + max(0.0, farther_m) / energy.cruise_mps) / rate


@dataclasses.dataclass(frozen=True)
class Consumption:
    """How fast the charge falls, measured in flight.

    Attributes:
        since_s: Flight clock at the first reading.
        battery_fraction: Charge then.
        fraction_per_s: The larger of what was measured and what the endurance says.
        left_fraction: Charge now: the smaller of what is told and what the endurance has left of the first reading.
    """

    since_s: float
    battery_fraction: float
    fraction_per_s: float
    left_fraction: float

    @classmethod
    def begin(cls, battery_fraction: float, now_s: float, energy: Energy) -> Consumption:
        """Nothing measured yet: what the mission file's endurance says."""
        return cls(now_s, battery_fraction, 1.0 / energy.endurance_s, battery_fraction)

    def observed(self, battery_fraction: float, now_s: float, energy: Energy) -> Consumption:
        """With another reading, or with the last one again: what is told may have stopped to fall.

        The charge is told in whole percents, so nothing is concluded before some of them are gone.
        """
        elapsed_s, drop = now_s - self.since_s, self.battery_fraction - battery_fraction
        left = min(battery_fraction, self.battery_fraction - elapsed_s / energy.endurance_s)
        fraction_per_s = self.fraction_per_s
        if elapsed_s >= _LEAST_OBSERVATION_S and drop >= _LEAST_DROP:
            fraction_per_s = max(1.0 / energy.endurance_s, drop / elapsed_s)
        return dataclasses.replace(self, fraction_per_s=fraction_per_s, left_fraction=left)


def places_ahead(curve: Trajectory, from_s: float, begins_in_s: float, rate: float = 1.0) -> list[tuple[float, Vector]]:
    """Where a curve leads, every second of it and at its end, each with the time until then.

    Args:
        curve: What would be flown.
        from_s: Curve time from which on.
        begins_in_s: Time until then.
        rate: Share of its speeds at which it is flown.
    """
    moments = np.append(np.arange(from_s, curve.end_s, _PLACES_EVERY_S), curve.end_s)
    flown_s = begins_in_s + (moments - from_s) / rate
    places_m = curve.sample(moments).position_m
    return [
        (until_s, (east, north, up))
        for until_s, (east, north, up) in zip(flown_s.tolist(), places_m.tolist(), strict=True)
    ]
