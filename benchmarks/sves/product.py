"""The product's own solver on the paper's unit square and cube."""

from __future__ import annotations

import numpy as np

from planner.information import DensityGrid
from planner.judging import at_middles
from planner.obstacles import Cylinder, ObstacleField
from planner.plan import Plan
from planner.problem import Limits, Options, Problem
from planner.solver import solve
from planner.trajectory import Motion
from planner.workspace import Workspace

EDGE_M = 100.0
HEIGHT_M = 20.0
SPEED_MPS = 5.0


def square(edge_m: float = EDGE_M, height_m: float = HEIGHT_M) -> Workspace:
    """The box that stands for the unit square (a cube where both lengths are the same)."""
    return Workspace(np.zeros(3), np.array([edge_m, edge_m, height_m]))


def planned(
    information: DensityGrid,
    start: np.ndarray,
    end: np.ndarray,
    length: float,
    options: Options,
    centers: np.ndarray | None = None,
    radii: np.ndarray | None = None,
) -> tuple[Plan, np.ndarray]:
    """A plan whose paths are no longer than `length`, and its paths in the unit cube.

    Args:
        information: On `square()`.
        start: Unit cube, shape (3,).
        end: Unit cube, shape (3,).
        length: In edges.
        options: How to solve.
        centers: Of circles, unit square, shape (obstacle, 3).
        radii: Shape (obstacle,).
    """
    box = information.workspace
    circles = [] if centers is None or radii is None else list(zip(centers, radii, strict=True))
    field = ObstacleField.of(
        [Cylinder(EDGE_M * center[:2], EDGE_M * radius, 0.0, box.box_max_m[2]) for center, radius in circles]
    )
    problem = Problem(
        workspace=box,
        information=information,
        obstacles=field,
        limits=Limits(SPEED_MPS, SPEED_MPS, SPEED_MPS, SPEED_MPS),
        start=Motion.at_rest(box.enu_from_unit(start)),
        end_position_m=box.enu_from_unit(end),
        duration_s=length * EDGE_M / SPEED_MPS,
        vehicle_radius_m=0.0,
        clearance_margin_m=0.5,
    )
    plan = solve(problem, options)
    paths = np.stack([box.unit_from_enu(at_middles(one.trajectory).position_m) for one in plan.candidates])
    return plan, paths
