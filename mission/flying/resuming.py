"""A flight that was interrupted, made ready to be flown on: what remains, not what was done."""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np

from mission.flying.belief import after, with_length_left
from mission.flying.flight_folder import FlightFolder
from mission.flying.journal import Unfinished, unfinished
from mission.planning import CompileTime, Planned, keep_compiled
from planner import gate
from planner.diversity import diversity
from planner.gate import ProvenTrajectory
from planner.judging import Judge
from planner.obstacles import ObstacleField
from planner.plan import Candidate, Plan, Status
from planner.problem import Problem
from planner.solver import solve
from planner.trajectory import Motion, Trajectory
from planner.workspace import Workspace


@dataclasses.dataclass(frozen=True)
class Resumption:
    """What is flown on.

    Attributes:
        planned: The mission with the curve that is left.
        from_s: Curve time at which to go on; None: the curve begins at rest and is flown from its start.
        left: What the journal says.
    """

    planned: Planned
    from_s: float | None
    left: Unfinished


def resumption(flight: FlightFolder) -> Resumption | None:
    """Make ready what a flight left undone.

    Args:
        flight: As it lies on the disk.

    Returns:
        The rest of the proven curve; a new plan where something that was pushed since is in its way; None: there is
        nothing left.

    Raises:
        ValueError: There is no curve to go on with, or no way on was found.
    """
    left = unfinished(flight.log)
    if left is None:
        return None
    rest = left.trajectory
    problem = dataclasses.replace(
        flight.problem, start=rest.motion_at(rest.start_s), duration_s=rest.duration_s, end_position_m=None
    )
    known = after(problem, left.flown_m, flight.options.modes, left.flown_yaw_rad)
    # It passed the gate when it was written; what lies on the disk passes it again, with what was pushed since.
    if left.only_home:
        candidate = Candidate(_stand_at_end(rest, problem), "resumed", math.nan, math.nan)
    else:
        candidate = Judge(known, flight.options).candidate(rest, "resumed")
    if candidate.feasible:
        plan = Plan(Status.KEPT, (candidate,), 0, math.nan, diversity(_unit_path(problem, rest)), 0)
        return Resumption(Planned(flight.mission, problem, flight.options, plan, 0.0, 0.0), left.from_s, left)
    return Resumption(_planned_anew(flight, left), None, left)


def _stand_at_end(rest: Trajectory, problem: Problem) -> ProvenTrajectory:
    """To stand where the exploration ended: what is flown home goes on from no curve, so none can be blocked."""
    place_m = rest.motion_at(rest.end_s).position_m
    stand = Trajectory(np.tile(place_m, (4, 1)), rest.knot_interval_s, rest.end_s - rest.knot_interval_s)
    nothing_around = dataclasses.replace(
        problem,
        workspace=Workspace(place_m - 1.0, place_m + 1.0),
        obstacles=ObstacleField.of([]),
        fence_polygon_m=None,
        start=Motion.at_rest(place_m),
        duration_s=stand.duration_s,
    )
    return gate.prove(stand, nothing_around)


def _unit_path(problem: Problem, rest) -> np.ndarray:  # noqa: ANN001
    moments = np.linspace(rest.start_s, rest.end_s, 200)
    return problem.workspace.unit_from_enu(rest.sample(moments).position_m)[None]


def _planned_anew(flight: FlightFolder, left: Unfinished) -> Planned:
    keep_compiled()
    began_s = time.monotonic()
    rest = left.trajectory
    here = Motion.at_rest(rest.motion_at(left.from_s).position_m)
    problem = dataclasses.replace(flight.problem, start=here, duration_s=left.remaining_s)
    # Replans subtract what was flown by themselves, from the length of the whole exploration.
    shorter = with_length_left(problem, left.flown_m)
    if shorter is None:
        raise ValueError(
            f"the rest of the course is blocked, and planner.max_length_m = {problem.max_length_m:g} m is flown already"
        )
    known = after(shorter, left.flown_m, flight.options.modes, left.flown_yaw_rad)
    deadline_s = began_s + flight.mission.planner.time_limit_s
    with CompileTime() as compiling:
        plan = solve(
            known,
            flight.options,
            warm_start=(rest,),
            time_left_s=lambda: deadline_s + compiling.spent_s - time.monotonic(),
        )
    if plan.selected is None:
        raise ValueError(f"the rest of the course is blocked, and there is no other way: {plan.status.value}")
    took_s = time.monotonic() - began_s
    return Planned(flight.mission, problem, flight.options, plan, took_s, took_s)
