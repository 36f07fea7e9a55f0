"""Small worlds that several tests plan in."""

import numpy as np

from planner.information import DensityGrid, gaussians, uniform
from planner.obstacles import Box, Cylinder, Obstacle, ObstacleField, Prism, Sphere
from planner.problem import Limits, Problem
from planner.trajectory import Motion
from planner.workspace import Workspace

LIMITS = Limits(max_speed_mps=5.0, max_climb_mps=2.0, max_descent_mps=1.5, max_acceleration_mps2=3.0)


def open_box(information: DensityGrid | None = None, **changes) -> Problem:
    """100 × 80 × 20 m with nothing in it, from one corner to the middle of a side."""
    workspace = Workspace(np.zeros(3), np.array([100.0, 80.0, 20.0]))
    given = {
        "workspace": workspace,
        "information": information or uniform(workspace, (16, 16, 4)),
        "obstacles": ObstacleField.of(()),
        "limits": LIMITS,
        "start": Motion.at_rest(np.array([5.0, 5.0, 10.0])),
        "end_position_m": np.array([95.0, 40.0, 10.0]),
        "duration_s": 200.0,
        "vehicle_radius_m": 0.4,
        "clearance_margin_m": 1.0,
    }
    return Problem(**{**given, **changes})


def trees(rng: np.random.Generator, count: int) -> list[Obstacle]:
    """Trunks all over the open box, its ends left free."""
    found: list[Obstacle] = []
    while len(found) < count:
        center, radius = rng.uniform([10.0, 10.0], [88.0, 75.0]), rng.uniform(0.3, 2.0)
        if np.linalg.norm(center - [95.0, 40.0]) > 12.0 and np.linalg.norm(center - 5.0) > 12.0:
            found.append(Cylinder(center, radius, 0.0, 30.0))
    return found


def mixed(rng: np.random.Generator, count: int) -> list[Obstacle]:
    """Bodies of every kind in the open box, some to be flown over, its ends left free."""
    found: list[Obstacle] = []
    while len(found) < count:
        center, size = rng.uniform([15.0, 12.0, 0.0], [82.0, 68.0, 20.0]), rng.uniform(2.0, 6.0)
        corners = center[:2] + size * np.array([[-1, -1], [1, -1], [1, 1], [0, 0.3], [-1, 1]])
        found.append(
            [
                Sphere(center, size),
                Cylinder(center[:2], size, 0.0, center[2] + 2.0),
                Box(center - size, center + size * np.array([1.0, 0.5, 0.5])),
                Prism(corners, 0.0, center[2] + 1.0),
            ][len(found) % 4]
        )
    return found


def two_peaks(problem: Problem) -> DensityGrid:
    """Information in two places at different heights."""
    return gaussians(
        problem.workspace,
        np.array([[25.0, 60.0, 5.0], [75.0, 20.0, 15.0]]),
        np.array([[8.0, 6.0, 1.5], [10.0, 8.0, 1.5]]),
        np.array([1.0, 2.0]),
        (32, 32, 16),
    )
