"""From a path in space to positions in time: how far the vehicle gets, and where it is when.

The path's corners are rounded; then each place has its greatest speed, by the vehicle's limits and the path's
curvature, and speeds up and slows down no faster than it may (Bobrow, Dubowsky & Gibson, 1985, with the two
accelerations' shares fixed). The cruise is what makes the path last as long as there is time.

| symbol | identifier   | unit | meaning                                              |
|--------|--------------|------|------------------------------------------------------|
| s      | `along`      | m    | length along the path                                |
| κ      | `curvature`  | 1/m  | v²κ is the acceleration across the path              |
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import root_scalar

from planner.free_space import FreeSpace
from planner.polyline import at_lengths, at_places, cut_at, densified
from planner.problem import Problem

# Seeds keep off the limits, so that the spline through them stays within.
SPEED_SHARE = 0.92
ACROSS_SHARE = 0.7
ALONG_SHARE = 0.5
# Corners are rounded over this share of v²/a, but by no more than a share of the whole path.
ROUNDING_SHARE = 0.2
MOST_ROUNDING = 1.0 / 60.0
PLACES = 1200
TURN_SHARE = 0.6
LENGTH_SHARE = 0.97
# Positions are smoothed over this share of the time in which the jerk reaches the acceleration.
JERK_SHARE = 0.6
# How far a vehicle in motion is carried before it turns, as a share of the way that braking takes.
BRAKING_SHARE = 1.1
# How exactly the cruise is found, as a share of the shortest time for a metre.
PACED_TO = 1e-5
_PROFILE_STEPS = 2000


def reach_m(problem: Problem, duration_s: float | None = None) -> float:
    """How long a path can be: what is flown from the start's speed to rest in the time there is, or the length allowed.

    Args:
        problem: Vehicle, start and time.
        duration_s: Time; None: the problem's.
    """
    time_s = problem.duration_s if duration_s is None else duration_s
    flown_m = float(_lengths(problem, time_s, SPEED_SHARE * problem.limits.max_speed_mps)[-1])
    return min(flown_m, LENGTH_SHARE * problem.max_length_m)


def paced(
    points_m: Float[np.ndarray, "point 3"], problem: Problem, free: FreeSpace, moments: int
) -> tuple[Float[np.ndarray, "moment 3"], float]:
    """Positions at equal times along a path, corners rounded, within the vehicle's limits.

    Args:
        points_m: The path; it begins where the vehicle is.
        problem: Vehicle, start and time.
        free: Where the vehicle may be.
        moments: How many positions, the first at the start, the last at the end.

    Returns:
        The positions, and by what factor the path was too long for the time (one or less: it fits).
    """
    limits = problem.limits
    path = _rounded(points_m, problem, free)
    steps = np.diff(path, axis=0)
    length = np.maximum(np.linalg.norm(steps, axis=1), 1e-12)
    along = np.concatenate([[0.0], np.cumsum(length)])
    slope = np.append(steps[:, 2] / length, 0.0)
    steepest = np.where(slope > 0.0, slope / limits.max_climb_mps, -slope / limits.max_descent_mps)
    greatest = SPEED_SHARE / np.maximum(1.0 / limits.max_speed_mps, steepest)
    across = ACROSS_SHARE * limits.max_acceleration_mps2
    curvature = np.maximum(_curvature(path, length), 1e-12)
    greatest = np.minimum(greatest, np.sqrt(across / curvature))
    greatest = np.minimum(greatest, TURN_SHARE * limits.max_turn_rate_radps / curvature)
    change = 2.0 * ALONG_SHARE * limits.max_acceleration_mps2
    first = float(np.linalg.norm(problem.start.velocity_mps))

    def times(cruise_mps: float) -> Float[np.ndarray, "place"]:
        squared = np.minimum(greatest, cruise_mps) ** 2
        squared[-1] = 0.0
        squared[0] = first**2
        speeding = np.minimum.accumulate(squared - change * along) + change * along
        slowing = np.minimum.accumulate((squared + change * along)[::-1])[::-1] - change * along
        speed = np.sqrt(np.maximum(np.minimum(speeding, slowing), 0.0))
        return np.concatenate([[0.0], np.cumsum(2.0 * length / np.maximum(speed[1:] + speed[:-1], 1e-30))])

    fastest = 1.0 / limits.max_speed_mps
    excess = float(times(limits.max_speed_mps)[-1]) / problem.duration_s
    slowness = fastest
    if excess < 1.0:
        # The time is nearly straight in 1/cruise, and no cruise makes it shorter than the path's length over it.
        slowest = 1.1 * problem.duration_s / float(length[1:].sum())
        slowness = root_scalar(
            lambda slowness: times(1.0 / slowness)[-1] - problem.duration_s,
            method="brentq",
            bracket=(fastest, slowest),
            xtol=PACED_TO * fastest,
        ).root
    when = times(1.0 / slowness)
    # A path that no cruise makes fit is flown in the same proportions, faster than seeds should.
    place = np.interp(np.linspace(0.0, when[-1], moments), when, np.arange(len(path)))
    positions = at_places(path, place)
    spread_s = JERK_SHARE * limits.max_acceleration_mps2 / limits.max_jerk_mps3
    if spread_s > 0.0:
        smooth = free.pushed(_smoothed(positions, spread_s / problem.duration_s * (moments - 1)))
        positions = np.concatenate([positions[:1], smooth[1:-1], positions[-1:]])
    return positions, excess


def _rounded(points_m: Float[np.ndarray, "point 3"], problem: Problem, free: FreeSpace) -> Float[np.ndarray, "place 3"]:
    """The path at places of equal distance, its corners rounded, then moved out of what rounding cut into."""
    legs = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    total = float(legs.sum())
    path = at_lengths(points_m, legs, np.linspace(0.0, total, PLACES))
    limits = problem.limits
    radius = ROUNDING_SHARE * limits.max_speed_mps**2 / limits.turning_acceleration_mps2
    spread = min(radius / max(total, 1e-9), MOST_ROUNDING) * (PLACES - 1)
    for share in (1.0, 0.5):
        smooth = free.pushed(_smoothed(path, share * spread))
        smooth[[0, -1]] = path[[0, -1]]
        path = smooth
    return _smoothed(path, 0.25 * spread)


def _smoothed(path: Float[np.ndarray, "place 3"], spread: float) -> Float[np.ndarray, "place 3"]:
    """Smoothed over a number of places, the ends kept (the path is continued beyond them point-symmetrically)."""
    margin = min(len(path) - 1, int(4.0 * spread) + 1)
    before = 2.0 * path[0] - path[margin:0:-1]
    after = 2.0 * path[-1] - path[-2 : -margin - 2 : -1]
    whole = gaussian_filter1d(np.concatenate([before, path, after]), spread, axis=0)
    return whole[margin : margin + len(path)]


def _curvature(path: Float[np.ndarray, "place 3"], length: Float[np.ndarray, "leg"]) -> Float[np.ndarray, "place"]:
    """Turn of the direction over the way, 1/m; the ends do not turn."""
    direction = np.diff(path, axis=0) / length[:, None]
    turn = np.linalg.norm(np.diff(direction, axis=0), axis=1)
    return np.pad(turn / (0.5 * (length[1:] + length[:-1])), 1)


def led_to_the_end(
    path_m: Float[np.ndarray, "point 3"], problem: Problem, free: FreeSpace, reach: float
) -> Float[np.ndarray, "point 3"]:
    """A path cut where the vehicle must turn to its end to be there in time; it ends there (or where it is cut).

    Args:
        path_m: The path; it begins where the vehicle is.
        problem: Where to end, with which vehicle and time.
        free: Where the vehicle may be.
        reach: How long it may be, metres of `FreeSpace.flown_lengths`.
    """
    # What is out of reach is not looked at: of a large pattern that may be nearly all.
    within = cut_at(path_m, free.flown_lengths(path_m), reach)
    dense = densified(within, max(reach / 1000.0, 1e-6))
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
    carried = BRAKING_SHARE * start.velocity_mps * speed / (2.0 * ALONG_SHARE * problem.limits.max_acceleration_mps2)
    if speed < 0.05 * problem.limits.max_speed_mps:
        return start.position_m[None]
    ahead = np.clip(start.position_m + carried, problem.workspace.box_min_m, problem.workspace.box_max_m)
    return np.stack([start.position_m, ahead])


def _lengths(problem: Problem, duration_s: float, cruise_mps: float) -> Float[np.ndarray, "step"]:
    """Length flown by each of equal moments: from the start's speed to the cruise, and to rest at the end."""
    time = np.linspace(0.0, duration_s, _PROFILE_STEPS)
    change = ALONG_SHARE * problem.limits.max_acceleration_mps2
    first = float(np.linalg.norm(problem.start.velocity_mps))
    begin = np.clip(cruise_mps, first - change * time, first + change * time)
    speed = np.minimum(begin, change * (duration_s - time))
    middle = 0.5 * (speed[1:] + speed[:-1])
    return np.concatenate([[0.0], np.cumsum(middle * np.diff(time))])
