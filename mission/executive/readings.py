"""What telemetry says about what was asked for: done, refused by silence, or somebody else's doing."""

from __future__ import annotations

import math

from mission.executive.phases import STREAMING, Phase, Trigger, expected_modes
from mission.executive.stay import Stay
from sim_bridge.state import Command, FlightMode, LandedState, VehicleState

_NEAR_M = 1.5
_LEVEL_MPS = 0.3
# Less than what a plan leaves of the greatest speed for catching up.
_STANDS_MPS = 0.5


def obeyed(command: Command, state: VehicleState) -> bool:
    """Whether the vehicle does what the command asks, so that it need not be repeated."""
    match command:
        case Command.ARM:
            return state.armed
        case Command.DISARM:
            return not state.armed
        case Command.TAKE_OFF:
            climbing = state.landed in (LandedState.IN_AIR, LandedState.TAKING_OFF)
            return climbing or state.mode is FlightMode.TAKEOFF
        case Command.FOLLOW_SETPOINTS:
            return state.mode is FlightMode.EXTERNAL
        case Command.HOLD:
            return state.mode is FlightMode.HOLD
        case Command.RETURN:
            return state.mode in (FlightMode.RETURN, FlightMode.LAND)
        case Command.LAND:
            return state.mode is FlightMode.LAND
        case Command.START_MISSION:
            return state.mode in (FlightMode.MISSION, FlightMode.RETURN, FlightMode.LAND)


def stands(state: VehicleState) -> bool:
    """Whether a vehicle in the air has come to rest."""
    return math.hypot(*state.velocity_enu_mps) <= _STANDS_MPS


def unsteered(state: VehicleState) -> bool:
    """Whether nobody steers a flying vehicle: it waits for setpoints or holds, or a failsafe brings it down.

    Whoever chose any other mode wants something of it, a return without a failsafe too.
    """
    brought_down = state.failsafe and state.mode in (FlightMode.RETURN, FlightMode.LAND)
    return brought_down or state.mode in (FlightMode.EXTERNAL, FlightMode.HOLD)


def at_altitude(state: VehicleState, mode_before: FlightMode, ground_up_m: float, height_m: float) -> bool:
    """Whether the climb is done: level at the height, or the autopilot says so by holding (as PX4 does).

    Any other change of the mode is somebody else's, however high the vehicle is by then.

    Args:
        state: What the vehicle tells.
        mode_before: The mode before the one it is in.
        ground_up_m: Height of its take-off place, mission frame.
        height_m: Height above it that was asked for.
    """
    if state.landed is LandedState.ON_GROUND:
        return False
    height = state.position_enu_m[2] - ground_up_m
    near = abs(height - height_m) < min(_NEAR_M, 0.25 * height_m)
    level = abs(state.velocity_enu_mps[2]) < _LEVEL_MPS
    match state.mode:
        case FlightMode.TAKEOFF | FlightMode.EXTERNAL:
            return near and level
        case FlightMode.HOLD:
            return near and mode_before is FlightMode.TAKEOFF
        case _:
            return False


def motors(stay: Stay, state: VehicleState, now_s: float) -> Trigger | None:
    """What the motors say: armed as asked, or disarmed; None: nothing new.

    Args:
        stay: What the flight is doing.
        state: What the vehicle tells.
        now_s: Flight clock.
    """
    if stay.phase is Phase.ARMING and state.armed:
        return Trigger.ARMED
    if not state.armed and (stay.settled(now_s) or stay.phase is not Phase.TAKING_OFF):
        return Trigger.DISARMED
    return None


def mode_is_ours(stay: Stay, settled: bool, state: VehicleState) -> bool:
    """Whether the mode is one that this flight asked for.

    Args:
        stay: What the flight is doing.
        settled: Whether the phase's own mode was taken long enough ago to be shown.
        state: What the vehicle tells.
    """
    expected = expected_modes(stay.phase)
    if not expected or (stay.phase is Phase.TAKING_OFF and state.landed is LandedState.ON_GROUND):
        return True
    # PX4 ends its take-off by holding, which may show only when the phase after it was left for the way home already.
    # Copter climbs in Guided and stays in it: there holding is a pilot's.
    before_holding = (Phase.TAKING_OFF, Phase.ENTERING) if stay.phase is Phase.TAKING_BACK else (Phase.TAKING_OFF,)
    climbs_by_itself = stay.mode_before is not FlightMode.EXTERNAL
    climbed = climbs_by_itself and stay.before in before_holding and state.mode is FlightMode.HOLD
    if not settled and (climbed or state.mode is stay.mode_before or state.mode in expected_modes(stay.before)):
        return True
    return state.mode in expected


def taken_over_by(state: VehicleState) -> Trigger:
    """Whose doing a mode is that nobody here asked for."""
    return Trigger.FAILSAFE if state.failsafe else Trigger.PILOT


def counts_as_lost_stream(phase: Phase) -> bool:
    """Whether leaving our mode in a phase means that setpoints were not followed any more."""
    return phase in STREAMING and phase not in (Phase.ENTERING, Phase.TAKING_BACK)
