"""Curves through given points, for tests that need a certain path."""

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from planner.trajectory import Motion, Trajectory


def interpolating(
    points_m: Float[np.ndarray, "knot 3"], knot_interval_s: float, start: Motion, start_s: float = 0.0
) -> Trajectory:
    """The spline through points at its knots that starts with a given motion and ends at rest.

    Args:
        points_m: Shape (knot, 3), two or more; the first is replaced by the start's position.
        knot_interval_s: Time between the points.
        start: Motion at the first point; its acceleration is kept only where the spline can keep it.
        start_s: Time of the first point.

    Returns:
        A trajectory of len(points) − 1 segments. The ends are clamped in velocity.
    """
    points = np.array(points_m, dtype=float)
    points[0] = start.position_m
    times = np.arange(len(points)) * knot_interval_s
    clamped: Any = ((1, start.velocity_mps), (1, np.zeros(3)))
    curvature = CubicSpline(times, points, bc_type=clamped)(times, 2)
    inner = points - curvature * knot_interval_s**2 / 6.0
    first = inner[1] - 2.0 * knot_interval_s * start.velocity_mps
    last = inner[-2]
    return Trajectory(np.vstack([first, inner, last]), knot_interval_s, start_s)
