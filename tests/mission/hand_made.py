"""Plans made by hand, so that no test waits for a solver that is not about solving."""

import dataclasses
from pathlib import Path

import numpy as np

from mission.flying.ways import along
from mission.loading import load
from mission.planning import Planned
from mission.site.problem import options_from_mission, problem_from_mission
from planner import gate
from planner.diversity import Diversity
from planner.plan import Candidate, Plan, Status

MISSION = """
[site]
origin = { latitude_deg = 47.3977, longitude_deg = 8.5456, altitude_amsl_m = 488.0 }
box_min_enu_m = [0.0, 0.0, 8.0]
box_max_enu_m = [100.0, 80.0, 30.0]
[information]
kind = "uniform"
[[obstacle]]
kind = "cylinder"
center_enu_m = [50.0, 40.0]
radius_m = 5.0
floor_m = 0.0
ceiling_m = 40.0
[planner]
start_enu_m = [15.0, 15.0, 12.0]
duration_s = 80.0
modes = [4, 4, 2]
[flight]
takeoff_altitude_m = 10.0
end = "return"
[replanning]
enabled = false
"""
CORNERS = np.array([[15.0, 15.0, 12.0], [70.0, 15.0, 12.0], [70.0, 55.0, 15.0], [30.0, 60.0, 14.0]])
"""Round a mast, in the mission above."""


def plan_by_hand(text: str, corners: np.ndarray, folder: Path, overrides=()) -> Planned:
    """A mission, written into a folder, with a plan that goes straight from corner to corner."""
    path = folder / "mission.toml"
    path.write_text(text, encoding="utf-8")
    mission = load(path, overrides)
    problem = problem_from_mission(mission)
    curve = along(corners, problem.limits)
    problem = dataclasses.replace(problem, duration_s=max(problem.duration_s, curve.duration_s))
    candidate = Candidate(gate.prove(curve, problem), "by hand", 0.1, 0.1)
    plan = Plan(Status.CONVERGED, (candidate,), 0, 1.0, Diversity(0.0, 0.0, 0.0, 1.0), 0)
    return Planned(mission, problem, options_from_mission(mission), plan, 0.0, 0.0)
