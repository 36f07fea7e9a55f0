"""The vehicle's own parameters against the mission: what must be set before it may fly, and how fast it may.

A parameter that decides what the vehicle does when it is left alone must be known: one that is not told is a reason not
to fly. docs/flying.md gives each of them with its reason.
"""

from __future__ import annotations

import dataclasses
import math

from mission.flying import left_alone, return_settings
from mission.flying.parameters import Needed, Parameter
from planner import gate
from planner.gate import RELATIVE_TOLERANCE, ProvenTrajectory
from planner.gate_report import GateReport
from planner.problem import Limits, Problem
from sim_bridge.dialects import Autopilot
from sim_bridge.link.commands import OWN_SYSTEM

# Bits of Copter's FENCE_TYPE.
_FENCE_ALTITUDE, _FENCE_CIRCLE, _FENCE_POLYGON = 1, 2, 4


@dataclasses.dataclass(frozen=True)
class Reach:
    """How far from home the vehicle may get, and how high it must be to return over everything.

    Attributes:
        across_m: Horizontally.
        up_m: Upwards.
        clear_up_m: Height above home from which on nothing is in the way; zero: nothing is.
    """

    across_m: float
    up_m: float
    clear_up_m: float


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


def settings_of(autopilot: Autopilot, parameter: Parameter, wanted: Limits, reach: Reach) -> Settings:
    """The parameters of either autopilot against the mission."""
    match autopilot:
        case Autopilot.PX4:
            return px4_settings(parameter, wanted, reach)
        case Autopilot.ARDUPILOT:
            return copter_settings(parameter, wanted, reach)


def px4_settings(parameter: Parameter, wanted: Limits, reach: Reach) -> Settings:
    """PX4's parameters against the mission."""
    known = Needed(parameter)
    problems, notes = known.unknown, []
    problems += known.unsafe(left_alone.SETPOINTS_END, left_alone.PX4_FENCE, left_alone.PX4_GROUND_STATION)
    loss_s = known("COM_OF_LOSS_T")
    if loss_s is not None and not 0.5 <= loss_s <= 5.0:
        problems.append(
            f"COM_OF_LOSS_T is {loss_s:g} s: {'a short gap' if loss_s < 0.5 else 'a lost computer'} "
            f"{'ends the flight' if loss_s < 0.5 else 'is noticed too late'}; set it to 1"
        )
    for name, needed_m in (("GF_MAX_HOR_DIST", reach.across_m), ("GF_MAX_VER_DIST", reach.up_m)):
        most_m = parameter(name)
        if most_m and most_m < needed_m:
            problems.append(_too_narrow(name, f"{most_m:g} m", needed_m, f"{math.ceil(needed_m)}, or 0"))
    if (low_battery := parameter("COM_LOW_BAT_ACT")) is not None and int(low_battery) == 0:
        notes.append(_battery_note("COM_LOW_BAT_ACT", "3 (return when critical, land in an emergency)"))
    if (return_m := parameter("RTL_RETURN_ALT")) is not None and return_m < reach.clear_up_m:
        notes.append(_return_note("RTL_RETURN_ALT", return_m, reach, f"{math.ceil(reach.clear_up_m)}"))
    if stays_up := return_settings.px4_stays_up(parameter):
        notes.append(stays_up)
    limits = _smaller(
        wanted,
        parameter("MPC_XY_VEL_MAX"),
        parameter("MPC_Z_VEL_MAX_UP"),
        parameter("MPC_Z_VEL_MAX_DN"),
        parameter("MPC_ACC_HOR_MAX") or parameter("MPC_ACC_HOR"),
        notes,
    )
    return Settings(limits, tuple(problems), tuple(notes))


