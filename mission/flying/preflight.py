"""What must hold before the motors are armed: the vehicle's place, its charge, room on the disk.

Every refusal names what was found, why it is not safe, and what to change; the vehicle's parameters are
`mission.flying.vehicle_settings`. A vehicle that is slower than the mission is not refused: the plan is slowed down.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mission.executive.energy import STALE_CHARGE_S, Energy, places_ahead
from mission.executive.events import FlightEnd
from mission.flying.vehicle_settings import Reach
from mission.site.column import nearest_in_column
from mission.site.fence import Corner
from planner.polygon import KeepIn
from planner.problem import Problem
from planner.trajectory import Trajectory
from sim_bridge.state import Vector, VehicleState

FARTHEST_HOME_M = 100.0
"""A vehicle farther than this from where the mission takes off is at another place, or the mission is."""

LEAST_DISK_BYTES = 100_000_000
"""A log grows by some 10 kB a second; recordings and pictures come on top of it."""

_HIGHEST_M = 500.0
_SKYLINE_STEP_M = 2.0
_SKYLINE_PLACES = 40


def reach_of(problem: Problem, fence_m: Sequence[Corner], home_m: Vector) -> Reach:
    """How far from home a mission reaches.

    Args:
        problem: What is planned in.
        fence_m: Corners of the area that paths stay in.
        home_m: Where the vehicle takes off.
    """
    corners = np.asarray(fence_m)
    low, high = corners.min(axis=0), corners.max(axis=0)
    east, north = np.meshgrid(*(np.linspace(low[axis], high[axis], _SKYLINE_PLACES) for axis in (0, 1)))
    ground = np.column_stack([east.ravel(), north.ravel()])
    ceiling_up_m = float(problem.workspace.box_max_m[2]) - home_m[2]
    clear_up_m = 0.0
    solid = problem.obstacles.below_lids
    for height in np.arange(_SKYLINE_STEP_M, _HIGHEST_M, _SKYLINE_STEP_M):
        level = np.column_stack([ground, np.full(len(ground), home_m[2] + height)])
        if np.asarray(solid.distance(level)).min() < problem.keep_out_m:
            clear_up_m = float(height) + _SKYLINE_STEP_M
    return Reach(float(np.linalg.norm(corners - np.asarray(home_m[:2]), axis=1).max()), ceiling_up_m, clear_up_m)


def disk_problems(folder: Path) -> list[str]:
    """Whether there is room for what a flight writes."""
    free = shutil.disk_usage(folder).free
    if free >= LEAST_DISK_BYTES:
        return []
    return [
        f"{folder} has {free / 1e6:.0f} MB free, a flight needs {LEAST_DISK_BYTES / 1e6:.0f}: make room, or give "
        "another folder"
    ]


def fence_problems(state: VehicleState, fence_m: Sequence[Corner]) -> list[str]:
    """Whether the vehicle stands inside the fence it is given: one that does not hold its home is not enforced."""
    inside_m = float(KeepIn.of(np.asarray(fence_m)).distance(np.array([state.position_enu_m[:2]]))[0])
    if inside_m >= 0.0:
        return []
    return [
        f"the vehicle stands {-inside_m:.0f} m outside the fence, which does not hold its home then: move it, or make "
        "site.fence_margin_m larger"
    ]


def place_problems(state: VehicleState, home_m: Vector, problem: Problem, takeoff_altitude_m: float) -> list[str]:
    """Whether the vehicle stands where the mission takes off, with a clear climb above it."""
    found = []
    away_m = math.dist(state.position_enu_m[:2], home_m[:2])
    if away_m > FARTHEST_HOME_M:
        found.append(
            f"the vehicle stands {away_m:.0f} m from the mission's home: move it, or set site.origin or "
            "site.home_enu_m to where it stands"
        )
    if abs(state.position_enu_m[2] - home_m[2]) > FARTHEST_HOME_M:
        found.append(
            f"the vehicle's altitude is {state.position_enu_m[2] - home_m[2]:+.0f} m from the mission's home: set "
            "site.origin.altitude_amsl_m to the ground's"
        )
    if not found:
        east, north, up = state.position_enu_m
        nearest = nearest_in_column(problem.obstacles, (east, north), up, up + takeoff_altitude_m)
        if nearest.distance_m < problem.keep_out_m:
            found.append(
                f"the climb passes {nearest.distance_m:.1f} m from an obstacle at height {nearest.up_m:.0f} m, "
                f"{problem.keep_out_m:.1f} m are needed: take off elsewhere"
            )
    return found


def landing_problems(exploration: Trajectory, end: FlightEnd, home_m: Vector, problem: Problem) -> str:
    """What stands below the end of a path that is landed at; empty: nothing, or it does not land there.

    Args:
        exploration: The path.
        end: What happens at its end.
        home_m: Where the vehicle takes off.
        problem: What is planned in.
    """
    if end is not FlightEnd.LAND:
        return ""
    east, north, up = exploration.motion_at(exploration.end_s).position_m.tolist()
    nearest = nearest_in_column(problem.obstacles, (east, north), home_m[2] + problem.keep_out_m, up)
    if nearest.distance_m >= problem.keep_out_m:
        return ""
    return (
        f"the landing at the end of the path passes {max(nearest.distance_m, 0.0):.1f} m from an obstacle at height "
        f"{nearest.up_m:.0f} m, {problem.keep_out_m:.1f} m are needed"
    )


def energy_problems(
    state: VehicleState, energy: Energy, way_out_s: float, exploration_s: float, way_home_s: float
) -> list[str]:
    """Whether the charge is known, and lasts for the way there, the exploration, the way home and the reserve."""
    if state.battery_fraction is None or state.battery_age_s > STALE_CHARGE_S:
        never = state.battery_fraction is None
        return [
            "the vehicle "
            + ("does not tell its charge" if never else f"last told its charge {state.battery_age_s:.0f} s ago")
            + ": without it nothing calls it home in time; set up its battery monitor (PX4: BAT1_SOURCE, BAT1_N_CELLS, "
            "BAT1_CAPACITY; Copter: BATT_MONITOR, BATT_CAPACITY)"
        ]
    needed = energy.needed_fraction(way_out_s + exploration_s + way_home_s, 0.0, 1.0 / energy.endurance_s)
    if needed <= state.battery_fraction:
        return []
    return [
        f"the battery has {state.battery_fraction:.0%}, the flight needs {needed:.0%} ({way_out_s:.0f} s there, "
        f"{exploration_s:.0f} s exploring, {way_home_s:.0f} s home, {energy.reserve_fraction:.0%} in reserve): charge "
        "it, or shorten planner.duration_s"
    ]


def own_return_problems(
    charge_fraction: float, energy: Energy, way_out_s: float, exploration: Trajectory, from_s: float, home_m: Vector
) -> list[str]:
    """Whether the charge lasts, all along a path, for a vehicle that is left alone there and returns by itself.

    Args:
        charge_fraction: What there is now.
        energy: What flying costs.
        way_out_s: From the ground to where the exploration begins.
        exploration: The path.
        from_s: Curve time at which it is begun.
        home_m: Where the vehicle lands.
    """
    if energy.own_return is None:
        return []
    ahead = (
        (until_s, energy.alone_s(place_m, home_m)) for until_s, place_m in places_ahead(exploration, from_s, way_out_s)
    )
    flown_s, alone_s = max(ahead, key=sum)
    needed = energy.needed_fraction(0.0, flown_s + alone_s, 1.0 / energy.endurance_s)
    if needed <= charge_fraction:
        return []
    return [
        f"the battery has {charge_fraction:.0%}, and a vehicle that is left alone {flown_s:.0f} s after its "
        f"take-off needs {needed:.0%} of it: its own return takes {alone_s:.0f} s from there, with "
        f"{energy.own_return.named} as they are. Make it faster, charge it, or shorten planner.duration_s"
    ]
