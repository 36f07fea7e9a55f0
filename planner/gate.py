"""The gate: what may be flown is proven here, in double precision, over every moment of the curve that is streamed.

Clearance and the fence are 1-Lipschitz distances and are proven by bisection; box, speed, climb and descent by the
exact extrema of polynomials, the turn rate by those of a ratio of polynomials; acceleration at the knots, between which
it is linear and its norm therefore convex; jerk on the pieces, where it is constant; the length by polygons around it.
A heading that is planned with the path is proven likewise by the exact extrema of its rate; any other is no part of the
curve: `planner.yaw` turns it no faster than `Limits.max_yaw_rate_radps` allows.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from planner.curve_bounds import (
    Extremum,
    bezier_points,
    derivative,
    greatest_ratio,
    heading_bezier_points,
    inner_product,
    least_along,
    length_bound,
    maximum,
    squared_norm,
)
from planner.gate_report import GateReport, Violation, ViolationKind
from planner.polygon import FAR_M, KeepIn
from planner.problem import Problem
from planner.trajectory import Trajectory

# The tolerances, all of them. Limits may be exceeded by rounding and no more; clearance is proven without any.
RELATIVE_TOLERANCE = 1e-9
JOIN_TOLERANCE = 1e-6
"""Start, end and box: metres, metres per second, metres per second squared."""
FENCE_TOLERANCE_M = 1e-3
FENCE_RESOLUTION_M = 0.1
FARTHEST_RAD = 1e8
"""A heading that turned further means nothing."""
REPORT_RESOLUTION_M = 1e-3
"""How closely the least clearance is enclosed: the figure reported is the proven, lower one."""

LENGTH_RESOLUTION = 1e-5
"""By what share the length reported, which is proven too, may be too great."""


_UNITS = {
    ViolationKind.ACCELERATION: "m/s²",
    ViolationKind.JERK: "m/s³",
    ViolationKind.TURN_RATE: "deg/s",
    ViolationKind.YAW_RATE: "deg/s",
    ViolationKind.LENGTH: "m",
}


class GateRefused(ValueError):
    """A curve that may not be flown.

    Attributes:
        report: What was measured on it.
    """

    def __init__(self, report: GateReport) -> None:
        self.report = report
        super().__init__("this path must not be flown: " + "; ".join(v.text for v in report.violations))


@dataclasses.dataclass(frozen=True, init=False, eq=False)
class ProvenTrajectory(Trajectory):
    """A curve that passed the gate, with the report: only `prove` makes one, and it cannot be changed.

    Whatever is flown, streamed, or written as the path to fly takes this type; a curve that is made of one (its rest,
    the same more slowly) is a `Trajectory` again.

    Attributes:
        report: What was measured on it.
    """

    report: GateReport

    def __init__(self, *_: object, **__: object) -> None:
        raise TypeError("a proven trajectory comes from planner.gate.prove, which proves it: prove the new one")

    def __reduce__(self) -> tuple[Any, ...]:
        # Between processes too it is made here, and cannot be changed on the other side.
        return _proven, (_plain(self, self.start_s), self.report)

    def starting_at(self, start_s: float) -> ProvenTrajectory:
        """The same curve at another time: no condition depends on when it begins."""
        return _proven(_plain(self, start_s), self.report)


def prove(trajectory: Trajectory, problem: Problem) -> ProvenTrajectory:
    """Let a curve through the gate.

    Args:
        trajectory: The curve.
        problem: What it must keep to.

    Returns:
        The curve as something that may be flown; later changes of the caller's arrays do not reach it.

    Raises:
        GateRefused: It breaks a condition.
    """
    # What is measured is what is kept, whatever the caller does to its arrays meanwhile.
    own = _plain(trajectory, trajectory.start_s)
    report = inspect(own, problem)
    if not report.passed:
        raise GateRefused(report)
    return _proven(own, report)


def _plain(trajectory: Trajectory, start_s: float) -> Trajectory:
    """A curve of its own arrays, without a proof."""
    heading = trajectory.heading_control_rad
    return Trajectory(
        trajectory.control_points_m.copy(),
        trajectory.knot_interval_s,
        start_s,
        None if heading is None else heading.copy(),
    )


def _proven(own: Trajectory, report: GateReport) -> ProvenTrajectory:
    """Seal a curve that passed."""
    proven = object.__new__(ProvenTrajectory)
    for name, value in {**vars(own), "report": report}.items():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
        object.__setattr__(proven, name, value)
    return proven


def inspect(trajectory: Trajectory, problem: Problem) -> GateReport:
    """Measure a curve against every condition of a problem, over every moment of it.

    Args:
        trajectory: The curve.
        problem: What it must keep to.

    Returns:
        The report; `passed` says whether it may be flown.
    """
    workspace = problem.workspace
    control = trajectory.control_points_m
    turned = trajectory.heading_control_rad
    if not (np.abs(control - workspace.box_min_m) < FAR_M).all() or (
        turned is not None and not (np.abs(turned) < FARTHEST_RAD).all()
    ):
        return _diverged(trajectory, problem)
    found = _Findings(trajectory)
    bezier = bezier_points(trajectory)
    velocity = derivative(bezier, trajectory.knot_interval_s)

    clearance = _inspect_clearance(found, problem, bezier)
    _inspect_box(found, problem, bezier)
    if problem.fence_polygon_m is not None:
        inside = KeepIn.of(problem.fence_polygon_m).distance
        fence = least_along(bezier[:, :, :2], inside, -FENCE_TOLERANCE_M, FENCE_RESOLUTION_M)
        if fence.lower < -FENCE_TOLERANCE_M:
            found.add(ViolationKind.FENCE, -fence.lower, 0.0, fence.parameter, "{measured:.3f} m outside the fence")

    limits = problem.limits
    speed = maximum(squared_norm(velocity))
    greatest = {
        ViolationKind.SPEED: (float(np.sqrt(max(speed.value, 0.0))), limits.max_speed_mps, speed.parameter),
    }
    for kind, sign, limit in (
        (ViolationKind.CLIMB, 1.0, limits.max_climb_mps),
        (ViolationKind.DESCENT, -1.0, limits.max_descent_mps),
    ):
        vertical = maximum(sign * velocity[:, :, 2])
        greatest[kind] = (max(vertical.value, 0.0), limit, vertical.parameter)
    acceleration = np.linalg.norm(np.diff(control, n=2, axis=0), axis=1) / trajectory.knot_interval_s**2
    knot = int(np.argmax(acceleration))
    greatest[ViolationKind.ACCELERATION] = (float(acceleration[knot]), limits.max_acceleration_mps2, float(knot))
    jerk = np.linalg.norm(np.diff(control, n=3, axis=0), axis=1) / trajectory.knot_interval_s**3
    piece = int(np.argmax(jerk))
    greatest[ViolationKind.JERK] = (float(jerk[piece]), limits.max_jerk_mps3, piece + 0.5)
    if np.isfinite(limits.max_turn_rate_radps):
        turn = _turn_rate_radps(velocity, trajectory.knot_interval_s, limits.max_speed_mps)
        greatest[ViolationKind.TURN_RATE] = (turn.value, limits.max_turn_rate_radps, turn.parameter)
    heading = heading_bezier_points(trajectory)
    if heading is not None:
        rate = derivative(heading, trajectory.knot_interval_s)[:, :, 0]
        fastest = max((maximum(sign * rate) for sign in (1.0, -1.0)), key=lambda one: one.value)
        greatest[ViolationKind.YAW_RATE] = (fastest.value, limits.max_yaw_rate_radps, fastest.parameter)
    length_m = length_bound(bezier, LENGTH_RESOLUTION)
    greatest[ViolationKind.LENGTH] = (length_m, problem.max_length_m, float(trajectory.segments))
    for kind, (measured, limit, parameter) in greatest.items():
        if not measured <= limit * (1.0 + RELATIVE_TOLERANCE):
            unit = _UNITS.get(kind, "m/s")
            # As the mission file has them.
            shown, most = (math.degrees(x) if unit == "deg/s" else x for x in (measured, limit))
            found.add(kind, measured, limit, parameter, f"{kind.value} {shown:.4g} {unit}, limit {most:.4g}")

    _inspect_ends(found, problem)
    return GateReport(
        violations=tuple(found.violations),
        min_clearance_m=clearance,
        max_speed_mps=greatest[ViolationKind.SPEED][0],
        max_climb_mps=greatest[ViolationKind.CLIMB][0],
        max_descent_mps=greatest[ViolationKind.DESCENT][0],
        max_acceleration_mps2=greatest[ViolationKind.ACCELERATION][0],
        max_jerk_mps3=greatest[ViolationKind.JERK][0],
        max_turn_rate_radps=greatest[ViolationKind.TURN_RATE][0] if ViolationKind.TURN_RATE in greatest else None,
        length_m=length_m,
        duration_s=trajectory.duration_s,
        max_yaw_rate_radps=greatest[ViolationKind.YAW_RATE][0] if ViolationKind.YAW_RATE in greatest else None,
    )


class _Findings:
    """Collects violations with the time and place of their worst moment."""

    def __init__(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        self.violations: list[Violation] = []

    def add(self, kind: ViolationKind, measured: float, limit: float, parameter: float, what: str) -> None:
        time_s = self._trajectory.start_s + parameter * self._trajectory.knot_interval_s
        position = self._trajectory.motion_at(min(time_s, self._trajectory.end_s)).position_m
        east, north, up = position
        text = what.format(measured=measured, limit=limit) + f", at {time_s:.2f} s ({east:.2f}, {north:.2f}, {up:.2f})"
        self.violations.append(Violation(kind, measured, limit, time_s, position, text))


def _inspect_clearance(found: _Findings, problem: Problem, bezier: np.ndarray) -> float:
    """Proven least clearance of the hull."""
    if problem.obstacles.is_empty:
        return float("inf")
    least = least_along(bezier, problem.obstacles.lower_bound, problem.keep_out_m, REPORT_RESOLUTION_M)
    clearance = least.lower - problem.vehicle_radius_m
    if least.lower < problem.keep_out_m:
        found.add(
            ViolationKind.CLEARANCE,
            clearance,
            problem.clearance_margin_m,
            least.parameter,
            "clearance {measured:.3f} m, needs {limit:.3f} m",
        )
    # In the sum of radius and margin rounding may be lost; what is proven is the comparison above.
    return max(clearance, problem.clearance_margin_m) if least.lower >= problem.keep_out_m else clearance


def _inspect_box(found: _Findings, problem: Problem, bezier: np.ndarray) -> None:
    workspace = problem.workspace
    worst = None
    for axis, name in enumerate(("east", "north", "up")):
        for sign, bound in ((-1.0, workspace.box_min_m[axis]), (1.0, workspace.box_max_m[axis])):
            outside = maximum(sign * (bezier[:, :, axis] - bound))
            if outside.value > JOIN_TOLERANCE and (worst is None or outside.value > worst[0].value):
                worst = outside, name, bound
    if worst is not None:
        outside, name, bound = worst
        what = f"{{measured:.3f}} m outside the box, which ends at {name} {bound:.2f} m"
        found.add(ViolationKind.BOX, outside.value, 0.0, outside.parameter, what)


def _inspect_ends(found: _Findings, problem: Problem) -> None:
    trajectory = found._trajectory
    first, last = trajectory.motion_at(trajectory.start_s), trajectory.motion_at(trajectory.end_s)
    start = problem.start
    for what, unit, got, wanted in (
        ("position", "m", first.position_m, start.position_m),
        ("velocity", "m/s", first.velocity_mps, start.velocity_mps),
        ("acceleration", "m/s²", first.acceleration_mps2, start.acceleration_mps2),
    ):
        gap = float(np.abs(got - wanted).max())
        if not gap <= JOIN_TOLERANCE:
            text = f"starts {{measured:.3g}} {unit} off the {what} the vehicle has"
            found.add(ViolationKind.START, gap, JOIN_TOLERANCE, 0.0, text)
    heading = trajectory.headings_at(np.array([trajectory.start_s]))
    if heading is not None and problem.start_turning is not None:
        gap = abs(math.remainder(float(heading[0]) - problem.start_turning.yaw_rad, 2.0 * math.pi))
        if not gap <= JOIN_TOLERANCE:
            text = "starts {measured:.3g} rad off the heading the vehicle has"
            found.add(ViolationKind.START, gap, JOIN_TOLERANCE, 0.0, text)
    end = float(trajectory.segments)
    if problem.end_position_m is not None:
        gap = float(np.abs(last.position_m - problem.end_position_m).max())
        if not gap <= JOIN_TOLERANCE:
            found.add(ViolationKind.END, gap, JOIN_TOLERANCE, end, "ends {measured:.3g} m from where it should")
    speed = float(np.linalg.norm(last.velocity_mps))
    if not speed <= JOIN_TOLERANCE:
        found.add(ViolationKind.END, speed, JOIN_TOLERANCE, end, "ends at {measured:.3g} m/s and not at rest")
    if not trajectory.duration_s <= problem.duration_s * (1.0 + RELATIVE_TOLERANCE):
        text = "takes {measured:.2f} s, there are {limit:.2f} s"
        found.add(ViolationKind.DURATION, trajectory.duration_s, problem.duration_s, end, text)


def _turn_rate_radps(velocity: Float[np.ndarray, "piece 3 3"], interval_s: float, full_mps: float) -> Extremum:
    """The greatest |v × a|/‖v‖² of the horizontal motion: how fast its direction turns.

    Where the vehicle stands there is no direction: to ‖v‖² is added what rounding may take from it, a square of some
    30 millionths of full speed, below which turning is free.
    """
    horizontal, force = velocity[:, :, :2], derivative(velocity, interval_s)[:, :, :2]
    across = inner_product(horizontal, np.stack([force[:, :, 1], -force[:, :, 0]], axis=-1))
    # Written with the degree of ‖v‖².
    raised = inner_product(across[:, :, None], np.ones((len(across), 2, 1)))
    return greatest_ratio(raised, squared_norm(horizontal) + RELATIVE_TOLERANCE * full_mps**2)


def _diverged(trajectory: Trajectory, problem: Problem) -> GateReport:
    """The report of a curve whose numbers mean nothing."""
    farthest, limit = float(np.abs(trajectory.control_points_m - problem.workspace.box_min_m).max()), FAR_M
    text = f"reaches {farthest:.3g} m: the solve diverged"
    if farthest < FAR_M and trajectory.heading_control_rad is not None:
        farthest, limit = float(np.abs(trajectory.heading_control_rad).max()), FARTHEST_RAD
        text = f"turns to {farthest:.3g} rad: the solve diverged"
    violation = Violation(
        ViolationKind.DIVERGED, farthest, limit, trajectory.start_s, trajectory.control_points_m[0], text
    )
    infinite = float("inf")
    return GateReport(
        violations=(violation,),
        min_clearance_m=-infinite,
        max_speed_mps=infinite,
        max_climb_mps=infinite,
        max_descent_mps=infinite,
        max_acceleration_mps2=infinite,
        max_jerk_mps3=infinite,
        max_turn_rate_radps=None,
        length_m=infinite,
        duration_s=trajectory.duration_s,
    )