def copter_settings(parameter: Parameter, wanted: Limits, reach: Reach) -> Settings:
    """ArduPilot Copter's parameters against the mission."""
    known = Needed(parameter)
    problems, notes = known.unknown, []
    enabled = known("FENCE_ENABLE")
    if enabled is not None and int(enabled) == 0:
        problems.append("FENCE_ENABLE is 0: the vehicle does not watch its fence; set it to 1")
    problems += known.unsafe(left_alone.COPTER_FENCE, left_alone.COPTER_GROUND_STATION)
    problems += [one for action in left_alone.COPTER_BATTERY if (one := action.problem(parameter(action.name)))]
    kinds = parameter("FENCE_TYPE")
    if kinds is not None:
        problems += _copter_fence(int(kinds), parameter, reach)
    watched = known("SYSID_MYGCS")
    if watched is not None and int(watched) != OWN_SYSTEM:
        problems.append(
            f"SYSID_MYGCS is {int(watched)} and this program is {OWN_SYSTEM}: if this computer is lost, the vehicle "
            "does not notice; set it to that"
        )
    if (low_battery := parameter("BATT_FS_LOW_ACT")) is not None and int(low_battery) == 0:
        notes.append(_battery_note("BATT_FS_LOW_ACT", "2 (return)"))
    return_cm = parameter("RTL_ALT")
    # Zero: it returns at the height it has.
    if return_cm and return_cm < 100.0 * reach.clear_up_m:
        notes.append(_return_note("RTL_ALT", return_cm / 100.0, reach, f"{100 * math.ceil(reach.clear_up_m)}"))
    if stays_up := return_settings.copter_stays_up(parameter):
        notes.append(stays_up)
    metres = [
        None if value is None else value / 100.0
        for value in map(parameter, ("WPNAV_SPEED", "WPNAV_SPEED_UP", "WPNAV_SPEED_DN", "WPNAV_ACCEL"))
    ]
    limits = _smaller(wanted, metres[0], metres[1], metres[2], metres[3], notes)
    return Settings(limits, tuple(problems), tuple(notes))


def slowing_factor(flown: GateReport, allowed: Limits) -> float:
    """How many times slower a curve must be flown to keep to the allowed limits, by what was measured of it.

    What it was planned with says less: one that was slowed down before, and is resumed, is slow enough.
    """
    factor = max(
        1.0,
        flown.max_speed_mps / allowed.max_speed_mps,
        flown.max_climb_mps / allowed.max_climb_mps,
        flown.max_descent_mps / allowed.max_descent_mps,
        math.sqrt(flown.max_acceleration_mps2 / allowed.max_acceleration_mps2),
    )
    return 1.0 if factor <= 1.0 + RELATIVE_TOLERANCE else factor


def slowed_down(exploration: ProvenTrajectory, planned: Problem, allowed: Limits) -> tuple[ProvenTrajectory, Problem]:
    """A curve as slow as the vehicle can fly it, proven anew, and the problem that it solves then.

    Args:
        exploration: The curve as it was planned.
        planned: What is known, with the planned limits.
        allowed: The smaller of the planned limits and the vehicle's.

    Raises:
        GateRefused: Flown slower it breaks a condition, or what was learned since is in its way.
    """
    if allowed == planned.limits:
        return exploration, planned
    factor = slowing_factor(exploration.report, allowed)
    if factor == 1.0:
        return exploration, dataclasses.replace(planned, limits=allowed)
    slower = exploration.slowed(factor)
    problem = dataclasses.replace(
        planned, limits=allowed, duration_s=planned.duration_s * factor, start=slower.motion_at(slower.start_s)
    )
    return gate.prove(slower, problem), problem


def _copter_fence(kinds: int, parameter: Parameter, reach: Reach) -> list[str]:
    found = []
    if not kinds & _FENCE_POLYGON:
        found.append(f"FENCE_TYPE is {kinds}: the uploaded polygon is not watched; set it to {kinds | _FENCE_POLYGON}")
    for kind, name, needed_m in (
        (_FENCE_CIRCLE, "FENCE_RADIUS", reach.across_m),
        (_FENCE_ALTITUDE, "FENCE_ALT_MAX", reach.up_m),
    ):
        most_m = parameter(name)
        if kinds & kind and most_m is not None and most_m < needed_m:
            remedy = f"{math.ceil(needed_m)}, or FENCE_TYPE to {kinds & ~kind}"
            found.append(_too_narrow(name, f"{most_m:g} m", needed_m, remedy))
    return found


def _too_narrow(name: str, value: str, needed_m: float, remedy: str) -> str:
    return f"{name} is {value} and the mission reaches {needed_m:.0f} m from home: set it to {remedy}"


def _battery_note(name: str, remedy: str) -> str:
    return (
        f"{name} is 0: if this computer is lost, nothing brings the vehicle home on a low battery; set it to {remedy}"
    )


def _return_note(name: str, return_m: float, reach: Reach, remedy: str) -> str:
    return (
        f"{name} makes the vehicle's own return cross at {return_m:g} m above home, and obstacles reach "
        f"{reach.clear_up_m:.0f} m: set it to {remedy}"
    )


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
