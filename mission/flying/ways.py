"""Proven ways from one place to another at rest: to the start of an exploration, and home.

A way is a polyline flown from corner to corner, standing at each, as one spline: control points on a straight line
keep the curve on it, and a corner repeated three times is passed through at rest. Straight is tried first, then over
the obstacles at rising heights, then round them on a grid. Whatever comes out goes through the same gate as a plan.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Float
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from mission.mission_file.values import LOCAL_PLANE_M
from planner.gate import GateRefused, ProvenTrajectory
from planner.problem import Limits
from planner.trajectory import Trajectory

Distance = Callable[[Float[np.ndarray, "point 3"]], Float[np.ndarray, "point"]]
"""Signed distance to the nearest obstacle's surface, metres."""

# Curves aim inside the limits, as the planner's do.
_LIMIT_SHARE = 0.95
_LONGEST_STEP_S = 0.5
_STEPS_A_LEG = 8
_LEVELS = 6
_GRID_CELLS = 12_000
_SAMPLES_PER_CLEARANCE = 2.0


def along(corners_m: Float[np.ndarray, "corner 3"], limits: Limits) -> Trajectory:
    """The spline that flies a polyline from corner to corner, at rest at each.

    Args:
        corners_m: At least one corner; repeated ones are passed once.
        limits: What the vehicle can do.

    Returns:
        The curve; of one second of standing where there is only one place.

    Raises:
        ValueError: They are farther apart than a local plane reaches: somebody is wrong about where they are.
    """
    _check_distance(corners_m)
    corners = [corners_m[0]]
    for corner in corners_m[1:]:
        if np.linalg.norm(corner - corners[-1]) > 1e-6:
            corners.append(corner)
    legs = [_profile(b - a, limits) for a, b in itertools.pairwise(corners)]
    # One knot interval for all legs: the shortest leg's, so that none is flown faster than its limits.
    interval_s = min([_LONGEST_STEP_S, *(duration / _STEPS_A_LEG for duration, _, _ in legs)])
    # From speeding up to braking the acceleration turns round within a step.
    gentle_mps2 = 0.45 * limits.max_jerk_mps3 * interval_s
    if gentle_mps2 < limits.max_acceleration_mps2:
        limits = dataclasses.replace(limits, max_acceleration_mps2=gentle_mps2)
        legs = [_profile(b - a, limits) for a, b in itertools.pairwise(corners)]
    points = [corners[0]] * 3
    for (a, b), (duration_s, speed, acceleration) in zip(itertools.pairwise(corners), legs, strict=True):
        length = float(np.linalg.norm(b - a))
        times = np.arange(1, int(np.ceil(duration_s / interval_s)) + 1) * interval_s
        share = _trapezoid(np.minimum(times, duration_s), length, speed, acceleration) / length
        points += [a + part * (b - a) for part in share[share < 1.0 - 1e-9]]
        points += [b] * 3
    if len(points) == 3:
        return Trajectory(np.array(points + [corners[0]] * 2), 0.5)
    return Trajectory(np.array(points), interval_s)


def _check_distance(corners_m: Float[np.ndarray, "corner 3"]) -> None:
    """Refuse what no vehicle flies: to look for it alone would take more memory than there is."""
    apart_m = float(np.ptp(corners_m, axis=0).max())
    if not apart_m <= LOCAL_PLANE_M:
        raise ValueError(f"a way over {apart_m / 1e3:.0f} km is none: somebody is wrong about where the vehicle is")


def _profile(step_m: Float[np.ndarray, "3"], limits: Limits) -> tuple[float, float, float]:
    """Duration, top speed and acceleration of one straight leg."""
    length = float(np.linalg.norm(step_m))
    up = step_m[2] / length
    speed = limits.max_speed_mps
    if up > 1e-9:
        speed = min(speed, limits.max_climb_mps / up)
    elif up < -1e-9:
        speed = min(speed, limits.max_descent_mps / -up)
    speed, acceleration = _LIMIT_SHARE * speed, _LIMIT_SHARE * limits.max_acceleration_mps2
    top = min(speed, float(np.sqrt(acceleration * length)))
    return length / top + top / acceleration, top, acceleration


def _trapezoid(
    time_s: Float[np.ndarray, "time"], length_m: float, top_mps: float, acceleration_mps2: float
) -> Float[np.ndarray, "time"]:
    """Distance covered from rest to rest with bounded speed and acceleration."""
    ramp_s = top_mps / acceleration_mps2
    end_s = length_m / top_mps + ramp_s
    rising = 0.5 * acceleration_mps2 * time_s**2
    level = top_mps * (time_s - 0.5 * ramp_s)
    falling = length_m - 0.5 * acceleration_mps2 * np.maximum(end_s - time_s, 0.0) ** 2
    return np.where(time_s < ramp_s, rising, np.where(time_s < end_s - ramp_s, level, falling))


