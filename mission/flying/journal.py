"""What a flight left undone, read from its log: where the exploration stopped, and on which proven curve."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from mission.executive.phases import Phase
from mission.flying.belief import INTERVAL_S
from mission.flying.flight_log import FlightLog
from planner.trajectory import Trajectory

_PAUSE_S = 10.0 * INTERVAL_S
_DOWN = tuple(
    phase.value for phase in (Phase.LANDING, Phase.LANDED, Phase.VEHICLE_RETURN, Phase.HANDING_OVER, Phase.HANDED_OVER)
)
FINISHED_S = 0.5
"""Less than this left of the exploration is nothing left."""


@dataclasses.dataclass(frozen=True)
class Unfinished:
    """What is left of an exploration.

    Attributes:
        trajectory: The proven curve that was being flown, from a knot just before the place where it stopped.
        from_s: Curve time at which to go on.
        flown_m: Positions of the exploration, one each `belief.INTERVAL_S`.
        flown_yaw_rad: Headings there.
    """

    trajectory: Trajectory
    from_s: float
    flown_m: Float[np.ndarray, "time 3"]
    flown_yaw_rad: Float[np.ndarray, "time"]

    @property
    def only_home(self) -> bool:
        """Whether the exploration was flown to its end, and the vehicle was on its way home."""
        return self.remaining_s == 0.0

    @property
    def remaining_s(self) -> float:
        """Time left to fly."""
        return self.trajectory.end_s - self.from_s


def unfinished(log: FlightLog) -> Unfinished | None:
    """What a flight left undone.

    Args:
        log: Its log, over all the times it was resumed.

    Returns:
        What is left, which may be the way home alone; None: nothing.

    Raises:
        ValueError: The log holds no curve.
    """
    if not log.courses:
        raise ValueError("the flight's log holds no course: it ended before there was a plan; fly the mission anew")
    explored_s = explored_until_s(log)
    trajectory = course_at(log, explored_s)
    explored = trajectory.end_s - explored_s <= FINISHED_S
    if explored and not on_its_way_home(log):
        return None
    if explored:
        explored_s = trajectory.end_s
    first = int(np.clip((explored_s - trajectory.start_s) // trajectory.knot_interval_s, 0, trajectory.segments - 1))
    return Unfinished(trajectory.from_knot(first), explored_s, explored_positions(log), explored_headings(log))


def on_its_way_home(log: FlightLog) -> bool:
    """Whether a flight that explored everything ended before its vehicle was down, or on its way down by itself."""
    phases = log.of_kind("phase")
    return bool(phases) and phases[-1]["phase"] not in _DOWN


def explored_until_s(log: FlightLog) -> float:
    """Curve time up to which the exploration was flown: what progress told, and setpoints that went out after it."""
    progress = log.of_kind("progress")
    told_s = max((event["explored_s"] for event in progress), default=log.courses[0][1].start_s)
    last_told_s = progress[-1]["t"] if progress else 0.0
    exploring = log.exploring()
    if exploring.any() and len(log.setpoint_s):
        until_s = float(log.time_s[exploring][-1])
        later = (log.setpoint_s > last_told_s) & (log.setpoint_s <= until_s)
        if later.any():
            told_s = max(told_s, float(log.setpoint_curve_s[later].max()))
    return told_s


def course_at(log: FlightLog, curve_s: float) -> Trajectory:
    """The newest curve that had begun by a curve time, or the first."""
    begun = [trajectory for _, trajectory in log.courses if trajectory.start_s <= curve_s]
    return begun[-1] if begun else log.courses[0][1]


def explored_positions(log: FlightLog) -> Float[np.ndarray, "time 3"]:
    """Where the exploration was flown, one position each `belief.INTERVAL_S`; pauses between flights count nothing."""
    return _each_interval(log, log.position_m)


def explored_headings(log: FlightLog) -> Float[np.ndarray, "time"]:
    """The heading at each of those positions."""
    return _each_interval(log, log.yaw_rad)


def _each_interval(log: FlightLog, told: Float[np.ndarray, "time *axis"]) -> Float[np.ndarray, "tick *axis"]:
    """What telemetry told during the exploration, once for each `belief.INTERVAL_S` of it."""
    exploring = log.exploring()
    time_s, told = log.time_s[exploring], told[exploring]
    if not len(time_s):
        return told
    step_s = np.diff(time_s, prepend=time_s[0])
    step_s[step_s > _PAUSE_S] = INTERVAL_S
    ticks = np.floor(np.cumsum(step_s) / INTERVAL_S).astype(int)
    return np.repeat(told, np.diff(ticks, prepend=0), axis=0)
