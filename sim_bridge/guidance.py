"""How autonomous modes move: to a place, up, down, home. From the body's state to a target for its controller."""

from __future__ import annotations

import math

from sim_bridge.body import Body
from sim_bridge.kinematics import Target
from sim_bridge.state import Vector

# Share of the acceleration limit that braking before a place uses.
BRAKING_SHARE = 0.5
TURN_TOWARDS_BEYOND_M = 3.0


def hold(position_ned_m: Vector, yaw_rad: float) -> Target:
    """Stay at a place."""
    return Target(position_ned_m=position_ned_m, yaw_rad=yaw_rad)


def go_to(body: Body, place_ned_m: Vector, cruise_mps: float, yaw_rad: float | None = None) -> Target:
    """Fly straight to a place, braking in time, the nose in the direction of flight."""
    x, y, _ = body.rotor.position_ned_m
    dx, dy = place_ned_m[0] - x, place_ned_m[1] - y
    distance = math.hypot(dx, dy)
    braking = BRAKING_SHARE * body.rotor.airframe.max_acceleration_mps2
    speed = min(cruise_mps, math.sqrt(2.0 * braking * distance))
    if distance > TURN_TOWARDS_BEYOND_M and yaw_rad is None:
        yaw_rad = math.atan2(dy, dx)
    if distance < 1.0:
        return Target(position_ned_m=place_ned_m, yaw_rad=yaw_rad, max_speed_mps=cruise_mps)
    velocity = (dx / distance * speed, dy / distance * speed, 0.0)
    return Target(position_ned_m=(None, None, place_ned_m[2]), velocity_ned_mps=velocity, yaw_rad=yaw_rad)


def descend(position_ned_m: Vector, speed_mps: float, yaw_rad: float) -> Target:
    """Down at a given speed, over one place."""
    return Target(
        position_ned_m=(position_ned_m[0], position_ned_m[1], None),
        velocity_ned_mps=(0.0, 0.0, speed_mps),
        yaw_rad=yaw_rad,
    )


def climb(position_ned_m: Vector, down_m: float, speed_mps: float, yaw_rad: float) -> Target:
    """Up (or down) to a height over one place."""
    return Target(
        position_ned_m=(position_ned_m[0], position_ned_m[1], down_m),
        yaw_rad=yaw_rad,
        max_climb_mps=speed_mps,
        max_descent_mps=speed_mps,
    )


def is_at(body: Body, place_ned_m: Vector, radius_m: float, height_m: float) -> bool:
    """Whether a place is reached, within a radius and a height."""
    x, y, z = body.rotor.position_ned_m
    return math.hypot(place_ned_m[0] - x, place_ned_m[1] - y) <= radius_m and abs(place_ned_m[2] - z) <= height_m
