"""Curves to hold against the gate, and the problems that they solve."""

import numpy as np

from planner.information import uniform
from planner.obstacles import ObstacleField
from planner.problem import Limits, Problem
from planner.trajectory import Trajectory
from planner.workspace import Workspace


def random_curve(rng: np.random.Generator, segments: int = 20, scale_m: float = 40.0) -> Trajectory:
    """A smooth wandering curve from rest to rest."""
    knots = np.cumsum(rng.normal(size=(segments + 1, 3)), axis=0)
    knots = (knots - knots.min(axis=0)) / np.ptp(knots, axis=0) * scale_m + 5.0
    control = np.concatenate([knots[:1], knots[:1], knots, knots[-1:], knots[-1:]])
    return Trajectory(control, float(rng.uniform(0.3, 3.0)), start_s=float(rng.uniform(0.0, 100.0)))


def problem_of(curve: Trajectory, obstacles=(), **changes) -> Problem:
    """A problem that the curve solves, but for what is given."""
    workspace = Workspace(np.full(3, -1.0), np.full(3, 60.0))
    given = {
        "workspace": workspace,
        "information": uniform(workspace, (4, 4, 4)),
        "obstacles": ObstacleField.of(obstacles),
        "limits": Limits(1e4, 1e4, 1e4, 1e4),
        "start": curve.motion_at(curve.start_s),
        "end_position_m": curve.motion_at(curve.end_s).position_m,
        "duration_s": curve.duration_s,
        "vehicle_radius_m": 0.3,
        "clearance_margin_m": 0.2,
    }
    return Problem(**{**given, **changes})


def dense(curve: Trajectory, count: int = 20_001):
    return curve.sample(np.linspace(curve.start_s, curve.end_s, count))
