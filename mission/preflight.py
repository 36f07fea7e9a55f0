"""What must hold before the motors are armed: the vehicle's own settings, its place, its charge, the ways.

Every refusal names what was found, why it is not safe, and what to change. A vehicle that is slower than the mission is
not refused: the plan is slowed down to what it can do.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from mission.monitors import Energy
from planner.problem import Limits, Problem
from sim_bridge.link_autopilot import Autopilot
from sim_bridge.state import Vector, VehicleState

Parameter = Callable[[str], float | None]
"""Reads one of the vehicle's parameters; None: it has none of that name."""

FARTHEST_HOME_M = 100.0
"""A vehicle farther than this from where the mission takes off is at another place, or the mission is."""

_LOSS_ACTIONS = {
    0: "switches to POSCTL, which without a transmitter descends slowly to the ground wherever it is",
    1: "switches to ALTCTL, which without a transmitter drifts with the wind",
    2: "switches to MANUAL, which without a transmitter falls",
    6: "stops the motors in the air",
    7: "stops the motors in the air",
}


@dataclasses.dataclass(frozen=True)
class Settings:
    """What the vehicle's own parameters say.

    Attributes:
        limits: The smaller of the mission's and the vehicle's limits.
        problems: What forbids the flight.
        notes: What is worth saying.
    """

    limits: Limits
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def px4_settings(parameter: Parameter, wanted: Limits) -> Settings:
    """PX4's parameters against the mission."""
    problems, notes = [], []
    loss_action = parameter("COM_OBL_RC_ACT")
    if loss_action is not None and (consequence := _LOSS_ACTIONS.get(int(loss_action))):
        problems.append(
            f"COM_OBL_RC_ACT is {int(loss_action)}: when setpoints stop, the vehicle {consequence}; "
            "set it to 5 (hold), 3 (return) or 4 (land)"
        )
    loss_s = parameter("COM_OF_LOSS_T")
    if loss_s is not None and not 0.5 <= loss_s <= 5.0:
        problems.append(
            f"COM_OF_LOSS_T is {loss_s:g} s: {'a short gap' if loss_s < 0.5 else 'a lost computer'} "
            f"{'ends the flight' if loss_s < 0.5 else 'is noticed too late'}; set it to 1"
        )
    if (fence_action := parameter("GF_ACTION")) is not None and int(fence_action) == 0:
        problems.append("GF_ACTION is 0: leaving the fence has no consequence; set it to 2 (hold) or 3 (return)")
    limits = _smaller(
        wanted,
        parameter("MPC_XY_VEL_MAX"),
        parameter("MPC_Z_VEL_MAX_UP"),
        parameter("MPC_Z_VEL_MAX_DN"),
        parameter("MPC_ACC_HOR_MAX") or parameter("MPC_ACC_HOR"),
        notes,
    )
    return Settings(limits, tuple(problems), tuple(notes))


def copter_settings(parameter: Parameter, wanted: Limits) -> Settings:
    """ArduPilot Copter's parameters against the mission."""
    problems, notes = [], []
    if (fence := parameter("FENCE_ENABLE")) is not None and int(fence) == 0:
        notes.append("FENCE_ENABLE is 0: the vehicle does not watch its fence itself; set it to 1")
    if (action := parameter("FENCE_ACTION")) is not None and int(action) == 0 and fence:
        problems.append("FENCE_ACTION is 0: leaving the fence has no consequence; set it to 1 (return or land)")
    if (ground_station := parameter("FS_GCS_ENABLE")) is not None and int(ground_station) == 0:
        notes.append("FS_GCS_ENABLE is 0: without this computer it would hold its place for ever; set it to 1 (return)")
    metres = [
        None if value is None else value / 100.0
        for value in map(parameter, ("WPNAV_SPEED", "WPNAV_SPEED_UP", "WPNAV_SPEED_DN", "WPNAV_ACCEL"))
    ]
    limits = _smaller(wanted, metres[0], metres[1], metres[2], metres[3], notes)
    return Settings(limits, tuple(problems), tuple(notes))


def settings_of(autopilot: Autopilot, parameter: Parameter, wanted: Limits) -> Settings:
    """The parameters of either autopilot against the mission."""
    match autopilot:
        case Autopilot.PX4:
            return px4_settings(parameter, wanted)
        case Autopilot.ARDUPILOT:
            return copter_settings(parameter, wanted)


def _smaller(
    wanted: Limits,
    speed_mps: float | None,
    climb_mps: float | None,
    descent_mps: float | None,
    acceleration_mps2: float | None,
    notes: list[str],
) -> Limits:
    found = {
        "max_speed_mps": speed_mps,
        "max_climb_mps": climb_mps,
        "max_descent_mps": descent_mps,
        "max_acceleration_mps2": acceleration_mps2,
    }
    changes = {}
    for name, value in found.items():
        if value is not None and 0.0 < value < getattr(wanted, name):
            changes[name] = float(value)
            notes.append(f"the vehicle allows {name} {value:g}, the mission {getattr(wanted, name):g}: flown slower")
    return dataclasses.replace(wanted, **changes)


def slowing_factor(planned: Limits, allowed: Limits) -> float:
    """How many times slower a curve within the planned limits must be flown to keep to the allowed ones."""
    return max(
        1.0,
        planned.max_speed_mps / allowed.max_speed_mps,
        planned.max_climb_mps / allowed.max_climb_mps,
        planned.max_descent_mps / allowed.max_descent_mps,
        math.sqrt(planned.max_acceleration_mps2 / allowed.max_acceleration_mps2),
    )


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
        heights = up + np.linspace(0.0, takeoff_altitude_m, 200)
        column = np.column_stack([np.full(200, east), np.full(200, north), heights])
        clear = problem.obstacles.distance(column)
        if clear.min() < problem.keep_out_m:
            worst = int(clear.argmin())
            found.append(
                f"the climb passes {clear[worst]:.1f} m from an obstacle at height {heights[worst]:.0f} m, "
                f"{problem.keep_out_m:.1f} m are needed: take off elsewhere"
            )
    return found


def energy_problems(
    state: VehicleState, energy: Energy, way_out_s: float, exploration_s: float, way_home_s: float
) -> list[str]:
    """Whether the charge lasts for the way there, the exploration, the way home and the reserve."""
    if state.battery_fraction is None:
        return []
    needed = (way_out_s + exploration_s + way_home_s) / energy.endurance_s + energy.reserve_fraction
    if needed <= state.battery_fraction:
        return []
    return [
        f"the battery has {state.battery_fraction:.0%}, the flight needs {needed:.0%} ({way_out_s:.0f} s there, "
        f"{exploration_s:.0f} s exploring, {way_home_s:.0f} s home, {energy.reserve_fraction:.0%} in reserve): charge "
        "it, or shorten planner.duration_s"
    ]
