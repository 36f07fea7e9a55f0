"""What is flown: the exploration, the way that is sought, the course made of them, and what blocks it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from mission.executive import readings
from mission.executive.course import Course, vector
from mission.executive.events import Assignment
from planner.gate import ProvenTrajectory
from planner.problem import Limits
from sim_bridge.state import Vector, VehicleState

_BLOCKED_RESERVE_S = 1.0
_CATCH_UP_S = 1.0
# Each time a vehicle has not kept to its course less is asked of it, down to where drag and lag hardly matter.
_SLOWER = 0.7
_SLOWEST = 0.35
_SAME_PLACE_M = 1e-3
# Within what estimates wander while hovering.
_THERE_M = 0.5
_LOOKING_RAD = 0.1
_LOOK_BACK_S = 2.0
"""A vehicle is that far behind its course at most without anything being wrong, and some more."""


class CourseKeeper:
    """Keeps the course.

    Args:
        assignment: What to fly.
        from_s: Curve time at which the exploration begins, where a part of it was flown before; None: its start.

    Attributes:
        exploration: The proven curve that is explored on, as replans left it.
        course: What setpoints are taken from; None: none are sent.
        way: The proven way that was asked for; None: not found yet.
        rejoin_s: Curve time at which the exploration is taken up.
        explored: Whether it was flown to its end.
        rate: Curve seconds a second that are flown: less than one for a vehicle that does not keep to its course.
        least_rate: The least that were flown: what time and charge are reckoned with.
    """

    def __init__(self, assignment: Assignment, from_s: float | None) -> None:
        self._assignment = assignment
        self.exploration = assignment.exploration
        self.course: Course | None = None
        self.way: ProvenTrajectory | None = None
        self.rejoin_s = assignment.exploration.start_s if from_s is None else from_s
        self.explored = assignment.only_home
        self.rate = self.least_rate = 1.0
        self._rate_in_the_open = 1.0

    def keep_to(self, limits: Limits) -> None:
        """Brake and speed up no harder than a vehicle can that is weaker than thought."""
        weaker_mps2 = min(self._assignment.max_acceleration_mps2, limits.max_acceleration_mps2)
        self._assignment = dataclasses.replace(self._assignment, max_acceleration_mps2=weaker_mps2)

    @property
    def slowed_here(self) -> bool:
        """Whether it is flown more slowly only for what is near."""
        return self.rate < self._rate_in_the_open

    def slow_down(self, share: float | None) -> bool:
        """Fly on more slowly; false: it is as slow as it gets.

        Args:
            share: Of the pace, or less, until `speed_up`; None: somewhat more slowly, for good.
        """
        before, self.rate = self.rate, max(_SLOWEST, min(_SLOWER, share or _SLOWER) * self.rate)
        if share is None:
            self._rate_in_the_open = max(_SLOWEST, _SLOWER * self._rate_in_the_open)
        self.least_rate = min(self.least_rate, self.rate)
        return self.rate < before

    def speed_up(self) -> None:
        """Fly on as fast as in the open."""
        self.rate = self._rate_in_the_open

    def stand(self, state: VehicleState, now_s: float) -> None:
        """Stand where the vehicle is."""
        self.course = Course.standing(state.position_enu_m, now_s, state.yaw_enu_rad)

    def brake(self, now_s: float) -> None:
        """Come to a standstill along the course."""
        if self.course is not None:
            self.course = self.course.braking(now_s)

    def resume(self, now_s: float) -> None:
        """Take up the pace again."""
        if self.course is not None:
            self.course = self.course.resuming(now_s, self.rate)

    def drop(self) -> None:
        """Follow nothing."""
        self.course = None

    def begin_exploration(self, now_s: float) -> None:
        """Begin the exploration where it is taken up, at rest there."""
        self._begin(self.exploration, now_s, self.rejoin_s)

    def begin_way(self, way: ProvenTrajectory, now_s: float) -> None:
        """Begin a way, at rest at its start; it was proven with everything known when it was sought.

        Where it leads to an exploration whose headings are planned, it arrives looking as that begins.
        """
        apart_m = np.abs(way.motion_at(way.end_s).position_m - np.array(self.rejoin_m())).max()
        self._begin(way, now_s, None, self._rejoin_yaw_rad() if apart_m <= _SAME_PLACE_M else None)

    def begin_anew(self, exploration: ProvenTrajectory, now_s: float) -> None:
        """Explore on a curve that begins where the vehicle stands."""
        self.exploration = exploration
        self._begin(exploration, now_s, None)

    def go_over(self, course: Course, exploration: ProvenTrajectory, now_s: float) -> None:
        """Leave a course for another curve at that one's start.

        Raises:
            ValueError: The curves do not meet there.
        """
        self.exploration = exploration
        self.course = course.continued(exploration, now_s)

    def lag_m(self, state: VehicleState, now_s: float) -> float:
        """How far a vehicle is behind the course, or will be before it has the course's speed again."""
        if self.course is None:
            return 0.0
        motion = self.course.at(now_s).motion
        behind_m = np.linalg.norm(motion.position_m - np.asarray(state.position_enu_m))
        slower_mps = np.linalg.norm(motion.velocity_mps - np.asarray(state.velocity_enu_mps))
        return float(behind_m + _CATCH_UP_S * slower_mps)

    def fall_back(self, state: VehicleState, silent_s: float, now_s: float) -> float:
        """Take the course up where a vehicle is on it that heard nothing of it for a while.

        Setpoints that went on without it are far ahead; told of those, it would catch up as fast as its own limits
        allow, which may be faster than the flight's.

        Args:
            state: What the vehicle tells.
            silent_s: How long it was not heard.
            now_s: Flight clock.

        Returns:
            How far the vehicle is from what the course was until now, metres.
        """
        course = self.course
        if course is None:
            return math.inf
        position_m = np.asarray(state.position_enu_m)
        here_s = course.at(now_s).curve_s
        moment_s, apart_m = course.nearest(position_m, here_s - silent_s - _LOOK_BACK_S, here_s)
        self.course = course.taken_up(moment_s, np.asarray(state.velocity_enu_mps), now_s)
        return apart_m

    def leave_exploration(self, now_s: float, heard_s: float | None = None) -> None:
        """Note where the exploration goes on.

        Args:
            now_s: Flight clock: it goes on where braking from here comes to a standstill.
            heard_s: When the vehicle was heard last, where it is not heard any more: it goes on where it was then.
        """
        if self.course is None:
            return
        left_s = self.course.braking(now_s).stop_s() if heard_s is None else self.course.at(heard_s).curve_s
        self.rejoin_s = min(max(left_s, self.exploration.start_s), self.exploration.end_s)

    def rejoin_m(self) -> Vector:
        """Where the exploration is taken up."""
        return vector(self.exploration.motion_at(self.rejoin_s).position_m)

    def begins_here(self, way: ProvenTrajectory) -> bool:
        """Whether a curve begins where the course comes to a standstill."""
        if self.course is None:
            return False
        apart_m = way.motion_at(way.start_s).position_m - np.array(self.course.stop_position())
        return float(np.abs(apart_m).max()) <= _SAME_PLACE_M

    def stands(self, now_s: float) -> bool:
        """Whether the course has come to a standstill."""
        return self.course is not None and self.course.stands(now_s)

    def finished(self, now_s: float) -> bool:
        """Whether the course has come to its end."""
        return self.course is not None and self.course.finished(now_s)

    def waits_for(self, state: VehicleState) -> bool:
        """Whether a vehicle has yet to come to where the course ends, and stand: what begins there begins at rest.

        One that overshoots or is late would be told to run after a course that goes on without it, as fast as its own
        limits allow. Where headings are planned it has to look there, too: a plan may turn as fast as the vehicle can,
        which then never catches up.
        """
        if self.course is None:
            return False
        apart_m = math.dist(state.position_enu_m, self.course.stop_position())
        if apart_m > _THERE_M or not readings.stands(state):
            return True
        if self._rejoin_yaw_rad() is None:
            return False
        return abs(math.remainder(state.yaw_enu_rad - self.course.stop_yaw_rad(), 2.0 * math.pi)) > _LOOKING_RAD

    def over_s(self, now_s: float) -> float:
        """How long ago the course came to its end."""
        return 0.0 if self.course is None else self.course.over_s(now_s)

    def watched_s(self, now_s: float) -> float:
        """Curve time up to which the course must be clear for it to be flown on with at this moment."""
        return -math.inf if self.course is None else self.course.braking(now_s).stop_s() + _BLOCKED_RESERVE_S

    def _rejoin_yaw_rad(self) -> float | None:
        """Where the nose points as the exploration is taken up; None: no headings are planned."""
        planned = self.exploration.headings_at(np.array([self.rejoin_s]))
        return None if planned is None else float(planned[0])

    def _begin(
        self, trajectory: ProvenTrajectory, now_s: float, from_s: float | None, arrives_rad: float | None = None
    ) -> None:
        yaw = self.course.at(now_s).yaw_rad if self.course is not None else 0.0
        limits = self._assignment
        self.course = Course.begin(
            trajectory,
            now_s,
            yaw,
            limits.max_acceleration_mps2,
            limits.max_yaw_rate_radps,
            from_s=from_s,
            rate=self.rate,
            arrives_rad=arrives_rad,
        )
