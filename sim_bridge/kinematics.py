"""A multirotor as it moves, not as it spins: limits, lags, wind, battery, ground.

Local NED, SI, deterministic for a seed. The controller is the cascade of the autopilots: position error and velocity
feed-forward make a velocity, velocity error and acceleration feed-forward make an acceleration, which the airframe
follows with a lag and a limited jerk.
"""

from __future__ import annotations

import dataclasses
import math
import random

from sim_bridge.state import Vector

GRAVITY_MPS2 = 9.80665
STILL: Vector = (0.0, 0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Airframe:
    """What the vehicle can do; the figures are a PX4 quadrotor's defaults.

    Attributes:
        max_speed_mps: Horizontal.
        max_climb_mps: Upward.
        max_descent_mps: Downward.
        max_acceleration_mps2: Horizontal, before motor derating.
        max_climb_acceleration_mps2: Vertical.
        max_jerk_mps3: Rate of the acceleration.
        max_yaw_rate_radps: Rate of the heading.
        position_gain: Velocity per position error, 1/s.
        velocity_gain: Acceleration per velocity error, 1/s.
        integral_gain: Acceleration per integrated velocity error, 1/s².
        lag_s: Time constant of the acceleration.
        drag: Deceleration per speed through the air, 1/s.
        endurance_s: Time a full battery hovers.
    """

    max_speed_mps: float = 12.0
    max_climb_mps: float = 3.0
    max_descent_mps: float = 1.5
    max_acceleration_mps2: float = 5.0
    max_climb_acceleration_mps2: float = 4.0
    max_jerk_mps3: float = 40.0
    max_yaw_rate_radps: float = math.radians(60.0)
    position_gain: float = 0.95
    velocity_gain: float = 1.8
    integral_gain: float = 0.4
    lag_s: float = 0.12
    drag: float = 0.03
    endurance_s: float = 1200.0


@dataclasses.dataclass(frozen=True)
class Wind:
    """A mean wind with gusts (a first-order Gauss–Markov process).

    Attributes:
        mean_ned_mps: Where the air goes.
        gust_mps: Standard deviation of each horizontal axis.
        gust_time_s: How long a gust lasts.
    """

    mean_ned_mps: Vector = STILL
    gust_mps: float = 0.0
    gust_time_s: float = 3.0


@dataclasses.dataclass(frozen=True)
class Target:
    """What the controller is asked for; None: not asked.

    Attributes:
        position_ned_m: Where to be.
        velocity_ned_mps: How fast to move, added to what the position error asks for.
        acceleration_ned_mps2: Feed-forward.
        yaw_rad: Heading, clockwise from north.
        max_speed_mps: Horizontal bound for this target; None: the airframe's.
        max_climb_mps: Upward bound likewise.
        max_descent_mps: Downward bound likewise.
    """

    position_ned_m: tuple[float | None, float | None, float | None] = (None, None, None)
    velocity_ned_mps: Vector = STILL
    acceleration_ned_mps2: Vector = STILL
    yaw_rad: float | None = None
    max_speed_mps: float | None = None
    max_climb_mps: float | None = None
    max_descent_mps: float | None = None


class Multirotor:
    """State of motion, battery and ground contact.

    Args:
        airframe: What it can do.
        wind: What blows.
        seed: Of the gusts.
        ground_down_m: NED z of the ground.
    """

    def __init__(self, airframe: Airframe, wind: Wind, seed: int = 0, ground_down_m: float = 0.0) -> None:
        self.airframe = airframe
        self.wind = wind
        self.ground_down_m = ground_down_m
        self.position_ned_m: Vector = (0.0, 0.0, ground_down_m)
        self.velocity_ned_mps: Vector = STILL
        self.acceleration_ned_mps2: Vector = STILL
        self.yaw_rad = 0.0
        self.battery = 1.0
        self.derating = 1.0
        self._integral: Vector = STILL
        self._gust = (0.0, 0.0)
        self._random = random.Random(seed)

    @property
    def height_m(self) -> float:
        """Above the ground under it."""
        return self.ground_down_m - self.position_ned_m[2]

    @property
    def on_ground(self) -> bool:
        """Whether it stands."""
        return self.height_m <= 1e-3 and self.velocity_ned_mps[2] >= -1e-6

    def rest(self, dt_s: float) -> None:
        """Let time pass with the motors off: what is in the air falls."""
        x, y, z = self.position_ned_m
        if self.height_m > 1e-3:
            fall = self.velocity_ned_mps[2] + GRAVITY_MPS2 * dt_s
            self.velocity_ned_mps = (self.velocity_ned_mps[0], self.velocity_ned_mps[1], fall)
            z = min(z + fall * dt_s, self.ground_down_m)
            self.position_ned_m = (x + self.velocity_ned_mps[0] * dt_s, y + self.velocity_ned_mps[1] * dt_s, z)
        if z >= self.ground_down_m:
            self.velocity_ned_mps = self.acceleration_ned_mps2 = self._integral = STILL

    def fly(self, target: Target, dt_s: float) -> None:
        """Let time pass under control.

        Args:
            target: What to do.
            dt_s: Short: hundredths of a second.
        """
        frame = self.airframe
        if target.yaw_rad is not None:
            turn = math.remainder(target.yaw_rad - self.yaw_rad, 2.0 * math.pi)
            largest = frame.max_yaw_rate_radps * dt_s
            self.yaw_rad = math.remainder(self.yaw_rad + max(-largest, min(largest, turn)), 2.0 * math.pi)
        wanted = self._wanted_velocity(target)
        air = self._air(dt_s)
        vx, vy, vz = self.velocity_ned_mps
        error = (wanted[0] - vx, wanted[1] - vy, wanted[2] - vz)
        self._integral = tuple(
            max(-3.0, min(3.0, part + frame.integral_gain * each * dt_s))
            for part, each in zip(self._integral, error, strict=True)
        )  # pyright: ignore[reportAttributeAccessIssue]
        ff = target.acceleration_ned_mps2
        ax = ff[0] + frame.velocity_gain * error[0] + self._integral[0]
        ay = ff[1] + frame.velocity_gain * error[1] + self._integral[1]
        az = ff[2] + frame.velocity_gain * error[2] + self._integral[2]
        horizontal = math.hypot(ax, ay)
        most = frame.max_acceleration_mps2 * self.derating
        if horizontal > most:
            ax, ay = ax * most / horizontal, ay * most / horizontal
        az = max(-frame.max_climb_acceleration_mps2 * self.derating, min(frame.max_climb_acceleration_mps2, az))
        self.acceleration_ned_mps2 = self._lagged((ax, ay, az), dt_s)
        ax, ay, az = self.acceleration_ned_mps2
        nx = vx + (ax + frame.drag * (air[0] - vx)) * dt_s
        ny = vy + (ay + frame.drag * (air[1] - vy)) * dt_s
        nz = vz + (az - frame.drag * vz) * dt_s
        x, y, z = self.position_ned_m
        z += 0.5 * (vz + nz) * dt_s
        if z >= self.ground_down_m:
            z, nx, ny, nz = self.ground_down_m, 0.0, 0.0, min(nz, 0.0)
        self.position_ned_m = (x + 0.5 * (vx + nx) * dt_s, y + 0.5 * (vy + ny) * dt_s, z)
        self.velocity_ned_mps = (nx, ny, nz)
        speed = math.sqrt(nx * nx + ny * ny + nz * nz)
        power = 0.95 + 0.05 * (speed / 10.0) ** 2 + 0.1 * max(0.0, -nz)
        self.battery = max(0.0, self.battery - power * dt_s / frame.endurance_s)

    def _wanted_velocity(self, target: Target) -> Vector:
        frame = self.airframe
        errors = [
            0.0 if wanted is None else frame.position_gain * (wanted - here)
            for wanted, here in zip(target.position_ned_m, self.position_ned_m, strict=True)
        ]
        vx, vy, vz = (error + ff for error, ff in zip(errors, target.velocity_ned_mps, strict=True))
        fastest = min(frame.max_speed_mps, target.max_speed_mps or math.inf)
        speed = math.hypot(vx, vy)
        if speed > fastest:
            vx, vy = vx * fastest / speed, vy * fastest / speed
        climb = min(frame.max_climb_mps, target.max_climb_mps or math.inf)
        descent = min(frame.max_descent_mps, target.max_descent_mps or math.inf)
        return vx, vy, max(-climb, min(descent, vz))

    def _lagged(self, wanted: Vector, dt_s: float) -> Vector:
        share = min(1.0, dt_s / self.airframe.lag_s)
        step = [share * (to - now) for to, now in zip(wanted, self.acceleration_ned_mps2, strict=True)]
        size = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        longest = self.airframe.max_jerk_mps3 * dt_s
        scale = longest / size if size > longest else 1.0
        x, y, z = self.acceleration_ned_mps2
        return x + scale * step[0], y + scale * step[1], z + scale * step[2]

    def _air(self, dt_s: float) -> tuple[float, float]:
        wind = self.wind
        if wind.gust_mps > 0.0:
            keep = math.exp(-dt_s / wind.gust_time_s)
            kick = wind.gust_mps * math.sqrt(1.0 - keep * keep)
            self._gust = (
                keep * self._gust[0] + kick * self._random.gauss(0.0, 1.0),
                keep * self._gust[1] + kick * self._random.gauss(0.0, 1.0),
            )
        return wind.mean_ned_mps[0] + self._gust[0], wind.mean_ned_mps[1] + self._gust[1]
