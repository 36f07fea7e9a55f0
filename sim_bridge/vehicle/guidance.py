"""How autonomous modes move: along a line, up, down, back. From the body's state to a target for its controller."""

from __future__ import annotations

import dataclasses
import enum
import math

from sim_bridge.state import Vector
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.kinematics import Target

# Share of the acceleration limit that braking before a place uses.
BRAKING_SHARE = 0.5
TURN_TOWARDS_BEYOND_M = 3.0
_NEAR_M = 1.0
_LEVEL_WITHIN_M = 1.0
_OVER_DESTINATION_M = 1.0


def braking_mps2(body: Body) -> float:
    """Deceleration that autonomous modes plan with."""
    return BRAKING_SHARE * body.rotor.airframe.max_acceleration_mps2


def hold(position_ned_m: Vector, yaw_rad: float) -> Target:
    """Stay at a place."""
    return Target(position_ned_m=position_ned_m, yaw_rad=yaw_rad)


def follow_line(body: Body, start_ned_m: Vector, end_ned_m: Vector, cruise_mps: float) -> Target:
    """Fly the straight line between two places and brake at its end, the nose in the direction of flight."""
    here, limits = body.position_ned_m, body.rotor.limits
    length = math.dist(start_ned_m, end_ned_m)
    remaining = math.dist(here, end_ned_m)
    if length < _NEAR_M or remaining < _NEAR_M:
        return Target(position_ned_m=end_ned_m)
    tx, ty, tz = ((end - start) / length for start, end in zip(start_ned_m, end_ned_m, strict=True))
    along = sum(t * (x - x0) for t, x, x0 in zip((tx, ty, tz), here, start_ned_m, strict=True))
    along = max(0.0, min(length, along))
    speed = min(cruise_mps, math.sqrt(2.0 * braking_mps2(body) * (length - along)))
    vertical = limits.climb_mps if tz < 0.0 else limits.descent_mps
    if abs(tz) * speed > vertical:
        speed = vertical / abs(tz)
    x0, y0, z0 = start_ned_m
    far = math.hypot(end_ned_m[0] - here[0], end_ned_m[1] - here[1]) > TURN_TOWARDS_BEYOND_M
    return Target(
        position_ned_m=(x0 + along * tx, y0 + along * ty, z0 + along * tz),
        velocity_ned_mps=(speed * tx, speed * ty, speed * tz),
        yaw_rad=math.atan2(ty, tx) if far and math.hypot(tx, ty) > 0.1 else None,
    )


def descend(position_ned_m: Vector, speed_mps: float, yaw_rad: float) -> Target:
    """Down at a given speed, over one place."""
    return Target(
        position_ned_m=(position_ned_m[0], position_ned_m[1], None),
        velocity_ned_mps=(0.0, 0.0, speed_mps),
        yaw_rad=yaw_rad,
    )


def climb(body: Body, position_ned_m: Vector, speed_mps: float, yaw_rad: float) -> Target:
    """Up (or down) to a place's height, over it."""
    rise = body.rotor.airframe.position_gain * (position_ned_m[2] - body.position_ned_m[2])
    return Target(
        position_ned_m=(position_ned_m[0], position_ned_m[1], None),
        velocity_ned_mps=(0.0, 0.0, max(-speed_mps, min(speed_mps, rise))),
        yaw_rad=yaw_rad,
    )


def is_at(body: Body, place_ned_m: Vector, radius_m: float, height_m: float) -> bool:
    """Whether a place is reached, within a radius and a height."""
    x, y, z = body.position_ned_m
    return math.hypot(place_ned_m[0] - x, place_ned_m[1] - y) <= radius_m and abs(place_ned_m[2] - z) <= height_m


@dataclasses.dataclass(frozen=True)
class Landing:
    """How fast an autopilot comes down.

    Attributes:
        high_mps: High above the ground.
        low_mps: Near the ground.
        low_below_m: Height from which on it is near.
    """

    high_mps: float
    low_mps: float
    low_below_m: float

    def target(self, body: Body, over_ned_m: Vector, yaw_rad: float) -> Target:
        """Down over a place."""
        speed = self.high_mps if body.rotor.height_m > self.low_below_m else self.low_mps
        return descend(over_ned_m, speed, yaw_rad)


class Leg(enum.Enum):
    """Where a return stands."""

    CLIMB = "climb"
    CROSS = "cross"
    LOITER = "loiter"
    DESCEND = "descend"


class Return:
    """Up, over to a place to land at, and down.

    Args:
        body: Of the vehicle, at the moment the return begins.
        destination_ned_m: Home or a rally point.
        down_m: NED z to cross at.
        climb_mps: Speed upwards.
        cruise_mps: Speed on the way.
        landing: How it comes down.
        loiter_s: How long it waits above the destination; infinite: it stays there.
        final_m: Height above the destination at which it ends; zero: on the ground.
    """

    def __init__(
        self,
        body: Body,
        destination_ned_m: Vector,
        down_m: float,
        climb_mps: float,
        cruise_mps: float,
        landing: Landing,
        loiter_s: float = 0.0,
        final_m: float = 0.0,
    ) -> None:
        x, y, _ = body.stopping_place_ned_m(braking_mps2(body))
        self._climb_to: Vector = (x, y, down_m)
        self._above: Vector = (*destination_ned_m[:2], down_m)
        self._climb_mps = climb_mps
        self._cruise_mps = cruise_mps
        self._landing = landing
        self._loiter_s = loiter_s
        self._end: Vector | None = (*destination_ned_m[:2], destination_ned_m[2] - final_m) if final_m > 0.0 else None
        self._arrived_s = 0.0
        self._yaw_rad = body.rotor.yaw_rad
        self.leg = Leg.CLIMB

    def target(self, body: Body) -> Target:
        """What to do now."""
        if self.leg is Leg.CLIMB:
            if abs(body.position_ned_m[2] - self._climb_to[2]) > _LEVEL_WITHIN_M:
                return climb(body, self._climb_to, self._climb_mps, self._yaw_rad)
            self.leg = Leg.CROSS
        if self.leg is Leg.CROSS:
            if not is_at(body, self._above, _OVER_DESTINATION_M, math.inf):
                return follow_line(body, self._climb_to, self._above, self._cruise_mps)
            self.leg = Leg.LOITER
            self._arrived_s, self._yaw_rad = body.time_s, body.rotor.yaw_rad
        if self.leg is Leg.LOITER:
            if body.time_s - self._arrived_s < self._loiter_s:
                return hold(self._above, self._yaw_rad)
            self.leg = Leg.DESCEND
        if self._end is not None:
            return climb(body, self._end, self._landing.high_mps, self._yaw_rad)
        return self._landing.target(body, self._above, self._yaw_rad)
