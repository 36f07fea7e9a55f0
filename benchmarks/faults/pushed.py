"""An obstacle pushed into a flight: placed on what is flown next, and held against where the vehicle truly is."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from mission.executive.events import NoWayRound, Operator
from mission.executive.executive import Executive
from mission.executive.phases import ON_COURSE, Phase
from mission.flying.belief import Belief
from mission.mission_file import Mission
from mission.site.solids import solids_in
from planner.obstacles import ObstacleField, Sphere

RADIUS_M = 3.0
_AHEAD_S = np.arange(8.0, 1.0, -0.5)
_BRAKING_M = 8.0
_BESIDE_HOME_M = 12.0
_PAUSED_S = 4.0
_GIVES_UP_S = 3.0
# True places are told from telemetry's by the wander of the estimate.
_TOLERANCE_M = 0.4


@dataclasses.dataclass(frozen=True)
class ObstaclePushed:
    """When an obstacle is pushed.

    Attributes:
        begin_s: When.
        paused: Whether the operator pauses before and resumes afterwards.
    """

    begin_s: float
    paused: bool = False


class Pushed:
    """Pushes one obstacle, and what the flight around the executive does about it; nobody replans round it.

    Args:
        fault: When.
        mission: What is flown.
        belief: What is known.
    """

    def __init__(self, fault: ObstaclePushed, mission: Mission, belief: Belief) -> None:
        self._fault = fault
        self._mission = mission
        self._belief = belief
        self._sphere: Sphere | None = None
        self._left_m = math.inf
        self._held_s: float | None = None
        # What is still to come, with its moment.
        pause_s = _PAUSED_S * fault.paused
        wishes = [(fault.begin_s, Operator.PAUSE), (fault.begin_s + 2.0 * pause_s, Operator.RESUME)]
        self._wishes = wishes if fault.paused else []
        self._push_s = fault.begin_s + pause_s

    def events(self, executive: Executive, now_s: float, flight_s: float) -> Iterator[Operator | NoWayRound]:
        """What is told to the executive now; the obstacle itself is only known from then on."""
        if now_s >= self._push_s and self._sphere is None:
            self._push_s = math.inf
            self._push(executive, flight_s)
        while self._wishes and now_s >= self._wishes[0][0]:
            yield self._wishes.pop(0)[1]
        if not executive.held_by_block:
            self._held_s = None
        elif self._held_s is None:
            self._held_s = now_s
        elif now_s - self._held_s > _GIVES_UP_S:
            yield NoWayRound()

    def judge(self, place_m: Float[np.ndarray, "3"], now_s: float) -> str:
        """What is wrong with where the vehicle truly is; empty: nothing."""
        if self._sphere is None:
            return ""
        clearance_m = self._clearance_m(place_m)
        if clearance_m >= self._left_m - _TOLERANCE_M:
            return ""
        return f"{clearance_m:.1f} m from what was pushed at {now_s:.1f} s"

    def _push(self, executive: Executive, flight_s: float) -> None:
        assert executive.state is not None, "it is pushed into a flight under way"
        here_m, home_m = np.array(executive.state.position_enu_m), np.array(self._mission.home_enu_m)
        course = executive.course if executive.phase in (*ON_COURSE, Phase.HOLDING) else None
        curve, from_s = executive.exploration, executive.exploration.start_s
        if course is not None:
            curve, from_s = course.trajectory, course.at(flight_s).curve_s
        keep_out_m = self._belief.problem.keep_out_m
        for place_m in curve.sample(np.minimum(from_s + _AHEAD_S, curve.end_s)).position_m:
            far = np.linalg.norm(place_m - here_m) > RADIUS_M + keep_out_m + _BRAKING_M
            if far and np.linalg.norm(place_m[:2] - home_m[:2]) > _BESIDE_HOME_M:
                self._sphere = Sphere(place_m, RADIUS_M)
                self._belief.change(obstacles=ObstacleField.of([*solids_in(self._mission), self._sphere]))
                least_m = executive.monitors.least_clearance_m
                self._left_m = min(least_m, self._clearance_m(here_m))
                return

    def _clearance_m(self, place_m: Float[np.ndarray, "3"]) -> float:
        assert self._sphere is not None, "clearance is to what was pushed"
        apart_m = float(np.linalg.norm(place_m - self._sphere.center_m))
        return apart_m - self._sphere.radius_m - self._mission.vehicle.radius_m
