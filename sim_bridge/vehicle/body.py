"""What every personality of the built-in vehicle has: the moving body, and what it believes of its place."""

from __future__ import annotations

import dataclasses
import math

from sim_bridge.dialects import Autopilot
from sim_bridge.frames import geodetic_from_local_ned, local_ned_from_geodetic
from sim_bridge.state import GeodeticPoint, Vector
from sim_bridge.vehicle.estimator import Estimator
from sim_bridge.vehicle.kinematics import Airframe, Multirotor, Target, Wind

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
        ready_after_s: From boot until it can be armed; None: as long as the real one takes.
        battery: Charge at the start, 0 … 1.
        wander_m: How far the position estimate wanders from the truth.
        seed: Of everything random.
    """

    ground: GeodeticPoint
    system: int = 1
    airframe: Airframe = dataclasses.field(default_factory=Airframe)
    wind: Wind = dataclasses.field(default_factory=Wind)
    parameters: tuple[tuple[str, float], ...] = ()
    ready_after_s: float | None = None
    battery: float = 1.0
    wander_m: float = 0.8
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.system <= 255:
            raise ValueError(f"a system id is 1 to 255, got {self.system}")
        if not 0.0 <= self.battery <= 1.0:
            raise ValueError(f"a battery's charge is 0 to 1, got {self.battery}")


class Body:
    """The vehicle without its autopilot.

    Its clock is the world's: an autopilot that restarts counts from its own boot.

    Args:
        config: How it is set up.
        autopilot: Whose map of the earth it uses.
        dead_reckoning_s: How long that autopilot trusts its position without GPS.
    """

    def __init__(self, config: VehicleConfig, autopilot: Autopilot, dead_reckoning_s: float) -> None:
        self.config = config
        self.autopilot = autopilot
        self.origin = geodetic_from_local_ned(autopilot, ORIGIN_OFFSET_NED_M, config.ground)
        stands = local_ned_from_geodetic(autopilot, config.ground, self.origin)
        self.rotor = Multirotor(config.airframe, config.wind, config.seed, ground_down_m=stands[2])
        self.rotor.position_ned_m = stands
        self.rotor.battery = config.battery
        self.estimator = Estimator(config.wander_m, dead_reckoning_s, config.seed)
        self.estimator.advance(0.0, 0.0)
        self.armed = False
        self.home_ned_m = stands
        self.time_s = 0.0

    def advance(self, now_s: float, target: Target | None) -> None:
        """Move until a moment: after a target, or (None) without lift."""
        while self.time_s + PHYSICS_STEP_S <= now_s + 1e-9:
            self.time_s += PHYSICS_STEP_S
            self.estimator.advance(self.time_s, PHYSICS_STEP_S)
            if not self.armed:
                self.rotor.rest(PHYSICS_STEP_S)
            elif target is None:
                self.rotor.idle(PHYSICS_STEP_S)
            else:
                self.rotor.fly(self._in_truth(target), PHYSICS_STEP_S)

    @property
    def position_ned_m(self) -> Vector:
        """Where the vehicle believes to be."""
        x, y, z = self.rotor.position_ned_m
        dx, dy, dz = self.estimator.offset_ned_m
        return x + dx, y + dy, z + dz

    @property
    def position_valid(self) -> bool:
        """Whether it trusts that."""
        return self.estimator.valid(self.time_s)

    @property
    def on_ground(self) -> bool:
        """Whether it stands, as its land detector knows."""
        return self.rotor.on_ground

    def set_home(self) -> None:
        """Home is where the vehicle believes to stand."""
        self.home_ned_m = self.position_ned_m

    def start_anew(self) -> None:
        """The estimator starts again: its map's origin is beside where the vehicle is now, and all is seen from there.

        On the ground home is there too; in the air it stays the place that it was.
        """
        here, home = self.geodetic(self.rotor.position_ned_m), self.geodetic(self.home_ned_m)
        height_m = self.rotor.height_m
        self.origin = geodetic_from_local_ned(self.autopilot, ORIGIN_OFFSET_NED_M, here)
        self.rotor.position_ned_m = self.local_ned(here)
        self.rotor.ground_down_m = self.rotor.position_ned_m[2] + height_m
        self.home_ned_m = self.position_ned_m if self.on_ground else self.local_ned(home)

    def stopping_place_ned_m(self, deceleration_mps2: float) -> Vector:
        """Where the vehicle comes to a stand from the speed it has."""
        x, y, z = self.position_ned_m
        vx, vy, vz = self.rotor.velocity_ned_mps
        stop_s = math.hypot(vx, vy) / (2.0 * deceleration_mps2)
        return x + vx * stop_s, y + vy * stop_s, min(z + 0.3 * vz, self.rotor.ground_down_m)

    def geodetic(self, position_ned_m: Vector | None = None) -> GeodeticPoint:
        """A position (None: where the vehicle believes to be) as WGS84."""
        position_ned_m = self.position_ned_m if position_ned_m is None else position_ned_m
        return geodetic_from_local_ned(self.autopilot, position_ned_m, self.origin)

    def local_ned(self, point: GeodeticPoint) -> Vector:
        """A WGS84 position in the vehicle's map."""
        return local_ned_from_geodetic(self.autopilot, point, self.origin)

    @property
    def home_amsl_m(self) -> float:
        """Home's height above sea level."""
        return self.origin.altitude_amsl_m - self.home_ned_m[2]

    def distance_m(self, place_ned_m: Vector) -> float:
        """Horizontal distance to a place, as believed."""
        x, y, _ = self.position_ned_m
        return math.hypot(x - place_ned_m[0], y - place_ned_m[1])

    def distance_home_m(self) -> float:
        """Horizontal distance to home, as believed."""
        return self.distance_m(self.home_ned_m)

    def _in_truth(self, target: Target) -> Target:
        """What the controller, which knows the estimate only, makes the true vehicle do."""
        (x, y, z), (dx, dy, dz) = target.position_ned_m, self.estimator.offset_ned_m
        believed = (
            None if x is None else x - dx,
            None if y is None else y - dy,
            None if z is None else z - dz,
        )
        return Target(
            believed, target.velocity_ned_mps, target.acceleration_ned_mps2, target.yaw_rad, target.yaw_rate_radps
        )
