"""A multirotor as it moves, not as it spins: limits, lags, wind, battery, ground.

Local NED, SI units, deterministic for a seed. The controller is the cascade of the autopilots: position error and
velocity feed-forward make a velocity, velocity error and acceleration feed-forward make an acceleration, which the
airframe follows with a lag, a limited jerk, and the thrust it has. Plain floats throughout: this is the innermost loop
of every simulated second.
"""

from __future__ import annotations

import dataclasses
import math
import random

from sim_bridge.state import GRAVITY_MPS2, Vector

STILL: Vector = (0.0, 0.0, 0.0)
# Share of power that hovering needs, and what speed and climbing add to it.
_HOVER_POWER, _SPEED_POWER, _CLIMB_POWER = 0.95, 0.0005, 0.1
_IDLE_POWER = 0.05
_INTEGRAL_LIMIT_MPS2 = 4.0
_TOUCH_M = 1e-3


@dataclasses.dataclass(frozen=True)
class Airframe:
    """What the vehicle itself can do and how it is tuned; the figures are a PX4 quadrotor's.

    Attributes:
        max_acceleration_mps2: Horizontal.
        max_climb_acceleration_mps2: Vertical.
        max_jerk_mps3: Rate of the acceleration.
        max_yaw_rate_radps: Rate of the heading.
        thrust_to_weight: Full thrust over weight; derating takes from it.
        position_gain: Velocity per position error, 1/s.
        velocity_gain: Acceleration per velocity error, 1/s.
        integral_gain: Acceleration per integrated velocity error, 1/s².
        lag_s: Time constant of the acceleration.
        drag: Deceleration per speed through the air, 1/s.
        endurance_s: Time a full battery hovers.
    """

    max_acceleration_mps2: float = 5.0
    max_climb_acceleration_mps2: float = 4.0
    max_jerk_mps3: float = 40.0
    max_yaw_rate_radps: float = math.radians(60.0)
    thrust_to_weight: float = 2.0
    position_gain: float = 0.95
    velocity_gain: float = 1.8
    integral_gain: float = 0.4
    lag_s: float = 0.12
    drag: float = 0.03
    endurance_s: float = 1200.0


@dataclasses.dataclass(frozen=True)
class SpeedLimits:
    """How fast the autopilot lets its controller go.

    Attributes:
        horizontal_mps: Over ground.
        climb_mps: Upward.
        descent_mps: Downward.
    """

    horizontal_mps: float = 12.0
    climb_mps: float = 3.0
    descent_mps: float = 1.5


