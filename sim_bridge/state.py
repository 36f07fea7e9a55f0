"""What a vehicle is told and what it tells: values with frames and units in their names.

The border between `mission` and `sim_bridge`: everything here is local ENU metres relative to the *mission's*
origin, and seconds of the vehicle's own time.
"""

from __future__ import annotations

import dataclasses
import math

Vector = tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class GeodeticPoint:
    """A WGS84 position.

    Attributes:
        latitude_deg: Latitude, degrees north.
        longitude_deg: Longitude, degrees east.
        altitude_amsl_m: Height above mean sea level, metres.
    """

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float


@dataclasses.dataclass(frozen=True)
class Setpoint:
    """One point of the curve to fly, as streamed to a vehicle.

    Attributes:
        position_enu_m: Position, metres.
        velocity_enu_mps: Velocity feed-forward, metres per second.
        acceleration_enu_mps2: Acceleration feed-forward, metres per second squared.
        yaw_enu_rad: Heading, counter-clockwise from east, radians.

    Raises:
        ValueError: If any number is not finite: such a setpoint must never reach a vehicle.
    """

    position_enu_m: Vector
    velocity_enu_mps: Vector
    acceleration_enu_mps2: Vector
    yaw_enu_rad: float

    def __post_init__(self) -> None:
        numbers = (*self.position_enu_m, *self.velocity_enu_mps, *self.acceleration_enu_mps2, self.yaw_enu_rad)
        if not all(math.isfinite(number) for number in numbers):
            raise ValueError(f"a setpoint needs finite numbers, got {self}: plan again or hold the last one")

    @classmethod
    def hold(cls, position_enu_m: Vector, yaw_enu_rad: float) -> Setpoint:
        """The setpoint that stays at a place: zero velocity and acceleration."""
        return cls(position_enu_m, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), yaw_enu_rad)
