"""Uniform cubic B-splines: the curve that is optimised, proven and streamed is one and the same.

| symbol | identifier           | unit | shape               |
|--------|----------------------|------|---------------------|
| P_j    | `control_points_m`   | m    | control 3           |
| h      | `knot_interval_s`    | s    |                     |
| x(t)   | `Samples.position_m` | m    | time 3              |
| ψ(t)   | `headings_at()`      | rad  | time                |

With segments j = 0 … n−4 and u = (t − t0)/h − j in [0, 1], the curve is the cubic blend of P_j … P_{j+3}. It is twice
continuously differentiable; velocity lies in the hull of (P_{j+1} − P_j)/h, and acceleration is linear between the
knots, where it equals (P_j − 2P_{j+1} + P_{j+2})/h². So limits on differences of control points are limits on the
curve, and a curve can be joined to any position, velocity and acceleration (`control_points_at_start`). A heading that
is planned with the path is a spline of the same kind, over the same knots.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from jaxtyping import Float

# Rows: powers of u; columns: the four control points of a segment.
BLEND = (
    np.array(
        [
            [1.0, 4.0, 1.0, 0.0],
            [-3.0, 0.0, 3.0, 0.0],
            [3.0, -6.0, 3.0, 0.0],
            [-1.0, 3.0, -3.0, 1.0],
        ]
    )
    / 6.0
)


@dataclasses.dataclass(frozen=True)
class Motion:
    """Position, velocity and acceleration at one moment, local ENU.

    Attributes:
        position_m: Shape (3,), metres.
        velocity_mps: Shape (3,), metres per second.
        acceleration_mps2: Shape (3,), metres per second squared.
    """

    position_m: Float[np.ndarray, "3"]
    velocity_mps: Float[np.ndarray, "3"]
    acceleration_mps2: Float[np.ndarray, "3"]

    @classmethod
    def at_rest(cls, position_m: Float[np.ndarray, "3"]) -> Motion:
        """Standing still at a position."""
        return cls(np.asarray(position_m, dtype=float), np.zeros(3), np.zeros(3))


@dataclasses.dataclass(frozen=True)
class Turning:
    """Where the nose points at one moment, and how fast it turns.

    Attributes:
        yaw_rad: Counter-clockwise from east.
        yaw_rate_radps: Its rate.
    """

    yaw_rad: float
    yaw_rate_radps: float = 0.0


@dataclasses.dataclass(frozen=True)
class Samples:
    """A curve at moments in time, local ENU.

    Attributes:
        time_s: Shape (time,).
        position_m: Shape (time, 3).
        velocity_mps: Shape (time, 3).
        acceleration_mps2: Shape (time, 3).
    """

    time_s: Float[np.ndarray, "time"]
    position_m: Float[np.ndarray, "time 3"]
    velocity_mps: Float[np.ndarray, "time 3"]
    acceleration_mps2: Float[np.ndarray, "time 3"]


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """A uniform cubic B-spline in time, local ENU metres.

    Attributes:
        control_points_m: Shape (control, 3), at least four; not to be changed afterwards.
        knot_interval_s: Time between knots, positive.
        start_s: Time of the curve's first point.
        heading_control_rad: Control points of a heading that is planned with the path, counter-clockwise from east,
            without jumps of whole turns, shape (control,); None: the vehicle looks where it goes (`planner.yaw`).

    Raises:
        ValueError: Fewer than four control points, a number that is not finite, a non-positive interval, or a heading
            of another size.
    """

    control_points_m: Float[np.ndarray, "control 3"]
    knot_interval_s: float
    start_s: float = 0.0
    heading_control_rad: Float[np.ndarray, "control"] | None = None

    def __post_init__(self) -> None:
        points = np.asarray(self.control_points_m, dtype=float)
        if points.ndim != 2 or points.shape[0] < 4 or points.shape[1] != 3:
            raise ValueError(f"a cubic spline needs control points of shape (4 or more, 3), got {points.shape}")
        if not np.isfinite(points).all():
            raise ValueError("control points must be finite: the solve diverged, do not fly this")
        if not (np.isfinite(self.knot_interval_s) and self.knot_interval_s > 0.0):
            raise ValueError(f"knot_interval_s must be positive, got {self.knot_interval_s}")
        object.__setattr__(self, "control_points_m", points)
        if self.heading_control_rad is not None:
            heading = np.asarray(self.heading_control_rad, dtype=float)
            if heading.shape != (points.shape[0],):
                raise ValueError(f"a heading needs a control point for each of the path's, got {heading.shape}")
            if not np.isfinite(heading).all():
                raise ValueError("a heading's control points must be finite: the solve diverged, do not fly this")
            object.__setattr__(self, "heading_control_rad", heading)

    @property
    def segments(self) -> int:
        """How many cubic pieces the curve has."""
        return self.control_points_m.shape[0] - 3

    @property
    def duration_s(self) -> float:
        """Time from the first to the last point."""
        return self.segments * self.knot_interval_s

    @property
    def end_s(self) -> float:
        """Time of the curve's last point."""
        return self.start_s + self.duration_s

    def sample(self, time_s: Float[np.ndarray, "time"]) -> Samples:
        """Position, velocity and acceleration at given times.

        Args:
            time_s: Shape (time,). Before the start and after the end the curve stands still at its end points.

        Returns:
            The samples, at the times asked for.
        """
        time = np.atleast_1d(np.asarray(time_s, dtype=float))
        segment, u = self._places(time)
        position_m, velocity_mps, acceleration_mps2 = self._blended(segment, u[:, None])
        inside = ((time >= self.start_s) & (time <= self.end_s))[:, None]
        return Samples(
            time_s=time,
            position_m=position_m,
            velocity_mps=np.where(inside, velocity_mps, 0.0),
            acceleration_mps2=np.where(inside, acceleration_mps2, 0.0),
        )

    def headings_at(self, time_s: Float[np.ndarray, "time"]) -> Float[np.ndarray, "time"] | None:
        """The heading that is planned with the path, radians; before the start and after the end it stays.

        Args:
            time_s: Shape (time,).

        Returns:
            Counter-clockwise from east, without jumps of whole turns; None: the vehicle looks where it goes.
        """
        if self.heading_control_rad is None:
            return None
        segment, u = self._places(np.atleast_1d(np.asarray(time_s, dtype=float)))
        c0, c1, c2, c3 = BLEND @ self.heading_control_rad[segment[:, None] + np.arange(4)].T
        return c0 + u * (c1 + u * (c2 + u * c3))

    def from_knot(self, knot: int) -> Trajectory:
        """The rest of the curve from a knot on, which is not its last."""
        heading = self.heading_control_rad
        return Trajectory(
            self.control_points_m[knot:],
            self.knot_interval_s,
            self.start_s + knot * self.knot_interval_s,
            None if heading is None else heading[knot:],
        )

    def _places(self, time_s: Float[np.ndarray, "*time"] | np.float64) -> tuple[np.ndarray, np.ndarray]:
        """The segment that each moment lies on, and the place there, 0 … 1."""
        parameter = np.clip((time_s - self.start_s) / self.knot_interval_s, 0.0, self.segments)
        segment = np.minimum(parameter.astype(int), self.segments - 1)
        return segment, parameter - segment

    @functools.cached_property
    def _coefficients(self) -> Float[np.ndarray, "4 segment 3"]:
        """Of the powers of the place on each segment: asked for tens of times a second in flight."""
        windows = self.control_points_m[np.arange(self.segments)[:, None] + np.arange(4)]
        coefficients = np.einsum("pc,scd->psd", BLEND, windows)
        coefficients.setflags(write=False)
        return coefficients

    def _blended(self, segment: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and acceleration on segments, at places there."""
        c0, c1, c2, c3 = self._coefficients[:, segment]
        return (
            c0 + u * (c1 + u * (c2 + u * c3)),
            (c1 + u * (2.0 * c2 + 3.0 * u * c3)) / self.knot_interval_s,
            (2.0 * c2 + 6.0 * u * c3) / self.knot_interval_s**2,
        )

    def motion_at(self, time_s: float) -> Motion:
        """The state of motion at one moment, from which another curve can be continued."""
        motion = Motion(*self._blended(*self._places(np.float64(time_s))))
        return motion if self.start_s <= time_s <= self.end_s else Motion.at_rest(motion.position_m)

    def sampled_every(self, interval_s: float) -> Samples:
        """The curve at a fixed rate from its first to exactly its last point."""
        count = max(2, int(np.ceil(self.duration_s / interval_s - 1e-9)) + 1)
        time = self.start_s + np.minimum(np.arange(count) * interval_s, self.duration_s)
        return self.sample(time)

    def slowed(self, factor: float) -> Trajectory:
        """The same path flown `factor` times slower: speed falls by it, acceleration by its square."""
        interval_s = self.knot_interval_s * factor
        return Trajectory(self.control_points_m, interval_s, self.start_s, self.heading_control_rad)


def control_points_at_start(motion: Motion, knot_interval_s: float) -> Float[np.ndarray, "3 3"]:
    """The first three control points of a curve that begins with a given motion.

    Reversed (and with the velocity negated) they are the last three of a curve that ends with it.

    Args:
        motion: Position, velocity and acceleration at the first knot.
        knot_interval_s: Time between knots.

    Returns:
        Shape (3, 3): P_0, P_1, P_2, metres.
    """
    middle = motion.position_m - motion.acceleration_mps2 * knot_interval_s**2 / 6.0
    mean = 3.0 * motion.position_m - 2.0 * middle
    step = knot_interval_s * motion.velocity_mps
    return np.stack([mean - step, middle, mean + step])


def heading_control_at_start(turning: Turning, knot_interval_s: float) -> Float[np.ndarray, "3"]:
    """The first three control points of a heading that begins as the vehicle turns, its rate at first constant."""
    return turning.yaw_rad + knot_interval_s * turning.yaw_rate_radps * np.array([-1.0, 0.0, 1.0])