@dataclasses.dataclass(frozen=True)
class Wind:
    """A mean wind with gusts (a first-order Gauss–Markov process on each horizontal axis).

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
    """What the controller is asked for.

    Attributes:
        position_ned_m: Where to be, by axis; None: not asked.
        velocity_ned_mps: How fast to move, added to what the position error asks for; None: the acceleration alone.
        acceleration_ned_mps2: Feed-forward.
        yaw_rad: Heading, clockwise from north; None: as it is.
        yaw_rate_radps: Rate of the heading, where no heading is given.
    """

    position_ned_m: tuple[float | None, float | None, float | None] = (None, None, None)
    velocity_ned_mps: Vector | None = STILL
    acceleration_ned_mps2: Vector = STILL
    yaw_rad: float | None = None
    yaw_rate_radps: float = 0.0


class Multirotor:
    """State of motion, battery and ground contact: what is true, not what an estimator believes.

    Args:
        airframe: What it can do.
        wind: What blows.
        seed: Of the gusts.
        ground_down_m: NED z of the ground.
    """

    def __init__(self, airframe: Airframe, wind: Wind, seed: int = 0, ground_down_m: float = 0.0) -> None:
        self.airframe = airframe
        self.wind = wind
        self.limits = SpeedLimits()
        self.ground_down_m = ground_down_m
        self.position_ned_m: Vector = (0.0, 0.0, ground_down_m)
        self.velocity_ned_mps: Vector = STILL
        self.acceleration_ned_mps2: Vector = STILL
        self.yaw_rad = 0.0
        self.battery = 1.0
        self.derating = 1.0
        """Share of the thrust that is left."""
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
        return self.height_m <= _TOUCH_M and self.velocity_ned_mps[2] >= -1e-6

    def rest(self, dt_s: float) -> None:
        """Let time pass with the motors off: what is in the air falls."""
        x, y, z = self.position_ned_m
        if self.height_m > _TOUCH_M:
            vx, vy, vz = self.velocity_ned_mps
            vz += GRAVITY_MPS2 * dt_s
            z = min(z + vz * dt_s, self.ground_down_m)
            self.velocity_ned_mps = (vx, vy, vz)
            self.position_ned_m = (x + vx * dt_s, y + vy * dt_s, z)
        if z >= self.ground_down_m:
            self.velocity_ned_mps = self.acceleration_ned_mps2 = self._integral = STILL

    def idle(self, dt_s: float) -> None:
        """Let time pass with the motors turning but giving no lift."""
        self.rest(dt_s)
        self.battery = max(0.0, self.battery - _IDLE_POWER * dt_s / self.airframe.endurance_s)

    def fly(self, target: Target, dt_s: float) -> None:
        """Let time pass under control.

        Args:
            target: What to do; finite numbers.
            dt_s: Short: hundredths of a second.
        """
        frame = self.airframe
        self._turn(target, dt_s)
        wx, wy, wz = self._wanted_velocity(target)
        vx, vy, vz = self.velocity_ned_mps
        ex, ey, ez = wx - vx, wy - vy, wz - vz
        gain, (ix, iy, iz), (fx, fy, fz) = frame.velocity_gain, self._integral, target.acceleration_ned_mps2
        ax, ay, az = self._possible(fx + gain * ex + ix, fy + gain * ey + iy, fz + gain * ez + iz)
        self._integrate(fx + gain * ex + ix - ax, fy + gain * ey + iy - ay, ex, ey, ez, dt_s)
        ax, ay, az = self._follow(ax, ay, az, dt_s)
        self.acceleration_ned_mps2 = (ax, ay, az)
        wind_x, wind_y, wind_z = self._air(dt_s)
        nx = vx + (ax + frame.drag * (wind_x - vx)) * dt_s
        ny = vy + (ay + frame.drag * (wind_y - vy)) * dt_s
        nz = vz + (az + frame.drag * (wind_z - vz)) * dt_s
        x, y, z = self.position_ned_m
        z += 0.5 * (vz + nz) * dt_s
        if z >= self.ground_down_m:
            z, nx, ny, nz = self.ground_down_m, 0.0, 0.0, min(nz, 0.0)
        self.position_ned_m = (x + 0.5 * (vx + nx) * dt_s, y + 0.5 * (vy + ny) * dt_s, z)
        self.velocity_ned_mps = (nx, ny, nz)
        power = _HOVER_POWER + _SPEED_POWER * (nx * nx + ny * ny) + _CLIMB_POWER * max(0.0, -nz)
        self.battery = max(0.0, self.battery - power * dt_s / frame.endurance_s)

    def _turn(self, target: Target, dt_s: float) -> None:
        largest = self.airframe.max_yaw_rate_radps * dt_s
        wanted = target.yaw_rate_radps * dt_s
        if target.yaw_rad is not None:
            wanted = math.remainder(target.yaw_rad - self.yaw_rad, 2.0 * math.pi)
        if wanted != 0.0:
            self.yaw_rad = math.remainder(self.yaw_rad + max(-largest, min(largest, wanted)), 2.0 * math.pi)

    def _wanted_velocity(self, target: Target) -> Vector:
        """Feed-forward plus what brings the error down; where both together are too fast, the error has priority."""
        if target.velocity_ned_mps is None:
            return self.velocity_ned_mps
        gain, limits = self.airframe.position_gain, self.limits
        (px, py, pz), (x, y, z) = target.position_ned_m, self.position_ned_m
        fx, fy, fz = target.velocity_ned_mps
        cx = 0.0 if px is None else gain * (px - x)
        cy = 0.0 if py is None else gain * (py - y)
        cz = 0.0 if pz is None else gain * (pz - z)
        fastest = limits.horizontal_mps
        vx, vy = cx + fx, cy + fy
        if vx * vx + vy * vy > fastest * fastest:
            correction = math.hypot(cx, cy)
            if correction >= fastest:
                vx, vy = cx * fastest / correction, cy * fastest / correction
            else:
                share = _share_within(cx, cy, fx, fy, fastest)
                vx, vy = cx + share * fx, cy + share * fy
        return vx, vy, max(-limits.climb_mps, min(limits.descent_mps, cz + fz))

    def _possible(self, ax: float, ay: float, az: float) -> Vector:
        """An acceleration within the limits and the thrust; height has priority over place."""
        frame = self.airframe
        thrust = frame.thrust_to_weight * GRAVITY_MPS2 * self.derating
        most_up = min(frame.max_climb_acceleration_mps2, thrust - GRAVITY_MPS2)
        az = max(-most_up, min(frame.max_climb_acceleration_mps2, az))
        lift = GRAVITY_MPS2 - az
        most = min(frame.max_acceleration_mps2, math.sqrt(max(0.0, thrust * thrust - lift * lift)))
        size = math.hypot(ax, ay)
        if size > most:
            ax, ay = ax * most / size, ay * most / size
        return ax, ay, az

    def _integrate(self, cut_x: float, cut_y: float, ex: float, ey: float, ez: float, dt_s: float) -> None:
        """Learn what drag and wind take, but not while the acceleration is at its limit and would only wind up."""
        share, (ix, iy, iz) = self.airframe.integral_gain * dt_s, self._integral
        if cut_x * ex <= 0.0:
            ix += share * ex
        if cut_y * ey <= 0.0:
            iy += share * ey
        iz += share * ez
        most = _INTEGRAL_LIMIT_MPS2
        self._integral = (max(-most, min(most, ix)), max(-most, min(most, iy)), max(-most, min(most, iz)))

    def _follow(self, ax: float, ay: float, az: float, dt_s: float) -> Vector:
        """The airframe's own acceleration, one step nearer to the wanted one."""
        share = min(1.0, dt_s / self.airframe.lag_s)
        x, y, z = self.acceleration_ned_mps2
        dx, dy, dz = share * (ax - x), share * (ay - y), share * (az - z)
        size = math.sqrt(dx * dx + dy * dy + dz * dz)
        longest = self.airframe.max_jerk_mps3 * dt_s
        if size > longest:
            scale = longest / size
            return x + scale * dx, y + scale * dy, z + scale * dz
        return x + dx, y + dy, z + dz

    def _air(self, dt_s: float) -> Vector:
        wind = self.wind
        north, east, down = wind.mean_ned_mps
        if wind.gust_mps > 0.0:
            keep = math.exp(-dt_s / wind.gust_time_s)
            kick = wind.gust_mps * math.sqrt(1.0 - keep * keep)
            gust_x, gust_y = self._gust
            gust_x = keep * gust_x + kick * self._random.gauss(0.0, 1.0)
            gust_y = keep * gust_y + kick * self._random.gauss(0.0, 1.0)
            self._gust = (gust_x, gust_y)
            return north + gust_x, east + gust_y, down
        return wind.mean_ned_mps


def _share_within(cx: float, cy: float, fx: float, fy: float, radius: float) -> float:
    """The largest s ≤ 1 with |c + s f| ≤ radius, for |c| < radius."""
    a = fx * fx + fy * fy
    b = cx * fx + cy * fy
    c = cx * cx + cy * cy - radius * radius
    return min(1.0, (-b + math.sqrt(b * b - a * c)) / a)
