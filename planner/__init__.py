"""Stein variational ergodic search: sets of different, proven exploration trajectories.

Pure: local ENU metres and seconds in and out; no files, clocks, sockets, prints or global flags.

    from planner import Limits, ObstacleField, Options, Problem, Workspace, solve
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.information import DensityGrid
    from planner.obstacles import Box, Cylinder, ObstacleField, Prism, Sphere
    from planner.plan import Candidate, Plan, Status
    from planner.problem import HeadingRule, Kernel, Limits, Method, Metric, MetricWeights, Options, Problem
    from planner.solver import Progress, solve
    from planner.trajectory import Motion, Trajectory
    from planner.workspace import Workspace

_HOMES = {
    "information": ("DensityGrid",),
    "obstacles": ("Box", "Cylinder", "ObstacleField", "Prism", "Sphere"),
    "plan": ("Candidate", "Plan", "Status"),
    "problem": ("HeadingRule", "Kernel", "Limits", "Method", "Metric", "MetricWeights", "Options", "Problem"),
    "solver": ("Progress", "solve"),
    "trajectory": ("Motion", "Trajectory"),
    "workspace": ("Workspace",),
}

__all__ = [
    "Box",
    "Candidate",
    "Cylinder",
    "DensityGrid",
    "HeadingRule",
    "Kernel",
    "Limits",
    "Method",
    "Metric",
    "MetricWeights",
    "Motion",
    "ObstacleField",
    "Options",
    "Plan",
    "Prism",
    "Problem",
    "Progress",
    "Sphere",
    "Status",
    "Trajectory",
    "Workspace",
    "solve",
]


def __getattr__(name: str) -> object:
    """Import what is asked for when it is: JAX takes two seconds to start."""
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"planner.{module}"), name)
    raise AttributeError(f"module 'planner' has no attribute {name!r}")
