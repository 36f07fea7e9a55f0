"""Paths that follow the information: tours of sampled places, and the greedy ridge."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.distance import cdist

from planner.problem import Problem

MOST_STOPS = 160
SAMPLES_A_STOP = 24
CENTERING_ROUNDS = 4
MOST_RIDGE_CELLS = 64


def stops(problem: Problem, count: int, rng: np.random.Generator) -> Float[np.ndarray, "stop 3"]:
    """Places that stand for equal shares of the information: samples of it, spread by Lloyd's iteration."""
    grid = problem.information
    size = count * SAMPLES_A_STOP
    # One draw from each of equal shares of the mass: fewer clumps than independent draws.
    share = (np.arange(size) + rng.random(size)) / size
    cell = np.minimum(np.searchsorted(grid.cumulative_mass, share), grid.mass.size - 1)
    index = np.stack(np.unravel_index(cell, grid.mass.shape), axis=1)
    samples = problem.workspace.box_min_m + (index + rng.random((size, 3))) * grid.cell_m
    scale = problem.workspace.lengths_m
    unit = samples / scale
    centers = unit[rng.choice(size, count, replace=False)]
    for _ in range(CENTERING_ROUNDS):
        # ‖x − c‖² less ‖x‖², which is the same for all centres.
        owner = np.argmin(np.sum(centers**2, axis=1) - 2.0 * unit @ centers.T, axis=1)
        number = np.bincount(owner, minlength=count)
        total = np.stack([np.bincount(owner, axis, minlength=count) for axis in unit.T], axis=1)
        centers = np.where(number[:, None] > 0, total / np.maximum(number, 1)[:, None], centers)
    return centers * scale


def tour(
    start_m: Float[np.ndarray, "3"],
    stops_m: Float[np.ndarray, "stop 3"],
    end_m: Float[np.ndarray, "3"] | None,
    vertical_cost: float,
) -> Float[np.ndarray, "point 3"]:
    """A short way from the start over all stops to the end: nearest neighbour, then 2-opt (Croes, 1958).

    Args:
        start_m: Where it begins.
        stops_m: What it visits.
        end_m: Where it ends; None: at any stop.
        vertical_cost: Level metres that a vertical metre is worth.

    Returns:
        Start, stops in order, end.
    """
    points = np.concatenate([start_m[None], stops_m] if end_m is None else [start_m[None], stops_m, end_m[None]])
    scaled = points * np.array([1.0, 1.0, vertical_cost])
    distance = cdist(scaled, scaled)
    inner = len(stops_m)
    left = np.ones(len(points), dtype=bool)
    left[[0] if end_m is None else [0, -1]] = False
    order = [0]
    for _ in range(inner):
        order.append(int(np.argmin(np.where(left, distance[order[-1]], np.inf))))
        left[order[-1]] = False
    if end_m is not None:
        order.append(len(points) - 1)
    return points[_two_opt(np.array(order), distance, end_m is not None)]


def _two_opt(order: np.ndarray, distance: Float[np.ndarray, "point point"], end_is_fixed: bool) -> np.ndarray:
    """Reverse the stretch that shortens the way most, until none does; the first stays first."""
    count = len(order)
    backward = np.tri(count - 1, dtype=bool)
    for _ in range(10 * count):
        ordered = distance[np.ix_(order, order)]
        step = np.diagonal(ordered, 1)
        # Reversing i+1 … j replaces the legs (i, i+1) and (j, j+1) by (i, j) and (i+1, j+1).
        gain = step[:, None] + step[None, :] - ordered[:-1, :-1] - ordered[1:, 1:]
        gain[backward] = -np.inf
        if not end_is_fixed:
            free = step - ordered[:-1, -1]
            gain = np.column_stack([gain, free])
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[i, j] <= 1e-9:
            break
        order[i + 1 : j + 1] = order[i + 1 : j + 1][::-1]
    return order


def greedy_ridge(
    problem: Problem, start_m: Float[np.ndarray, "3"], reach_m: float, eagerness: float
) -> Float[np.ndarray, "point 2"]:
    """Always on to where most unseen information is for the way there, a swath at a time.

    Args:
        problem: Its information, seen from above.
        start_m: Where it begins.
        reach_m: How long it may be.
        eagerness: Exponent of the distance: high stays near, low goes where most is.

    Returns:
        Middles of the cells swept, in order, beginning at the start.
    """
    swath = swath_m(problem, reach_m)
    workspace, grid = problem.workspace, problem.information
    low, extent = workspace.box_min_m[:2], workspace.lengths_m[:2]
    counts = np.clip(np.ceil(extent / swath).astype(int), 1, MOST_RIDGE_CELLS)
    flat = grid.map_mass
    centers = grid.map_centers_m()
    cell = np.minimum(((centers - low) / extent * counts).astype(int), counts - 1)
    left = np.zeros(counts)
    np.add.at(left, (cell[..., 0], cell[..., 1]), flat)
    axes = [low[a] + (np.arange(counts[a]) + 0.5) * extent[a] / counts[a] for a in (0, 1)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    left = left.reshape(-1)
    shortest = float((extent / counts).min())
    path, flown = [start_m[:2]], 0.0
    # Cells with next to nothing in them are not worth the way.
    floor = 1e-3 * float(left.max())
    for _ in range(4 * len(left)):
        way = np.linalg.norm(places - path[-1], axis=1)
        following = int(np.argmax(np.where(left > floor, left / np.maximum(way, shortest) ** eagerness, -1.0)))
        if flown > reach_m or left[following] <= floor:
            break
        flown += float(way[following])
        path.append(places[following])
        left[following] = 0.0
    return np.array(path)


def swath_m(problem: Problem, reach_m: float) -> float:
    """Width of the swath with which a path of this length sweeps the informative area once.

    The area is the perplexity exp(H) of the flat information, in cells: all of a uniform box, little of a peak.
    """
    flat = problem.information.map_mass
    present = flat[flat > 0.0]
    cells = float(np.exp(-np.sum(present * np.log(present))))
    area = cells * float(np.prod(problem.workspace.lengths_m[:2])) / flat.size
    return area / max(reach_m, 1e-9)


def peak_m(problem: Problem) -> Float[np.ndarray, "2"]:
    """Where the information, seen from above, is greatest; its middle where it is the same everywhere."""
    flat = problem.information.map_mass
    centers = problem.information.map_centers_m()
    greatest = flat >= flat.max() * (1.0 - 1e-9)
    return centers[greatest].mean(axis=0)


def spread_m(problem: Problem, center_m: Float[np.ndarray, "2"]) -> float:
    """Radius around a place that holds nine tenths of the information, as far as the box goes."""
    flat = problem.information.map_mass.reshape(-1)
    away = np.linalg.norm(problem.information.map_centers_m().reshape(-1, 2) - center_m, axis=1)
    order = np.argsort(away)
    within = int(np.searchsorted(np.cumsum(flat[order]), 0.9 * flat.sum()))
    return float(away[order][min(within, len(order) - 1)])
