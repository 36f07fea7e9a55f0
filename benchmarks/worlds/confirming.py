"""A curve that the gate passed, shown to the checker that shares no code with the planner."""

from __future__ import annotations

import dataclasses

import numpy as np

from benchmarks.worlds.drawn import ORIGIN, World
from planner.trajectory import Trajectory
from planner.yaw import headings
from tests.planner.independent_checker import Confirmed, check

MOST_POINTS = 30_000
SAMPLES_A_KNOT = 10


def confirmed(world: World, curve: Trajectory) -> Confirmed:
    """What the independent checker finds, looking about `MOST_POINTS` times."""
    problem = world.problem
    samples = curve.sampled_every(curve.knot_interval_s / SAMPLES_A_KNOT)
    limits = dataclasses.asdict(problem.limits)
    box = {"box_min_enu_m": problem.workspace.box_min_m.tolist(), "box_max_enu_m": problem.workspace.box_max_m.tolist()}
    fence = None if problem.fence_polygon_m is None else problem.fence_polygon_m.tolist()
    end = problem.end_position_m
    plan = {
        "origin": ORIGIN,
        "trajectory": {
            "time_s": samples.time_s,
            "position_enu_m": samples.position_m,
            "velocity_enu_mps": samples.velocity_mps,
            "acceleration_enu_mps2": samples.acceleration_mps2,
            "yaw_enu_rad": headings(samples.time_s, samples.velocity_mps, problem.limits.max_yaw_rate_radps),
        },
        "limits": {
            **limits,
            **box,
            "clearance_margin_m": problem.clearance_margin_m,
            "vehicle_radius_m": problem.vehicle_radius_m,
            "fence_polygon_enu_m": fence,
        },
        "problem": {
            "mission": {
                "site": {**box, "polygon_enu_m": fence},
                "obstacle": world.entries,
                "vehicle": {**limits, "radius_m": problem.vehicle_radius_m},
                "flight": {"clearance_margin_m": problem.clearance_margin_m},
                "planner": {
                    "start_enu_m": problem.start.position_m.tolist(),
                    "end_enu_m": None if end is None else end.tolist(),
                    "duration_s": problem.duration_s,
                },
            }
        },
    }
    return check(plan, times_finer=int(np.clip(MOST_POINTS // len(samples.time_s), 4, 20)))
