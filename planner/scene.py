"""A problem as arrays for the optimiser: single precision, the unit cube, limits drawn in a little.

Candidates are optimised through their free control points. The first three are given by the start's motion and the last
three coincide (the curve ends at rest), so what is free is the inside and, where no end is asked for, the end.

Where headings are explored, a fourth column is the heading in turns, counted on beyond one: a turn weighs as much as
the length of the box, in steps, noise and kernels alike.

| symbol | identifier           | unit         | shape              |
|--------|----------------------|--------------|--------------------|
| P_j    | `control_points()`   | unit (, turn)| control axis       |
| x_t    | `positions()`        | unit (, turn)| time axis          |
| h      | `knot_interval_s`    | s            |                    |
| g_i    | `constraints()`      | 1            | constraint; ≤ 0 ok |
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.accelerator import unfused
from planner.kernel_metric import KernelMetric
from planner.kernel_metric_of import metric_of
from planner.obstacles import ObstacleField
from planner.polygon import KeepIn
from planner.problem import Metric, Options, Problem
from planner.single_precision import single
from planner.spectral_metric import SpectralMetric
from planner.trajectory import BLEND, Trajectory, Turning, control_points_at_start, heading_control_at_start

# The optimiser aims inside every limit, so that what multipliers leave over still passes the gate.
LIMIT_SHARE = 0.985
BOX_INSET_UNIT = 5e-4
# Knots closer than this share of the time it takes to turn add stiffness (acceleration is a second difference) and no
# freedom, and closer than this many to the finest half wave of the basis they add neither.
TURN_SHARE = 0.6
KNOTS_PER_HALF_WAVE = 3.0
# Of flying hard all the time, as a share of the metric.
TURNING_WEIGHT = 1e-3
CLIMBING_WEIGHT = 0.05
YAWING_WEIGHT = 1e-3
TURN_RAD = 2.0 * np.pi
# One number for the whole path has to weigh as much as what each of its pieces has to keep.
LENGTH_WEIGHT = 20.0
# Below this share of full speed turning too fast counts for less: at standstill it is nothing over nothing.
SLOW_TURN_SHARE = 0.1
# Beside the rate itself, which a path may keep by stopping and going back, the angle between directions this many knots
# apart is kept; and firmly from the first round, as a path that was let to turn on the spot does not find back.
TURN_KNOTS = (2, 4)
TURN_WEIGHT = 10.0
LEAD_IN = np.arange(-3.0, 0.0).astype(np.float32)
"""Where a heading is free at the start, the first three control points lead to it at the rate of its first step."""
_TURN_PLACES = np.arange(4) / 4.0
_RATES = np.stack([0.0 * _TURN_PLACES, 1.0 + 0.0 * _TURN_PLACES, 2.0 * _TURN_PLACES, 3.0 * _TURN_PLACES**2], axis=1)
_RATES = (_RATES @ BLEND).astype(np.float32)
"""Velocity at four places of a segment, from its control points; times the knot interval."""
_CURVATURES = np.stack([np.zeros(4), np.zeros(4), np.full(4, 2.0), 6.0 * _TURN_PLACES], axis=1)
_CURVATURES = (_CURVATURES @ BLEND).astype(np.float32)
"""Acceleration there, times the square of the interval."""
FEWEST_SEGMENTS = 16
MOST_SEGMENTS = 1024


class Scene(eqx.Module):
    """What a candidate is measured against.

    Attributes:
        metric: The ergodic metric.
        origin_m: Lower corner of the box, metres.
        lengths_m: Lengths of the box, metres.
        first: The first three control points, unit cube.
        end: Where to end, unit cube.
        end_is_fixed: 1 where the end is asked for, else 0; of each axis where headings are explored.
        first_heading_is_fixed: 1 where the heading at the start is given, else 0: it begins as it goes on.
        knot_interval_s: h.
        max_speed_mps: Drawn in.
        max_climb_mps: Drawn in.
        max_descent_mps: Drawn in.
        max_acceleration_mps2: Drawn in.
        max_jerk_mps3: Drawn in; infinite: no limit.
        max_turn_rate_radps: Drawn in; infinite: no limit.
        max_yaw_rate_turns_per_s: Drawn in; of a heading that is explored.
        max_length_m: Drawn in; infinite: no limit.
        obstacles: Signed distances.
        fence: Signed distance to the polygon that holds the flight.
        keep_out_m: Least distance from the vehicle's centre to an obstacle, with an allowance for what lies between two
            samples.
        slack_m: That allowance alone.
        samples_per_segment: Samples of the curve on each segment.
        turns_are_limited: Whether there is a turn rate to keep: without one nothing is spent on it.
        has_headings: Whether headings are explored.
    """

    metric: SpectralMetric | KernelMetric
    origin_m: Float[Array, "3"]
    lengths_m: Float[Array, "3"]
    first: Float[Array, "3 axis"]
    end: Float[Array, "axis"]
    end_is_fixed: Float[Array, "*axis"]
    first_heading_is_fixed: Float[Array, ""]
    knot_interval_s: Float[Array, ""]
    max_speed_mps: Float[Array, ""]
    max_climb_mps: Float[Array, ""]
    max_descent_mps: Float[Array, ""]
    max_acceleration_mps2: Float[Array, ""]
    max_jerk_mps3: Float[Array, ""]
    max_turn_rate_radps: Float[Array, ""]
    max_yaw_rate_turns_per_s: Float[Array, ""]
    max_length_m: Float[Array, ""]
    obstacles: ObstacleField
    fence: KeepIn
    keep_out_m: Float[Array, ""]
    slack_m: Float[Array, ""]
    samples_per_segment: int = eqx.field(static=True)
    turns_are_limited: bool = eqx.field(static=True)
    has_headings: bool = eqx.field(static=True)

    def control_points(self, free: Float[Array, "free axis"]) -> Float[Array, "control axis"]:
        """All control points of a candidate, unit cube."""
        end = jnp.where(self.end_is_fixed > 0.0, self.end, free[-1])
        first = self.first
        if self.has_headings:
            given = self.first_heading_is_fixed > 0.0
            led_in = free[0, 3] + (free[1, 3] - free[0, 3]) * LEAD_IN
            first = first.at[:, 3].set(jnp.where(given, first[:, 3], led_in))
        return jnp.concatenate([first, free[:-1], jnp.broadcast_to(end, (3, *end.shape))])

    def positions(self, control: Float[Array, "control axis"]) -> Float[Array, "time axis"]:
        """The curve at the middle of equal pieces of each segment, unit cube."""
        return sample_uniform(control, self.samples_per_segment)

    def constraints(
        self, control: Float[Array, "control axis"], positions: Float[Array, "time axis"]
    ) -> Float[Array, "constraint"]:
        """Every hard condition as a dimensionless number that must not be positive.

        Box, speed, climb, descent, acceleration, jerk, length and the heading's rate are conditions on control points,
        which imply them on the curve (`planner.trajectory`); clearance, the fence and the turn rate are taken at
        samples.
        """
        turns = [self._turns(control[:, :3] * self.lengths_m)] if self.turns_are_limited else []
        if self.has_headings:
            rate = jnp.diff(control[:, 3])[2:] / self.knot_interval_s
            turns.append((rate / self.max_yaw_rate_turns_per_s) ** 2 - 1.0)
            control, positions = control[:, :3], positions[:, :3]
        metres = control * self.lengths_m
        # The polygon of the control points is never shorter than the curve.
        length = jnp.sum(jnp.sqrt(jnp.sum(jnp.diff(metres, axis=0) ** 2, axis=-1) + 1e-12))
        jerk = jnp.diff(metres, n=3, axis=0) / self.knot_interval_s**3
        velocity = jnp.diff(metres, axis=0)[2:] / self.knot_interval_s
        acceleration = jnp.diff(metres, n=2, axis=0)[1:] / self.knot_interval_s**2
        step_m = jnp.maximum(self.max_speed_mps * self.knot_interval_s, self.keep_out_m)
        inside = control[3:]
        box = jnp.maximum(BOX_INSET_UNIT - inside, inside - (1.0 - BOX_INSET_UNIT)) * (self.lengths_m / step_m)
        places = positions * self.lengths_m + self.origin_m
        clearance = (self.keep_out_m - self.obstacles.distance(places)) / step_m
        fence = (self.slack_m - self.fence.distance(places[:, :2])) / step_m
        up = velocity[:, 2]
        return jnp.concatenate(
            [
                *turns,
                jnp.sum((velocity / self.max_speed_mps) ** 2, axis=-1) - 1.0,
                jnp.where(up > 0.0, up / self.max_climb_mps, -up / self.max_descent_mps) - 1.0,
                jnp.sum((acceleration / self.max_acceleration_mps2) ** 2, axis=-1) - 1.0,
                jnp.sum((jerk / self.max_jerk_mps3) ** 2, axis=-1) - 1.0,
                LENGTH_WEIGHT * (length[None] / self.max_length_m - 1.0),
                box.reshape(-1),
                clearance,
                fence,
            ]
        )

    def _turns(self, metres: Float[Array, "control 3"]) -> Float[Array, "place"]:
        """By how much the horizontal velocity turns too fast; nothing where the vehicle stands: it has no direction."""
        limit = self.max_turn_rate_radps
        segments = metres.shape[0] - 3
        window = jnp.stack([metres[part : part + segments, :2] for part in range(4)], axis=1)
        velocity = jnp.einsum("uc,sca->sua", _RATES, window) / self.knot_interval_s
        force = jnp.einsum("uc,sca->sua", _CURVATURES, window) / self.knot_interval_s**2
        across = velocity[..., 0] * force[..., 1] - velocity[..., 1] * force[..., 0]
        squared = jnp.sum(velocity**2, axis=-1)
        slow = (SLOW_TURN_SHARE * self.max_speed_mps) ** 2
        too_fast = [((jnp.abs(across) - limit * squared) / (limit * (squared + slow))).reshape(-1)]
        leg = jnp.diff(metres[:, :2], axis=0) / self.knot_interval_s
        for apart in TURN_KNOTS:
            before, after = leg[:-apart], leg[apart:]
            angle = jnp.minimum(apart * self.knot_interval_s * limit, jnp.pi)
            size = jnp.sqrt(jnp.sum(before**2, axis=-1) * jnp.sum(after**2, axis=-1) + slow**2)
            too_fast.append((jnp.cos(angle) * (size - slow) - jnp.sum(before * after, axis=-1)) / size)
        return TURN_WEIGHT * jnp.concatenate(too_fast)

    def ergodic_metric(self, positions: Float[Array, "time axis"]) -> Float[Array, ""]:
        """E of a candidate (with what was covered before)."""
        count = positions.shape[0]
        if self.has_headings:
            positions = positions * np.array([1.0, 1.0, 1.0, TURN_RAD], np.float32)
        return self.metric(positions, jnp.full(count, 1.0 / count, positions.dtype))

    def effort(self, control: Float[Array, "control axis"]) -> Float[Array, ""]:
        """What flying costs beside covering: time averages of squared acceleration and vertical speed by their limits.

        Means and not SVES's sum: with the sum the best path is a straight line. Climbing weighs more than turning, or a
        path whose altitude is free would wander up and down. A heading that is explored costs its squared rate.
        """
        metres = control[:, :3] * self.lengths_m
        acceleration = jnp.diff(metres, n=2, axis=0) / (self.knot_interval_s**2 * self.max_acceleration_mps2)
        up = jnp.diff(metres[:, 2]) / self.knot_interval_s
        climbing = jnp.where(up > 0.0, up / self.max_climb_mps, up / self.max_descent_mps)
        turning = jnp.mean(jnp.sum(acceleration**2, axis=-1))
        effort = TURNING_WEIGHT * turning + CLIMBING_WEIGHT * jnp.mean(climbing**2)
        if self.has_headings:
            yawing = jnp.diff(control[:, 3]) / (self.knot_interval_s * self.max_yaw_rate_turns_per_s)
            effort = effort + YAWING_WEIGHT * jnp.mean(yawing**2)
        return effort


def sample_uniform(control: Float[Array, "control axis"], samples_per_segment: int) -> Float[Array, "time axis"]:
    """Points of a spline at the middles of equal pieces of every segment.

    Each is a blend of four control points, the same all along the curve, so all are sums of shifted arrays. Barriers
    keep the shifting and the sorting by time out of these sums, which are not vectorised else.
    """
    u = (np.arange(samples_per_segment) + 0.5) / samples_per_segment
    blends = (np.stack([np.ones_like(u), u, u**2, u**3], axis=1) @ BLEND).astype(control.dtype)
    segments = control.shape[0] - 3
    by_axis = control.T
    shifted = unfused(tuple(by_axis[:, first : first + segments] for first in range(4)))
    places = [sum(part * share for part, share in zip(shifted, blend, strict=True)) for blend in blends]
    by_place = unfused(jnp.stack(places))
    return jnp.transpose(by_place, (2, 0, 1)).reshape(-1, control.shape[1])


def knots_for(problem: Problem, options: Options) -> tuple[int, int]:
    """How many segments and samples a segment a problem wants.

    Segments come in steps of a geometric series, so that missions of similar size share one compilation.

    Returns:
        Segments, samples per segment.
    """
    limits = problem.limits
    if options.time_step_s is not None:
        samples = max(FEWEST_SEGMENTS, round(problem.duration_s / options.time_step_s))
        per_segment = 2 if samples >= 2 * FEWEST_SEGMENTS else 1
        segments = int(np.clip(-(-samples // per_segment), FEWEST_SEGMENTS, MOST_SEGMENTS))
        return segments, per_segment
    wanted = np.clip(problem.duration_s / wanted_interval_s(problem, options), FEWEST_SEGMENTS, MOST_SEGMENTS)
    steps = np.array([16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024])
    segments = int(steps[np.searchsorted(steps, wanted - 1e-9)])
    step_m = limits.max_speed_mps * problem.duration_s / segments
    keep_out_m = max(problem.keep_out_m, 1e-3)
    per_segment = int(np.clip(np.ceil(step_m / (3.0 * keep_out_m)), 2, 4))
    return segments, per_segment


def wanted_interval_s(problem: Problem, options: Options) -> float:
    """Time between knots that vehicle and modes want, however long the path is: what a turn and a half wave take."""
    limits = problem.limits
    half_wave_m = min(
        length / (count - 1)
        for length, count in zip(problem.workspace.lengths_m, options.modes, strict=True)
        if count > 1
    )
    return max(
        TURN_SHARE * limits.max_speed_mps / limits.turning_acceleration_mps2,
        half_wave_m / limits.max_speed_mps / KNOTS_PER_HALF_WAVE,
    )


def scene_of(problem: Problem, options: Options, segments: int, samples_per_segment: int) -> Scene:
    """The arrays of a problem, for paths of a given number of segments."""
    match options.metric:
        case Metric.SPECTRAL:
            metric = SpectralMetric.of(
                problem.information.coefficients(options.modes),
                options.metric_weights,
                problem.covered,
                problem.duration_s,
            )
        case Metric.KERNEL:
            metric = metric_of(problem, options, segments * samples_per_segment)
    workspace, limits = problem.workspace, problem.limits
    interval_s = problem.duration_s / segments
    spacing_m = limits.max_speed_mps * interval_s / samples_per_segment
    slack_m = min(spacing_m**2 / (8.0 * max(problem.keep_out_m, 1e-3)), 0.5 * spacing_m) + 0.01 * problem.keep_out_m
    end = problem.start.position_m if problem.end_position_m is None else problem.end_position_m
    fence = KeepIn.everywhere() if problem.fence_polygon_m is None else KeepIn.of(problem.fence_polygon_m)

    def on_the_device(value: float | np.ndarray) -> Array:
        # Whole numbers stay whole: they say which.
        if np.issubdtype(np.asarray(value).dtype, np.integer):
            return jnp.asarray(np.asarray(value, np.int32))
        return single(value)

    first = workspace.unit_from_enu(control_points_at_start(problem.start, interval_s))
    end, end_is_fixed = workspace.unit_from_enu(end), np.asarray(problem.end_position_m is not None)
    if options.explores_headings:
        heading = heading_control_at_start(problem.start_turning or Turning(0.0), interval_s)
        first, end = np.column_stack([first, heading / TURN_RAD]), np.append(end, 0.0)
        end_is_fixed = np.append(np.repeat(end_is_fixed, 3), False)

    return Scene(
        metric=metric,
        origin_m=single(workspace.box_min_m),
        lengths_m=single(workspace.lengths_m),
        first=single(first),
        end=single(end),
        end_is_fixed=single(end_is_fixed),
        first_heading_is_fixed=single(problem.start_turning is not None),
        knot_interval_s=single(interval_s),
        max_speed_mps=single(LIMIT_SHARE * limits.max_speed_mps),
        max_climb_mps=single(LIMIT_SHARE * limits.max_climb_mps),
        max_descent_mps=single(LIMIT_SHARE * limits.max_descent_mps),
        max_acceleration_mps2=single(LIMIT_SHARE * limits.max_acceleration_mps2),
        max_jerk_mps3=single(LIMIT_SHARE * limits.max_jerk_mps3),
        max_turn_rate_radps=single(LIMIT_SHARE * limits.max_turn_rate_radps),
        max_yaw_rate_turns_per_s=single(LIMIT_SHARE * limits.max_yaw_rate_radps / TURN_RAD),
        max_length_m=single(LIMIT_SHARE * problem.max_length_m),
        obstacles=jax.tree.map(on_the_device, problem.obstacles.listed(workspace.box_min_m, workspace.box_max_m)),
        fence=jax.tree.map(on_the_device, fence),
        keep_out_m=single(problem.keep_out_m + slack_m),
        slack_m=single(slack_m),
        samples_per_segment=samples_per_segment,
        turns_are_limited=bool(np.isfinite(limits.max_turn_rate_radps)),
        has_headings=options.explores_headings,
    )


def free_from_control(
    control_unit: Float[np.ndarray, "*batch control axis"],
) -> Float[np.ndarray, "*batch free axis"]:
    """The free control points of full ones: the inverse of `Scene.control_points`."""
    return np.concatenate([control_unit[..., 3:-3, :], control_unit[..., -1:, :]], axis=-2)


def trajectory_of(problem: Problem, free: Float[np.ndarray, "free axis"], start_s: float = 0.0) -> Trajectory:
    """The curve of a candidate in metres and double precision, its given ends exact and its inside in the box."""
    workspace = problem.workspace
    interval_s = problem.duration_s / (free.shape[0] + 2)
    points = np.asarray(free, dtype=float)
    heading = _heading_control(problem, TURN_RAD * points[:, 3], interval_s) if points.shape[1] > 3 else None
    inside = workspace.enu_from_unit(np.clip(points[:, :3], 0.0, 1.0))
    end = inside[-1] if problem.end_position_m is None else problem.end_position_m
    first = control_points_at_start(problem.start, interval_s)
    return Trajectory(np.concatenate([first, inside[:-1], np.tile(end, (3, 1))]), interval_s, start_s, heading)


def _heading_control(problem: Problem, free_rad: Float[np.ndarray, "free"], interval_s: float) -> np.ndarray:
    """Control points of a heading; where it turned too fast by what multipliers left over, it turns on less far."""
    most = (1.0 - 1e-9) * problem.limits.max_yaw_rate_radps * interval_s
    if problem.start_turning is None:
        turned = free_rad[0] + np.cumsum(np.clip(np.diff(free_rad, prepend=free_rad[0]), -most, most))
        first = turned[0] + (turned[1] - turned[0]) * LEAD_IN
    else:
        first = heading_control_at_start(problem.start_turning, interval_s)
        turned = first[-1] + np.cumsum(np.clip(np.diff(free_rad, prepend=first[-1]), -most, most))
    return np.concatenate([first, turned[:-1], np.repeat(turned[-1], 3)])
