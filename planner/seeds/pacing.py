"""From a path in space to positions in time: how far the vehicle gets, and where it is when.

Lengths are those of `FreeSpace.flown_lengths`, so that climbs and descents keep their own limits.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from planner.free_space import FreeSpace
from planner.polyline import at_lengths, densified
from planner.problem import Problem

# Seeds keep off the limits, so that smoothing and corners stay within them.
SPEED_SHARE = 0.92
ACCELERATION_SHARE = 0.7
# A corner flown at speed v with acceleration a takes about v/a; the smoothing's deviation is this share of it.
CORNER_SHARE = 0.35
_PROFILE_STEPS = 2000


def reach_m(problem: Problem, duration_s: float | None = None) -> float:
    """How long a path can be that is flown from the start's speed to rest in the time there is.

    Args:
        problem: Vehicle, start and time.
        duration_s: Time; None: the problem's.
    """
    time_s = problem.duration_s if duration_s is None else duration_s
    return float(_lengths(problem, time_s, SPEED_SHARE * problem.limits.max_speed_mps)[-1])


def paced(
    points_m: Float[np.ndarray, "point 3"], problem: Problem, free: FreeSpace, moments: int
) -> Float[np.ndarray, "moment 3"]:
    """Positions at equal times along a path: speeding up, cruising, slowing down, corners rounded.

    A path shorter than the vehicle's reach is flown more slowly; one that is longer is flown faster than seeds should.

    Args:
        points_m: The path; it begins where the vehicle is.
        problem: Vehicle, start and time.
        free: Where the vehicle may be.
        moments: How many positions, the first at the start, the last at the end.
    """
    legs = free.flown_lengths(points_m)
    total = float(legs.sum())
    top = SPEED_SHARE * problem.limits.max_speed_mps
    low, high = 0.0, top
    for _ in range(40):
        cruise = 0.5 * (low + high)
        low, high = (cruise, high) if _lengths(problem, problem.duration_s, cruise)[-1] < total else (low, cruise)
    along = _lengths(problem, problem.duration_s, high)
    # What the start's own speed carries beyond a short path, or what no speed reaches, is shrunk or stretched away.
    along *= total / max(float(along[-1]), 1e-9)
    time = np.linspace(0.0, problem.duration_s, moments)
    length = np.interp(time, np.linspace(0.0, problem.duration_s, _PROFILE_STEPS), along)
    positions = at_lengths(points_m, legs, length)
    corner_s = CORNER_SHARE * max(high, 1e-3) / problem.limits.max_acceleration_mps2
    moments_of_a_corner = min(corner_s, problem.duration_s / 30.0) / problem.duration_s * (moments - 1)
    smooth = gaussian_filter1d(positions, moments_of_a_corner, axis=0, mode="nearest")
    smooth[0], smooth[-1] = positions[0], positions[-1]
    between = free.pushed(smooth)
    between[0], between[-1] = positions[0], positions[-1]
    return between


def led_to_the_end(
    path_m: Float[np.ndarray, "point 3"], problem: Problem, free: FreeSpace
) -> Float[np.ndarray, "point 3"]:
    """A path cut where the vehicle must turn to its end to be there in time; it ends there (or where it is cut).

    Args:
        path_m: The path; it begins where the vehicle is.
        problem: Where to end, with which vehicle and time.
        free: Where the vehicle may be.
    """
    reach = reach_m(problem)
    dense = densified(path_m, max(reach / 1000.0, 1e-6))
    along = np.concatenate([[0.0], np.cumsum(free.flown_lengths(dense))])
    end = problem.end_position_m
    if end is None:
        last = int(np.searchsorted(along, reach, side="right")) - 1
        return dense[: max(last, 1) + 1]
    home = np.linalg.norm(dense - end, axis=1)
    rise = end[2] - dense[:, 2]
    home = np.maximum(home, np.where(rise > 0.0, rise * free.climb_cost, -rise * free.descent_cost))
    kept = np.append(dense, end[None], axis=0)
    for _ in range(6):
        fits = np.flatnonzero(along + home <= reach)
        last = int(fits[-1]) if fits.size else 0
        way_home = free.path_through(np.stack([dense[last], end]))
        kept = np.concatenate([dense[:last], way_home])
        excess = float(free.flown_lengths(kept).sum()) - reach
        if excess <= 0.0 or last == 0:
            break
        # The way home is longer than straight: turn earlier.
        home = home + excess
    return kept


def lead_in(problem: Problem) -> Float[np.ndarray, "point 3"]:
    """Where a vehicle in motion is carried before it can turn: its position, and where braking would bring it."""
    start = problem.start
    speed = float(np.linalg.norm(start.velocity_mps))
    carried = start.velocity_mps * speed / (2.0 * problem.limits.max_acceleration_mps2)
    if speed < 0.05 * problem.limits.max_speed_mps:
        return start.position_m[None]
    ahead = np.clip(start.position_m + carried, problem.workspace.box_min_m, problem.workspace.box_max_m)
    return np.stack([start.position_m, ahead])


def _lengths(problem: Problem, duration_s: float, cruise_mps: float) -> Float[np.ndarray, "step"]:
    """Length flown by each of equal moments: from the start's speed to the cruise, and to rest at the end."""
    time = np.linspace(0.0, duration_s, _PROFILE_STEPS)
    change = ACCELERATION_SHARE * problem.limits.max_acceleration_mps2
    first = float(np.linalg.norm(problem.start.velocity_mps))
    begin = np.clip(cruise_mps, first - change * time, first + change * time)
    speed = np.minimum(begin, change * (duration_s - time))
    middle = 0.5 * (speed[1:] + speed[:-1])
    return np.concatenate([[0.0], np.cumsum(middle * np.diff(time))])
