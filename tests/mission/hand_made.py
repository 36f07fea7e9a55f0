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
