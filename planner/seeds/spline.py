"""From positions in time to the control points of a spline that begins as the vehicle moves and ends at rest."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from planner.polyline import at_places
from planner.problem import Problem
from planner.trajectory import control_points_at_start


def heading_spline(heading_rad: Float[np.ndarray, "moment"], segments: int) -> Float[np.ndarray, "control"]:
    """Control points of the spline that follows a heading over the problem's duration.

    Args:
        heading_rad: At equal times, from the start to the end, without jumps of whole turns.
        segments: Pieces of the spline.

    Returns:
        Shape (segments + 3,): the first three go on as it begins, the last three coincide.
    """
    moments = np.linspace(0.0, len(heading_rad) - 1.0, segments + 1)
    at_knots = np.interp(moments, np.arange(len(heading_rad)), heading_rad)
    first = at_knots[2] + (at_knots[3] - at_knots[2]) * np.arange(-3.0, 0.0)
    return np.concatenate([first, at_knots[2:-2], np.repeat(at_knots[-2], 3)])


def spline_from_path(
    points_m: Float[np.ndarray, "moment 3"], problem: Problem, segments: int
) -> Float[np.ndarray, "control 3"]:
    """Control points of the spline that follows a path over the problem's duration, inside the box.

    Args:
        points_m: Positions at equal times, from the start to the end.
        problem: Start, end and time.
        segments: Pieces of the spline, four or more.

    Returns:
        Shape (segments + 3, 3): the first three are given by the start's motion, the last three coincide.

    Raises:
        ValueError: Too few segments to hold both ends.
    """
    if segments < 4:
        raise ValueError(f"a path from motion to rest needs four segments or more, got {segments}")
    at_knots = at_places(points_m, np.linspace(0.0, len(points_m) - 1.0, segments + 1))
    control = at_knots.copy()
    # The quasi-interpolant that reproduces cubics: a spline goes through a shorter way inside of its control points.
    control[1:-1] -= (at_knots[2:] - 2.0 * at_knots[1:-1] + at_knots[:-2]) / 6.0
    box = problem.workspace
    inside = np.clip(control[2:-2], box.box_min_m, box.box_max_m)
    first = control_points_at_start(problem.start, problem.duration_s / segments)
    end = (
        np.clip(points_m[-1], box.box_min_m, box.box_max_m)
        if problem.end_position_m is None
        else problem.end_position_m
    )
    return np.concatenate([first, inside, np.tile(end, (3, 1))])
