"""One stay in a phase of the flight: since when, where from, and how long it may last."""

from __future__ import annotations

import dataclasses

from mission.executive.course import Course
from mission.executive.events import Assignment
from mission.executive.phases import Phase
from planner.trajectory import Trajectory
from sim_bridge.state import FlightMode

MODE_GRACE_S = 3.0
"""The heartbeat shows a mode up to a second late, and a lost one takes another."""

_LIMIT_S: dict[Phase, float] = {
    Phase.CONNECTING: 60.0,
    Phase.CHECKING: 180.0,
    Phase.CHECKING_ALOFT: 180.0,
    Phase.ARMING: 60.0,
    Phase.DISARMING: 30.0,
    Phase.ENTERING: 60.0,
    Phase.TAKING_BACK: 60.0,
    Phase.HOLDING: 1800.0,
    Phase.BLIND: 300.0,
    Phase.TURNING_BACK: 60.0,
    Phase.VEHICLE_RETURN: 900.0,
    Phase.RETURN_PAUSED: 300.0,
    Phase.HANDING_OVER: 30.0,
}


@dataclasses.dataclass(frozen=True)
class Stay:
    """One stay in a phase.

    Attributes:
        phase: What the flight is doing.
        since_s: Flight clock when that began.
        before: What it did before.
        mode_before: The mode the vehicle showed when it began.
    """

    phase: Phase
    since_s: float
    before: Phase = Phase.CONNECTING
    mode_before: FlightMode = FlightMode.OTHER

    def lasted_s(self, now_s: float) -> float:
        """How long it has lasted, flight seconds."""
        return now_s - self.since_s

    def settled(self, now_s: float) -> bool:
        """Whether it has lasted long enough for telemetry to show it."""
        return self.lasted_s(now_s) > MODE_GRACE_S


def limit_s(
    phase: Phase,
    assignment: Assignment,
    exploration: Trajectory,
    course: Course | None,
    patience: float,
    rate: float = 1.0,
) -> float:
    """How long a stay in a phase may last, flight seconds.

    Args:
        phase: What the flight is doing.
        assignment: What it is to do.
        exploration: The curve it explores on.
        course: What it follows; None: nothing.
        patience: Flight seconds a host second, for what takes the host's time.
        rate: Curve seconds a second that are flown, at least.
    """
    match phase:
        case Phase.TAKING_OFF:
            return 3.0 * assignment.takeoff_altitude_m / assignment.max_climb_mps + 60.0
        case Phase.TRANSIT | Phase.RETURNING | Phase.FOLLOWING if course is not None:
            return (2.0 * course.trajectory.duration_s + exploration.end_s) / rate + 60.0
        case Phase.AUTO_MISSION:
            return 3.0 * exploration.duration_s + 300.0
        case Phase.WAITING_READY:
            return assignment.ready_timeout_s * patience
        case Phase.CONNECTING | Phase.CHECKING | Phase.CHECKING_ALOFT | Phase.DISARMING:
            return _LIMIT_S[phase] * patience
        case _:
            return _LIMIT_S.get(phase, float("inf"))
