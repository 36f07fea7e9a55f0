"""What the vehicle is told to follow: proven curves one after another, and how fast time runs along them.

Stopping never leaves the proven path: the rate r at which the curve's time s runs against the vehicle's time
t falls from 1 to 0, so the vehicle brakes along the curve and stands on it; resuming runs the rate up again.

| symbol | identifier       | unit | meaning                                        |
|--------|------------------|------|------------------------------------------------|
| t      | `now_s`          | s    | flight clock (the vehicle's time, continuous)  |
| s      | `curve_s`        | s    | time along the curve                           |
| r      | `rate`           | 1    | ds/dt; the velocity is r·x'(s)                 |
| ṙ      | `rate_per_s`     | 1/s  | the acceleration is r²·x''(s) + ṙ·x'(s)        |
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from jaxtyping import Float

from planner.gate import ProvenTrajectory
from planner.trajectory import Motion, Trajectory, Turning
from planner.yaw import headings
from sim_bridge.state import Setpoint, Vector

_HEADING_INTERVAL_S = 0.1
_SHORTEST_RAMP_S = 0.5
_NEAREST_STEP_S = 0.1
# Braking shares the acceleration limit with the curve's own acceleration.
_BRAKING_SHARE = 0.6
# A rate that is continued has to pass the gate, whatever rounding did to it.
_KEPT_RATE_SHARE = 1.0 - 1e-6


@dataclasses.dataclass(frozen=True)
class Pace:
    """Curve time against vehicle time: a rate that changes along one linear ramp and then stays.

    Attributes:
        time_s: Vehicle time at which the ramp begins.
        curve_s: Curve time at that moment.
        rate: ds/dt at that moment.
        target_rate: ds/dt after the ramp.
        ramp_s: Length of the ramp in vehicle time; zero: the target holds at once.
    """

    time_s: float
    curve_s: float
    rate: float = 1.0
    target_rate: float = 1.0
    ramp_s: float = 0.0

    def at(self, now_s: float) -> tuple[float, float, float]:
        """Curve time, rate, and change of the rate per second."""
        elapsed = max(0.0, now_s - self.time_s)
        if elapsed < self.ramp_s:
            slope = (self.target_rate - self.rate) / self.ramp_s
            return (
                self.curve_s + elapsed * (self.rate + 0.5 * slope * elapsed),
                self.rate + slope * elapsed,
                slope,
            )
        ramp_curve_s = 0.5 * (self.rate + self.target_rate) * self.ramp_s
        return self.curve_s + ramp_curve_s + self.target_rate * (elapsed - self.ramp_s), self.target_rate, 0.0


@dataclasses.dataclass(frozen=True)
class Heading:
    """Where the nose points along a curve, sampled.

    Attributes:
        start_s: Curve time of the first sample.
        yaw_rad: Shape (time,), one each 0.1 s, unwrapped.
    """

    start_s: float
    yaw_rad: Float[np.ndarray, "time"]

    @property
    def end_s(self) -> float:
        """Curve time of the last sample."""
        return self.start_s + _HEADING_INTERVAL_S * (len(self.yaw_rad) - 1)

    def at(self, curve_s: float) -> float:
        """The heading at a curve time, counter-clockwise from east, radians."""
        place = (curve_s - self.start_s) / _HEADING_INTERVAL_S
        return float(np.interp(place, np.arange(len(self.yaw_rad)), self.yaw_rad))


def heading_along(
    trajectory: Trajectory,
    yaw_rad: float,
    max_yaw_rate_radps: float,
    from_s: float | None = None,
    arrives_rad: float | None = None,
) -> Heading:
    """The heading that was planned with a curve, or looks where the vehicle goes; no faster than it can turn.

    Args:
        trajectory: The curve.
        yaw_rad: Heading at the beginning.
        max_yaw_rate_radps: Greatest rate of turn.
        from_s: Curve time of the beginning; None: the curve's start.
        arrives_rad: Where to look at the end, for which it turns as late as it can, and on beyond the end of a curve
            that is shorter than the turn; None: as on the way.

    Returns:
        The heading over the curve.
    """
    first_s = trajectory.start_s if from_s is None else from_s
    turn_s = 0.0 if arrives_rad is None else math.pi / max_yaw_rate_radps
    count = max(2, math.ceil((trajectory.end_s + turn_s - first_s) / _HEADING_INTERVAL_S) + 1)
    time_s = first_s + np.arange(count) * _HEADING_INTERVAL_S
    velocity = trajectory.sample(time_s).velocity_mps
    planned = trajectory.headings_at(time_s)
    if arrives_rad is not None:
        planned = np.where(time_s < trajectory.end_s - turn_s, np.nan if planned is None else planned, arrives_rad)
    yaw = headings(time_s, velocity, max_yaw_rate_radps, start_yaw_rad=yaw_rad, planned_rad=planned)
    return Heading(first_s, yaw)


@dataclasses.dataclass(frozen=True)
class Leg:
    """One proven curve, or a place to stand at, and the heading along it: all that is ever streamed.

    Raises:
        TypeError: A curve that moves without having passed the gate.
    """

    trajectory: Trajectory
    heading: Heading

    def __post_init__(self) -> None:
        moves = np.ptp(self.trajectory.control_points_m, axis=0).any()
        if moves and not isinstance(self.trajectory, ProvenTrajectory):
            raise TypeError("only what passed the gate is flown: give what planner.gate.prove returns")


@dataclasses.dataclass(frozen=True)
class CoursePoint:
    """Where the course is at one moment.

    Attributes:
        curve_s: Time along the curve.
        rate: How fast that time runs.
        motion: Position, velocity and acceleration in vehicle time.
        yaw_rad: Heading.
    """

    curve_s: float
    rate: float
    motion: Motion
    yaw_rad: float

    def setpoint(self, drag_per_s: float = 0.0) -> Setpoint:
        """What is streamed.

        Args:
            drag_per_s: Deceleration per speed through the air, which the vehicle is to lean against; rotors have it in
                their plane, and carry the weight across it.
        """
        against_drag_mps2 = drag_per_s * np.array([1.0, 1.0, 0.0]) * self.motion.velocity_mps
        return Setpoint(
            vector(self.motion.position_m),
            vector(self.motion.velocity_mps),
            vector(self.motion.acceleration_mps2 + against_drag_mps2),
            self.yaw_rad,
        )


@dataclasses.dataclass(frozen=True)
class Course:
    """Proven curves on one axis of curve time, and the pace along them.

    Attributes:
        legs: In order; a leg holds from its trajectory's start until the next one's.
        pace: How curve time runs.
        max_acceleration_mps2: What braking may use.
        max_yaw_rate_radps: How fast the nose may turn.
    """

    legs: tuple[Leg, ...]
    pace: Pace
    max_acceleration_mps2: float
    max_yaw_rate_radps: float

    @classmethod
    def begin(
        cls,
        trajectory: ProvenTrajectory,
        now_s: float,
        yaw_rad: float,
        max_acceleration_mps2: float,
        max_yaw_rate_radps: float,
        from_s: float | None = None,
        rate: float = 1.0,
        arrives_rad: float | None = None,
    ) -> Course:
        """Start a curve now, from rest, with the nose where it is.

        Args:
            trajectory: The curve.
            now_s: Flight clock.
            yaw_rad: Heading now.
            max_acceleration_mps2: What braking may use.
            max_yaw_rate_radps: How fast the nose may turn.
            from_s: Curve time to begin at; None: the curve's start.
            rate: Curve seconds a second, at most one.
            arrives_rad: Where the nose is to point at the end; None: as on the way.
        """
        first_s = trajectory.start_s if from_s is None else from_s
        leg = Leg(trajectory, heading_along(trajectory, yaw_rad, max_yaw_rate_radps, first_s, arrives_rad))
        course = cls((leg,), Pace(now_s, first_s, 0.0, 0.0), max_acceleration_mps2, max_yaw_rate_radps)
        if np.linalg.norm(trajectory.motion_at(first_s).velocity_mps) < 1e-3:
            # At rest already: the curve's own start is smooth.
            return dataclasses.replace(course, pace=Pace(now_s, first_s, rate, rate))
        return course.resuming(now_s, rate)

    @classmethod
    def standing(cls, position_m: Vector, now_s: float, yaw_rad: float) -> Course:
        """Stand at a place."""
        trajectory = Trajectory(np.tile(np.asarray(position_m, dtype=float), (4, 1)), 1.0, 0.0)
        return cls((Leg(trajectory, Heading(0.0, np.array([yaw_rad]))),), Pace(now_s, 0.0, 0.0, 0.0), 1.0, 1.0)

    @property
    def end_s(self) -> float:
        """Curve time of the last point."""
        return self.legs[-1].trajectory.end_s

    @property
    def trajectory(self) -> Trajectory:
        """The curve flown last."""
        return self.legs[-1].trajectory

    @property
    def curves(self) -> tuple[Trajectory, ...]:
        """The proven curves, in order."""
        return tuple(leg.trajectory for leg in self.legs)

    def leg_at(self, curve_s: float) -> Leg:
        """The leg that holds at a curve time."""
        for leg in reversed(self.legs):
            if curve_s >= leg.trajectory.start_s:
                return leg
        return self.legs[0]

    def motion_at(self, curve_s: float) -> Motion:
        """The motion at full pace at a curve time: what a replan continues from."""
        return self.leg_at(curve_s).trajectory.motion_at(curve_s)

    def turning_at(self, curve_s: float) -> Turning:
        """The heading at full pace at a curve time: what a replan continues from."""
        heading = self.leg_at(curve_s).heading
        turned = heading.at(curve_s + _HEADING_INTERVAL_S) - heading.at(curve_s - _HEADING_INTERVAL_S)
        fastest = _KEPT_RATE_SHARE * self.max_yaw_rate_radps
        return Turning(heading.at(curve_s), float(np.clip(turned / (2.0 * _HEADING_INTERVAL_S), -fastest, fastest)))

    def headings_at(self, curve_s: Float[np.ndarray, "time"]) -> Float[np.ndarray, "time"]:
        """Headings at many curve times."""
        return np.array([self.leg_at(moment).heading.at(moment) for moment in curve_s.tolist()])

    def positions_at(self, curve_s: Float[np.ndarray, "time"]) -> Float[np.ndarray, "time 3"]:
        """Positions at many curve times."""
        position = np.empty((len(curve_s), 3))
        starts = [leg.trajectory.start_s for leg in self.legs]
        owner = np.maximum(np.searchsorted(starts, curve_s, side="right") - 1, 0)
        for index, leg in enumerate(self.legs):
            mine = owner == index
            if mine.any():
                position[mine] = leg.trajectory.sample(curve_s[mine]).position_m
        return position

    def at(self, now_s: float) -> CoursePoint:
        """Where the course is at a moment of the flight clock; after its end it stands there, and may still turn."""
        pace_s, rate, rate_per_s = self.pace.at(now_s)
        curve_s = min(pace_s, self.end_s)
        leg = self.leg_at(curve_s)
        full = leg.trajectory.motion_at(curve_s)
        velocity = full.velocity_mps
        if self.stands(now_s):
            # Exactly: what rounding leaves of a velocity would be asked for again and again.
            motion = Motion.at_rest(full.position_m)
        else:
            acceleration = rate**2 * full.acceleration_mps2 + rate_per_s * velocity
            motion = Motion(full.position_m, rate * velocity, acceleration)
        return CoursePoint(curve_s, rate, motion, leg.heading.at(pace_s))

    def finished(self, now_s: float) -> bool:
        """Whether the last curve has come to its end."""
        return self.pace.at(now_s)[0] >= self.end_s

    def over_s(self, now_s: float) -> float:
        """How long ago the last curve and the turn after it came to their end, at the present pace; zero: not yet."""
        pace_s, rate, _ = self.pace.at(now_s)
        return max(0.0, pace_s - self.legs[-1].heading.end_s) / rate if rate > 0.0 else 0.0

    def stands(self, now_s: float) -> bool:
        """Whether the course has come to a standstill, at the end or on the way."""
        curve_s, rate, _ = self.pace.at(now_s)
        return rate == 0.0 or curve_s >= self.end_s

    def braking(self, now_s: float) -> Course:
        """The course that comes to a standstill along the curve."""
        return self._paced(now_s, 0.0)

    def resuming(self, now_s: float, rate: float = 1.0) -> Course:
        """The course that takes up its full pace again, or a part of it."""
        return self._paced(now_s, rate)

    def taken_up(self, curve_s: float, velocity_mps: Float[np.ndarray, "3"], now_s: float) -> Course:
        """The course from a moment of the curve on, at the pace that a vehicle has which is there.

        Args:
            curve_s: Time along the curve.
            velocity_mps: Of the vehicle.
            now_s: Flight clock.
        """
        along = self.motion_at(curve_s).velocity_mps
        rate = float(np.clip(along @ velocity_mps / max(float(along @ along), 1e-6), 0.0, 1.0))
        return dataclasses.replace(self, pace=Pace(now_s, curve_s, rate, rate))

    def nearest(self, position_m: Float[np.ndarray, "3"], first_s: float, last_s: float) -> tuple[float, float]:
        """Where a stretch of the course comes nearest to a place.

        Args:
            position_m: The place.
            first_s: Curve time at which the stretch begins; before the course it is the course's beginning.
            last_s: Curve time at which it ends.

        Returns:
            Curve time to a tenth of a second, and the distance there in metres.
        """
        first_s = max(first_s, self.legs[0].trajectory.start_s)
        count = max(2, math.ceil((last_s - first_s) / _NEAREST_STEP_S) + 1)
        moments = np.linspace(first_s, max(first_s, last_s), count)
        apart = np.linalg.norm(self.positions_at(moments) - position_m, axis=1)
        index = int(apart.argmin())
        return float(moments[index]), float(apart[index])

    def _paced(self, now_s: float, target_rate: float) -> Course:
        curve_s, rate, _ = self.pace.at(now_s)
        speed = float(np.linalg.norm(self.motion_at(curve_s).velocity_mps))
        change = abs(target_rate - rate)
        ramp = max(_SHORTEST_RAMP_S, change * speed / (_BRAKING_SHARE * self.max_acceleration_mps2)) if change else 0.0
        return dataclasses.replace(self, pace=Pace(now_s, curve_s, rate, target_rate, ramp))

    def stop_s(self) -> float:
        """Curve time of the standstill: where braking ends, or the end of the last curve."""
        pace = self.pace
        if pace.target_rate > 0.0:
            return self.end_s
        return min(pace.at(pace.time_s + pace.ramp_s)[0], self.end_s)

    def stop_position(self) -> Vector:
        """Where the course comes to a standstill."""
        return vector(self.motion_at(self.stop_s()).position_m)

    def stop_yaw_rad(self) -> float:
        """Where the nose points at the standstill, once it has turned."""
        stop_s = self.stop_s()
        heading = self.leg_at(stop_s).heading
        return heading.at(heading.end_s if stop_s >= self.end_s else stop_s)

    def continued(self, trajectory: ProvenTrajectory, now_s: float) -> Course:
        """The course that leaves its last curve for another at that one's start.

        Args:
            trajectory: The other curve.
            now_s: Flight clock.

        Raises:
            ValueError: The curves do not meet there in position, velocity and acceleration.
        """
        switch_s = trajectory.start_s
        old, new = self.motion_at(switch_s), trajectory.motion_at(switch_s)
        gaps = (
            np.abs(old.position_m - new.position_m).max(),
            np.abs(old.velocity_mps - new.velocity_mps).max(),
            np.abs(old.acceleration_mps2 - new.acceleration_mps2).max(),
        )
        if max(gaps) > 1e-3:
            raise ValueError(
                f"the new curve does not continue the old one at {switch_s:.2f} s: gaps of {gaps[0]:.4f} m, "
                f"{gaps[1]:.4f} m/s, {gaps[2]:.4f} m/s²; it needs the motion the old curve has there"
            )
        here_s = self.pace.at(now_s)[0]
        before = [leg for leg in self.legs if leg.trajectory.start_s < switch_s]
        # Legs that are over go; the one being flown stays, and so does what is still to come before the switch.
        first = sum(leg.trajectory.start_s <= here_s for leg in before)
        yaw = self.leg_at(switch_s).heading.at(switch_s)
        leg = Leg(trajectory, heading_along(trajectory, yaw, self.max_yaw_rate_radps))
        return dataclasses.replace(self, legs=(*before[max(first - 1, 0) :], leg))


def vector(point: Float[np.ndarray, "3"]) -> Vector:
    """Three floats of an array."""
    return float(point[0]), float(point[1]), float(point[2])
