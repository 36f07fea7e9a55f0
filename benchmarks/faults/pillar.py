"""What is rehearsed: a box with one pillar, the curve through it, and how near a place is to what must not be."""

from __future__ import annotations

import dataclasses
import functools
import math
import tempfile
from pathlib import Path

import numpy as np

from mission.flying.ways import along
from mission.loading import load
from mission.mission_file import Mission
from mission.mission_file.obstacle import Cylinder
from mission.site.fence import autopilot_fence
from mission.site.problem import problem_from_mission
from planner import gate
from planner.gate import ProvenTrajectory
from planner.problem import Problem

MISSION = """
[site]
origin = { latitude_deg = 47.3977, longitude_deg = 8.5456, altitude_amsl_m = 488.0 }
box_min_enu_m = [0.0, 0.0, 8.0]
box_max_enu_m = [120.0, 100.0, 30.0]
fence_margin_m = 40.0
[information]
kind = "uniform"
[[obstacle]]
kind = "cylinder"
center_enu_m = [60.0, 50.0]
radius_m = 5.0
floor_m = 0.0
ceiling_m = 40.0
[planner]
start_enu_m = [20.0, 20.0, 12.0]
duration_s = 80.0
modes = [4, 4, 2]
[flight]
clearance_margin_m = 3.0
takeoff_altitude_m = 10.0
end = "return"
"""
CORNERS = np.array([[20.0, 20.0, 12.0], [95.0, 20.0, 12.0], [95.0, 75.0, 16.0], [30.0, 75.0, 14.0]])


@functools.cache
def mission() -> Mission:
    """What is rehearsed."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rehearsal.toml"
        path.write_text(MISSION, encoding="utf-8")
        return load(path)


@functools.cache
def problem() -> Problem:
    """The same for the planner."""
    return problem_from_mission(mission())


@functools.cache
def along_corners() -> ProvenTrajectory:
    """The proven curve from corner to corner."""
    curve = along(CORNERS, problem().limits)
    asked = dataclasses.replace(problem(), start=curve.motion_at(0.0), duration_s=curve.duration_s, end_position_m=None)
    return gate.prove(curve, asked)


@functools.cache
def _fence_box_m() -> tuple[np.ndarray, np.ndarray]:
    """The vehicle's fence, which is a box here: lowest and highest corner."""
    site = mission().site
    corners = np.array(autopilot_fence(site))
    ceiling_m = site.box_m[1][2] + site.fence_margin_m
    return np.array([*corners.min(axis=0), -np.inf]), np.array([*corners.max(axis=0), ceiling_m])


def outside_fence_m(place_m: np.ndarray) -> float:
    """How far a place is outside the fence; negative inside."""
    low, high = _fence_box_m()
    return float(np.maximum(low - place_m, place_m - high).max())


def clearance_m(place_m: np.ndarray) -> float:
    """From the vehicle's hull to the one pillar there is, worked out without the planner's help."""
    (pillar,) = mission().obstacle
    assert isinstance(pillar, Cylinder), "the rehearsal's only obstacle is a pillar"
    across_m = math.dist(place_m[:2], pillar.center_enu_m) - pillar.radius_m
    above_m = float(place_m[2]) - pillar.ceiling_m
    outside_m = math.hypot(max(across_m, 0.0), max(above_m, 0.0)) + min(max(across_m, above_m), 0.0)
    return outside_m - mission().vehicle.radius_m
