"""What telemetry says about what was asked for: done, refused by silence, or somebody else's doing."""

from __future__ import annotations

from mission.phases import STREAMING, Phase, Trigger, expected_modes
from sim_bridge.state import Command, FlightMode, LandedState, VehicleState

MODE_GRACE_S = 3.0
"""The heartbeat shows a mode up to a second late, and a lost one takes another."""


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


def at_altitude(state: VehicleState, ground_up_m: float, height_m: float) -> bool:
    """Whether the climb is done: level at the height, or the autopilot says so by holding (as PX4 does).

    Args:
        state: What the vehicle tells.
        ground_up_m: Height of its take-off place, mission frame.
        height_m: Height above it that was asked for.
    """
    if state.landed is LandedState.ON_GROUND:
        return False
    height = state.position_enu_m[2] - ground_up_m
    near = abs(height - height_m) < min(1.5, 0.25 * height_m)
    return near and (abs(state.velocity_enu_mps[2]) < 0.3 or state.mode is FlightMode.HOLD)


def mode_is_ours(phase: Phase, before: Phase, mode_before: FlightMode, settled: bool, state: VehicleState) -> bool:
    """Whether the mode is one that this flight asked for.

    Args:
        phase: What the flight is doing.
        before: What it did before that.
        mode_before: The mode that was seen when the phase began.
        settled: Whether the phase's own mode was taken long enough ago to be shown.
        state: What the vehicle tells.
    """
    expected = expected_modes(phase)
    if not expected or (phase is Phase.TAKING_OFF and state.landed is LandedState.ON_GROUND):
        return True
    # PX4 ends its take-off by holding.
    climbed = before is Phase.TAKING_OFF and state.mode is FlightMode.HOLD
    if not settled and (climbed or state.mode is mode_before or state.mode in expected_modes(before)):
        return True
    return state.mode in expected


def heard_again(state: VehicleState, told_to_return: bool, may_rejoin: bool) -> Trigger:
    """What to make of a vehicle that was not heard for a while.

    Args:
        state: What it tells now.
        told_to_return: Whether it was told to return meanwhile.
        may_rejoin: Whether the exploration may be taken up once more.
    """
    ours = state.mode is FlightMode.EXTERNAL
    going_home = state.mode in (FlightMode.RETURN, FlightMode.LAND)
    if not state.armed:
        return Trigger.DISARMED
    if going_home and (state.failsafe or told_to_return):
        return Trigger.LINK_BACK_RETURNING
    if ours and not told_to_return:
        return Trigger.LINK_BACK
    if ours or state.failsafe:
        # Held by its failsafe, or still waiting for setpoints that we stopped sending.
        return Trigger.LINK_BACK_HOLDING if may_rejoin else Trigger.LINK_BACK_RETURNING
    return Trigger.PILOT


def taken_over_by(state: VehicleState) -> Trigger:
    """Whose doing a mode is that nobody here asked for."""
    return Trigger.FAILSAFE if state.failsafe else Trigger.PILOT


def counts_as_lost_stream(phase: Phase) -> bool:
    """Whether leaving our mode in a phase means that setpoints were not followed any more."""
    return phase in STREAMING and phase not in (Phase.ENTERING, Phase.TAKING_BACK)
