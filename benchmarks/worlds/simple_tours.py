"""What anyone would fly: a straight line and a lawnmower, leg by leg with a stop at every corner.

Each leg speeds up, cruises and brakes within the vehicle's limits; what takes less time than there is, is flown slower
as a whole. The curve goes through the same gate as the product's.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from planner.free_space import FreeSpace
from planner.gate import inspect
from planner.polyline import densified, length_of, without_repeats
from planner.problem import Problem
from planner.seeds import spline_from_path
from planner.trajectory import Trajectory

# A spline rounds off the corners of the speed's profile, which costs acceleration.
ACCELERATION_SHARE = 0.8
SPEED_SHARE = 0.95
MOMENTS_A_LEG = 64
ROWS = (2, 3, 4, 6)
INSET = 0.06
FEWEST_SEGMENTS, MOST_SEGMENTS = 64, 1024


def stop_and_go(path_m: np.ndarray, problem: Problem) -> Trajectory | None:
    """A polyline flown with a stop at each corner; None where there is not enough time."""
    limits = problem.limits
    path = without_repeats(np.asarray(path_m, dtype=float))
    times, places, now_s, shortest_s = [np.zeros(1)], [path[:1]], 0.0, np.inf
    for begin, end in itertools.pairwise(path):
        length = float(np.linalg.norm(end - begin))
        if length <= 0.0:
            continue
        slope = (end[2] - begin[2]) / length
        speed = SPEED_SHARE * limits.max_speed_mps
        if slope > 0.0:
            speed = min(speed, SPEED_SHARE * limits.max_climb_mps / slope)
        elif slope < 0.0:
            speed = min(speed, SPEED_SHARE * limits.max_descent_mps / -slope)
        acceleration = ACCELERATION_SHARE * limits.max_acceleration_mps2
        speed = min(speed, float(np.sqrt(acceleration * length)))
        ramp_s = speed / acceleration
        leg_s = length / speed + ramp_s
        moment = np.linspace(0.0, leg_s, MOMENTS_A_LEG)[1:]
        ramp = np.minimum(np.minimum(moment, leg_s - moment), ramp_s)
        cruise = np.clip(moment - ramp_s, 0.0, leg_s - 2.0 * ramp_s)
        along = np.where(moment > 0.5 * leg_s, length - 0.5 * acceleration * ramp**2, 0.5 * acceleration * ramp**2)
        flat = (moment >= ramp_s) & (moment <= leg_s - ramp_s)
        along = np.where(flat, 0.5 * acceleration * ramp_s**2 + speed * cruise, along)
        times.append(now_s + moment)
        places.append(begin + along[:, None] / length * (end - begin))
        now_s += leg_s
        shortest_s = min(shortest_s, ramp_s)
    if now_s > problem.duration_s:
        return None
    if now_s == 0.0:
        segments, points = FEWEST_SEGMENTS, np.repeat(path[:1], FEWEST_SEGMENTS + 1, axis=0)
    else:
        # Six knots over the shortest of the ramps.
        segments = int(np.clip(6.0 * now_s / shortest_s, FEWEST_SEGMENTS, MOST_SEGMENTS))
        when, where = np.concatenate(times), np.concatenate(places)
        moments = np.linspace(0.0, now_s, 4 * segments + 1)
        points = np.stack([np.interp(moments, when, axis) for axis in where.T], axis=1)
    return Trajectory(spline_from_path(points, problem, segments), problem.duration_s / segments)


def straight_lines(problem: Problem) -> Iterator[np.ndarray]:
    """From the start to the end; of a tour, towards the middle and back."""
    start, end = problem.start.position_m, problem.end_position_m
    middle = 0.5 * (problem.workspace.box_min_m + problem.workspace.box_max_m)
    middle = np.array([*middle[:2], start[2]])
    if end is None:
        yield np.stack([start, middle])
    elif np.linalg.norm(end - start) == 0.0:
        yield np.stack([start, middle, end])
    else:
        yield np.stack([start, end])


def lawnmowers(problem: Problem) -> Iterator[np.ndarray]:
    """Rows along either side at the start's altitude, from any corner, with the ways to and from them."""
    box, start, end = problem.workspace, problem.start.position_m, problem.end_position_m
    low, high = box.box_min_m[:2] + INSET * box.lengths_m[:2], box.box_max_m[:2] - INSET * box.lengths_m[:2]
    for rows, along, reverse_rows, reverse_order in itertools.product(ROWS, (0, 1), (False, True), (False, True)):
        across = np.linspace(low[1 - along], high[1 - along], rows)
        if reverse_order:
            across = across[::-1]
        points = np.full((2 * rows, 3), start[2])
        for row, place in enumerate(across):
            ends = (low[along], high[along]) if (row % 2 == 0) != reverse_rows else (high[along], low[along])
            points[2 * row : 2 * row + 2, 1 - along] = place
            points[2 * row : 2 * row + 2, along] = ends
        yield np.concatenate([start[None], points] if end is None else [start[None], points, end[None]])


def first_feasible(problem: Problem, paths: Iterator[np.ndarray], led_around: bool) -> Trajectory | None:
    """The first of some tours that the gate passes.

    Args:
        problem: What it must keep to.
        paths: Tours, as polylines.
        led_around: Whether they are first led around what is in the way.
    """
    free = FreeSpace(problem)
    least = FreeSpace(problem, allowance=1.0)
    spacing = 0.005 * float(problem.workspace.lengths_m[:2].max())
    for path in paths:
        if length_of(path) > problem.limits.max_speed_mps * problem.duration_s:
            continue
        way = free.path_through(path) if led_around else path
        if (least.margin(densified(way, spacing)) < 0.0).any():
            continue
        curve = stop_and_go(way, problem)
        if curve is not None and inspect(curve, problem).passed:
            return curve
    return None