def find_way(
    start_m: Float[np.ndarray, "3"],
    end_m: Float[np.ndarray, "3"],
    limits: Limits,
    distance: Distance,
    keep_out_m: float,
    low_m: Float[np.ndarray, "3"],
    high_m: Float[np.ndarray, "3"],
    prove: Callable[[Trajectory], ProvenTrajectory],
) -> ProvenTrajectory:
    """The shortest way found that the gate passes.

    Args:
        start_m: Where it begins, at rest.
        end_m: Where it ends, at rest.
        limits: What the vehicle can do.
        distance: Signed distance to the obstacles.
        keep_out_m: Least distance of the vehicle's centre to them.
        low_m: Lower corner of the room for the way.
        high_m: Upper corner of it.
        prove: The gate.

    Returns:
        The proven curve.

    Raises:
        ValueError: There is none, with the gate's last word; or its ends are farther apart than a local plane reaches.
    """
    _check_distance(np.stack([start_m, end_m]))
    last = "nothing was tried"
    for corners in _candidates(start_m, end_m, distance, keep_out_m, low_m, high_m):
        if not _clear(corners, distance, keep_out_m):
            continue
        try:
            return prove(along(corners, limits))
        except GateRefused as refused:
            last = "; ".join(violation.text for violation in refused.report.violations)
    start, end = np.round(start_m, 1).tolist(), np.round(end_m, 1).tolist()
    raise ValueError(
        f"no proven way from {start} to {end}: {last}; obstacles are kept {keep_out_m:g} m away from: "
        "move the start, raise the ceiling, or give the obstacles more room"
    )


def _candidates(
    start_m: Float[np.ndarray, "3"],
    end_m: Float[np.ndarray, "3"],
    distance: Distance,
    keep_out_m: float,
    low_m: Float[np.ndarray, "3"],
    high_m: Float[np.ndarray, "3"],
) -> Iterator[Float[np.ndarray, "corner 3"]]:
    yield np.stack([start_m, end_m])
    lowest = max(start_m[2], end_m[2])
    for height in np.linspace(lowest, max(high_m[2], lowest), _LEVELS):
        above_start, above_end = np.array([*start_m[:2], height]), np.array([*end_m[:2], height])
        yield np.stack([start_m, above_start, above_end, end_m])
    around = _around(start_m, end_m, distance, 1.2 * keep_out_m, low_m, high_m)
    if around is not None:
        yield _shortened(around, distance, keep_out_m)
        yield around


def _clear(corners_m: Float[np.ndarray, "corner 3"], distance: Distance, keep_out_m: float) -> bool:
    """Whether a polyline keeps its distance at points that follow closely; the gate has the last word."""
    step = max(keep_out_m, 0.1) / _SAMPLES_PER_CLEARANCE
    points = [
        a + np.linspace(0.0, 1.0, max(2, int(np.linalg.norm(b - a) / step) + 2))[:, None] * (b - a)
        for a, b in itertools.pairwise(corners_m)
    ]
    return bool((distance(np.concatenate(points)) >= keep_out_m).all())


def _around(
    start_m: Float[np.ndarray, "3"],
    end_m: Float[np.ndarray, "3"],
    distance: Distance,
    keep_out_m: float,
    low_m: Float[np.ndarray, "3"],
    high_m: Float[np.ndarray, "3"],
) -> Float[np.ndarray, "corner 3"] | None:
    """The shortest path over a grid of free cells (Dijkstra, 26 neighbours)."""
    low, high = np.minimum(low_m, np.minimum(start_m, end_m)), np.maximum(high_m, np.maximum(start_m, end_m))
    cell = float((np.prod(np.maximum(high - low, 1e-3)) / _GRID_CELLS) ** (1.0 / 3.0))
    counts = np.maximum(2, np.ceil((high - low) / cell).astype(int) + 1)
    axes = [np.linspace(a, b, count) for a, b, count in zip(low, high, counts, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    # The ends join the grid as two more nodes, linked to the free cells next to them.
    nodes = np.concatenate([grid.reshape(-1, 3), start_m[None], end_m[None]])
    free = distance(nodes) >= keep_out_m
    free[-2:] = True
    index = np.arange(counts.prod()).reshape(counts)
    pairs = []
    for step in itertools.product((-1, 0, 1), repeat=3):
        if step > (0, 0, 0):
            here = tuple(slice(max(0, -s), min(n, n - s)) for s, n in zip(step, counts, strict=True))
            there = tuple(slice(max(0, s), min(n, n + s)) for s, n in zip(step, counts, strict=True))
            pairs.append(np.stack([index[here].ravel(), index[there].ravel()]))
    reach = 1.8 * max(float(axis[1] - axis[0]) for axis in axes)
    for node in (len(nodes) - 2, len(nodes) - 1):
        near = np.flatnonzero(np.linalg.norm(nodes[:-2] - nodes[node], axis=1) < reach)
        pairs.append(np.stack([np.full(len(near), node), near]))
    edges = np.concatenate(pairs, axis=1)
    middles = 0.5 * (nodes[edges[0]] + nodes[edges[1]])
    passable = free[edges[0]] & free[edges[1]]
    passable[passable] = distance(middles[passable]) >= keep_out_m / 1.2
    edges = edges[:, passable]
    lengths = np.linalg.norm(nodes[edges[0]] - nodes[edges[1]], axis=1)
    graph = coo_array((lengths, (edges[0], edges[1])), shape=(len(nodes), len(nodes))).tocsr()
    _, previous = dijkstra(graph, directed=False, indices=len(nodes) - 2, return_predecessors=True)
    chain = [len(nodes) - 1]
    while chain[-1] != len(nodes) - 2:
        if previous[chain[-1]] < 0:
            return None
        chain.append(int(previous[chain[-1]]))
    return nodes[chain[::-1]]


def _shortened(
    corners_m: Float[np.ndarray, "corner 3"], distance: Distance, keep_out_m: float
) -> Float[np.ndarray, "corner 3"]:
    """The same path without the corners that a clear straight line can skip."""
    kept = [0]
    while kept[-1] < len(corners_m) - 1:
        here = kept[-1]
        for there in range(len(corners_m) - 1, here, -1):
            if there == here + 1 or _clear(corners_m[[here, there]], distance, keep_out_m):
                kept.append(there)
                break
    return corners_m[kept]
