"""A problem that is solved in a moment: three obstacles in a box of sixty metres, and back to the start."""

import dataclasses

import numpy as np

from planner.information import uniform
from planner.obstacles import Box, Cylinder, ObstacleField, Sphere
from planner.problem import Kernel, Limits, Options, Problem
from planner.trajectory import Motion
from planner.workspace import Workspace

BOX = Workspace(np.array([0.0, 0.0, 5.0]), np.array([60.0, 40.0, 15.0]))
OPTIONS = Options(candidates=4, modes=(8, 8, 1), kernel=Kernel.RBF)
OBSTACLE_LIST = [
    Sphere(np.array([20.0, 20.0, 10.0]), 4.0),
    Cylinder(np.array([40.0, 12.0]), 3.0, 0.0, 20.0),
    Box(np.array([30.0, 28.0, 0.0]), np.array([36.0, 34.0, 20.0])),
]
OBSTACLES = ObstacleField.of(OBSTACLE_LIST)


def problem_with(**changes: object) -> Problem:
    problem = Problem(
        workspace=BOX,
        information=uniform(BOX, (24, 16, 4)),
        obstacles=OBSTACLES,
        limits=Limits(max_speed_mps=3.0, max_climb_mps=2.0, max_descent_mps=1.0, max_acceleration_mps2=4.0),
        start=Motion.at_rest(np.array([5.0, 5.0, 10.0])),
        end_position_m=np.array([5.0, 5.0, 10.0]),
        duration_s=100.0,
        vehicle_radius_m=0.4,
        clearance_margin_m=0.8,
    )
    return dataclasses.replace(problem, **changes)
