"""What every personality of the built-in vehicle has: the moving body and its places."""

from __future__ import annotations

import dataclasses
import math

from sim_bridge.frames import geodetic_from_local_ned, local_ned_from_geodetic
from sim_bridge.kinematics import Airframe, Multirotor, Target, Wind
from sim_bridge.link_autopilot import Autopilot
from sim_bridge.state import GeodeticPoint, Vector

PHYSICS_STEP_S = 0.01
# The estimator's origin is set where and when GPS was first good: beside the vehicle, and not at the ground's height.
ORIGIN_OFFSET_NED_M: Vector = (0.4, -0.3, -1.3)


@dataclasses.dataclass(frozen=True)
class VehicleConfig:
    """How a built-in vehicle is set up.

    Attributes:
        ground: Where it stands.
        system: MAVLink system id.
        airframe: What it can do.
        wind: What blows.
        parameters: Changes to the autopilot's defaults.
        ready_after_s: From boot until it can be armed.
        battery: Charge at the start, 0 … 1.
        seed: Of everything random.
    """

    ground: GeodeticPoint
    system: int = 1
    airframe: Airframe = dataclasses.field(default_factory=Airframe)
    wind: Wind = dataclasses.field(default_factory=Wind)
    parameters: tuple[tuple[str, float], ...] = ()
    ready_after_s: float = 36.0
    battery: float = 1.0
    seed: int = 0


class Body:
    """The vehicle without its autopilot.

    Args:
        config: How it is set up.
        autopilot: Whose map of the earth it uses.
    """

    def __init__(self, config: VehicleConfig, autopilot: Autopilot) -> None:
        self.config = config
        self.autopilot = autopilot
        self.origin = geodetic_from_local_ned(autopilot, ORIGIN_OFFSET_NED_M, config.ground)
        stands = local_ned_from_geodetic(autopilot, config.ground, self.origin)
        self.rotor = Multirotor(config.airframe, config.wind, config.seed, ground_down_m=stands[2])
        self.rotor.position_ned_m = stands
        self.rotor.battery = config.battery
        self.home_ned_m = stands
        self.armed = False
        self._time_s = 0.0

    def advance(self, now_s: float, target: Target | None) -> None:
        """Move until a moment, under control or (None) with the motors off."""
        while self._time_s + PHYSICS_STEP_S <= now_s:
            self._time_s += PHYSICS_STEP_S
            if self.armed and target is not None:
                self.rotor.fly(target, PHYSICS_STEP_S)
            else:
                self.rotor.rest(PHYSICS_STEP_S)

    def geodetic(self, position_ned_m: Vector | None = None) -> GeodeticPoint:
        """A position (None: the vehicle's) as WGS84."""
        return geodetic_from_local_ned(self.autopilot, position_ned_m or self.rotor.position_ned_m, self.origin)

    def local_ned(self, point: GeodeticPoint) -> Vector:
        """A WGS84 position in the vehicle's map."""
        return local_ned_from_geodetic(self.autopilot, point, self.origin)

    def distance_home_m(self) -> float:
        """Horizontal distance to home."""
        x, y, _ = self.rotor.position_ned_m
        return math.hypot(x - self.home_ned_m[0], y - self.home_ned_m[1])
