"""A curve as few straight legs: what an autopilot without Offboard, or another ground station, can fly.

Ramer's and Douglas & Peucker's splitting (1972, 1973) with two reasons to split: the leg strays from the curve, or it
is not proven clear. A leg is proven by bisection: a signed distance changes by at most one metre a metre, so a piece of
length s whose middle clears by s/2 more than is needed is clear everywhere.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from mission.site.reachable import Spare
from planner.trajectory import Trajectory

SHORTEST_PROVEN_M = 0.01
SAMPLE_INTERVAL_S = 0.1


@dataclasses.dataclass(frozen=True)
class Waypoint:
    """The end of a straight leg.

    Attributes:
        time_s: When the curve passes here.
        position_enu_m: Where.
        speed_mps: Mean speed of the curve along the leg that ends here; at the first point, along the leg that begins.
    """

    time_s: float
    position_enu_m: tuple[float, float, float]
    speed_mps: float


def legs_clear(
    start_m: Float[np.ndarray, "leg 3"],
    end_m: Float[np.ndarray, "leg 3"],
    spare_m: Spare,
) -> np.ndarray:
    """Which straight legs are proven to keep their distance along their whole length.

    Args:
        start_m: First points.
        end_m: Last points.
        spare_m: What each point has to spare.

    Returns:
        Booleans, shape (leg,).
    """
    clear = np.ones(len(start_m), dtype=bool)
    leg = np.arange(len(start_m))
    a, b = np.asarray(start_m, dtype=float), np.asarray(end_m, dtype=float)
    while len(leg):
        middle = 0.5 * (a + b)
        half = 0.5 * np.linalg.norm(b - a, axis=1)
        spare = np.asarray(spare_m(middle))
        short = half <= SHORTEST_PROVEN_M
        clear[leg[spare < 0.0]] = False
        open_piece = (spare < half) & ~short & clear[leg]
        leg, a, b, middle = leg[open_piece], a[open_piece], b[open_piece], middle[open_piece]
        leg, a, b = np.concatenate([leg, leg]), np.concatenate([a, middle]), np.concatenate([middle, b])
    return clear


def _straying(points: Float[np.ndarray, "time 3"], first: int, last: int) -> tuple[float, int]:
    """How far the curve strays from the leg between two of its samples, and where most."""
    inside = points[first + 1 : last] - points[first]
    along = points[last] - points[first]
    length_squared = float(along @ along)
    share = np.clip(inside @ along / length_squared, 0.0, 1.0) if length_squared > 0.0 else np.zeros(len(inside))
    straying = np.linalg.norm(inside - share[:, None] * along, axis=1)
    worst = int(np.argmax(straying))
    return float(straying[worst]), first + 1 + worst


def waypoints_along(
    trajectory: Trajectory,
    spare_m: Spare,
    *,
    tolerance_m: float,
    most: int = 300,
) -> tuple[Waypoint, ...]:
    """Straight legs that follow a curve and keep clear of the obstacles.

    Args:
        trajectory: The curve; proven clear itself.
        spare_m: What each point has to spare; every leg keeps it positive. Legs between neighbouring samples are not
            split further: there the curve's own proof holds, up to the millimetres between it and its chord.
        tolerance_m: How far the curve may stray from a leg.
        most: Waypoints beyond which the tolerance is widened (ArduPilot holds 650 items, speeds included).

    Returns:
        At least two, the curve's first and last point among them.
    """
    samples = trajectory.sampled_every(SAMPLE_INTERVAL_S)
    points = samples.position_m
    while True:
        kept = _split(points, spare_m, tolerance_m)
        if len(kept) <= most or tolerance_m > np.ptp(points, axis=0).max():
            break
        tolerance_m *= 1.5
    chosen, time = points[kept], samples.time_s[kept]
    speed = np.linalg.norm(np.diff(chosen, axis=0), axis=1) / np.diff(time)
    return tuple(
        Waypoint(float(moment), (float(p[0]), float(p[1]), float(p[2])), float(pace))
        for moment, p, pace in zip(time, chosen, np.concatenate([speed[:1], speed]), strict=True)
    )


def _split(points: Float[np.ndarray, "time 3"], spare_m: Spare, tolerance_m: float) -> np.ndarray:
    """Indices of the samples that are kept, in order."""
    kept = {0, len(points) - 1}
    legs = [(0, len(points) - 1)]
    while legs:
        splittable = [(first, last) for first, last in legs if last - first > 1]
        if not splittable:
            break
        bounds = np.array(splittable)
        clear = legs_clear(points[bounds[:, 0]], points[bounds[:, 1]], spare_m)
        legs = []
        for (first, last), is_clear in zip(splittable, clear, strict=True):
            straying, worst = _straying(points, first, last)
            if straying > tolerance_m or not is_clear:
                # A straight piece of curve strays nowhere in particular: halve it.
                middle = worst if straying > 1e-6 else (first + last) // 2
                kept.add(middle)
                legs += [(first, middle), (middle, last)]
    return np.array(sorted(kept))
