"""What telemetry is held against: the fence, the obstacles, the course, and the charge that the way home needs.

Everything is measured on where the vehicle says it is, never on where it was told to be.
"""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from mission.executive.course import Course, CoursePoint
from mission.executive.energy import Consumption, Energy, ProvenHome, places_ahead
from planner.trajectory import Trajectory
from sim_bridge.state import Vector, VehicleState

# Of the distance from its path that the plan's clearance allows for, this share is used up without a word.
_KEPT_SHARE = 0.5
# A vehicle strays farther at times than it has shown so far, by this factor.
_WORSE = 1.5
# The path is looked for that far back, as setpoints are ahead of a vehicle with drag, and a little ahead, as they brake
# harder than it does; it is looked along that far on.
_BEHIND_S, _BEFORE_S, _AHEAD_S, _AHEAD_STEP_S = 3.0, 1.0, 20.0, 0.1
# To speed up and to slow down again in time is not worth while for less.
_WORTH_WHILE_S = 35.0


class Alarm(enum.Enum):
    """What telemetry can be wrong about; in the order of their weight."""

    OUTSIDE = "outside the fence"
    BATTERY_LOW = "the charge is what the way home needs"
    TOO_CLOSE = "closer to an obstacle than allowed"
    OFF_TRACK = "too far from the course"


@dataclasses.dataclass(frozen=True)
class Monitors:
    """Limits that hold while flying.

    Attributes:
        clearance_m: Distance from the vehicle's hull to the nearest obstacle, for positions of shape (..., 3).
        least_clearance_m: Below this the flight holds.
        fence_distance_m: Signed distance to the fence, positive inside, for a position of shape (3,).
        fence_tolerance_m: How far outside is not yet an alarm: estimates wander.
        max_track_error_m: Distance from the course above which the flight holds.
        track_margin_m: Distance from the course that the plan's clearance allows for.
        energy: What flying costs.
        cruise_height_m: Height above home from which it lands.
    """

    clearance_m: Callable[[Float[np.ndarray, "*batch 3"]], Float[np.ndarray, "*batch"]]
    least_clearance_m: float
    fence_distance_m: Callable[[Float[np.ndarray, "3"]], float]
    fence_tolerance_m: float
    max_track_error_m: float
    track_margin_m: float
    energy: Energy
    cruise_height_m: float

    def alarms(
        self,
        state: VehicleState,
        home_m: Vector | None,
        consumption: Consumption | None,
        point: CoursePoint | None,
        rate: float = 1.0,
        proven: ProvenHome | None = None,
    ) -> tuple[Alarm, ...]:
        """What is wrong, the weightiest first.

        Args:
            state: What the vehicle tells.
            home_m: Where it would land; None: unknown.
            consumption: How much is left, and how fast it falls; None: never told, which is as bad as too little.
            point: Where the course is at the state's moment; None: no course is followed.
            rate: Share of its speeds at which it is flown home.
            proven: The proven way home; None: not sought yet.
        """
        position = np.asarray(state.position_enu_m)
        found = []
        if self.fence_distance_m(position) < -self.fence_tolerance_m:
            found.append(Alarm.OUTSIDE)
        if consumption is None or consumption.left_fraction <= self.needed_fraction(
            state.position_enu_m, home_m, consumption, rate, proven
        ):
            found.append(Alarm.BATTERY_LOW)
        if self.clearance_m(position) < self.least_clearance_m:
            found.append(Alarm.TOO_CLOSE)
        if point is not None and float(np.linalg.norm(position - point.motion.position_m)) > self.max_track_error_m:
            found.append(Alarm.OFF_TRACK)
        return tuple(found)

    def needed_fraction(
        self,
        position_m: Vector,
        home_m: Vector | None,
        consumption: Consumption,
        rate: float = 1.0,
        proven: ProvenHome | None = None,
    ) -> float:
        """Charge that must be left at a place; less than that, and the flight turns back.

        Args:
            position_m: The place.
            home_m: Where it would land; None: unknown, so that only the reserve is.
            consumption: How fast the charge falls.
            rate: Share of its speeds at which it is flown home.
            proven: The proven way home; None: not sought yet.
        """
        energy, home_s, alone_s = self.energy.at_pace(rate), 0.0, 0.0
        if home_m is not None:
            home_s = energy.way_home_s(position_m, home_m, self.cruise_height_m)
            if proven is not None:
                proven_s = proven.left_s(position_m, home_m, self.energy, rate)
                home_s = max(home_s, proven_s + energy.descent.to_ground_s(self.cruise_height_m))
            # This program may be lost on the way.
            alone_s = energy.alone_s(position_m, home_m)
        return energy.needed_fraction(home_s, alone_s, consumption.fraction_per_s)

    def spare_fraction(
        self,
        curve: Trajectory,
        from_s: float,
        begins_in_s: float,
        home_m: Vector | None,
        consumption: Consumption,
        rate: float = 1.0,
    ) -> float:
        """Charge left beyond what must be, where that is least on a curve; negative: it turns back before the end.

        Args:
            curve: What would be flown.
            from_s: Curve time from which on.
            begins_in_s: Time until then.
            home_m: Where it would land; None: unknown.
            consumption: How much is left, and how fast it falls.
            rate: Share of its speeds at which all is flown.
        """
        return min(
            consumption.left_fraction
            - consumption.fraction_per_s * until_s
            - self.needed_fraction(place_m, home_m, consumption, rate)
            for until_s, place_m in places_ahead(curve, from_s, begins_in_s, rate)
        )

    def beside_m(self, state: VehicleState, course: Course, now_s: float) -> float:
        """How far a vehicle is from its path: to be late or early on it counts for nothing.

        Args:
            state: What the vehicle tells.
            course: What it follows.
            now_s: Flight clock at the state's moment.
        """
        here_s = course.at(now_s).curve_s
        return course.nearest(np.asarray(state.position_enu_m), here_s - _BEHIND_S, here_s + _BEFORE_S)[1]

    def manageable_share(self, strays_m: float, course: Course, now_s: float) -> float:
        """What share of its pace a vehicle manages that strays from its path, past what comes next; one: all of it.

        To be behind on a proven path is no danger; to stray from it is one where it leads past something. A vehicle
        is slowed as soon as it has shown that it strays and such a place is in sight, not when it strays there: its
        setpoints take some 2 s to slow down, and what drag and lag have wound up takes another 5 to 10 s to go.
        What it has shown is seldom the worst, which comes in the sharpest turn, and there may be no time to slow it
        down twice: the worst is what the pace is for. The distance is taken to grow in proportion to the pace.

        Args:
            strays_m: How far it has shown to stray at its present pace.
            course: What it follows.
            now_s: Flight clock.
        """
        kept_m = _KEPT_SHARE * self.track_margin_m
        if strays_m <= kept_m:
            return 1.0
        point = course.at(now_s)
        near = not self._is_clear(_WORSE * strays_m, course, point.curve_s, _AHEAD_S * point.rate)
        return kept_m / (_WORSE * strays_m) if near else 1.0

    def passes_nothing(self, strays_m: float, course: Course, now_s: float) -> bool:
        """Whether a vehicle comes near to nothing for so long that it is worth while to fly at full pace.

        Args:
            strays_m: How far it has shown to stray at that pace.
            course: What it follows.
            now_s: Flight clock.
        """
        return self._is_clear(_WORSE * strays_m, course, course.at(now_s).curve_s, _WORTH_WHILE_S)

    def _is_clear(self, strays_m: float, course: Course, curve_s: float, ahead_s: float) -> bool:
        """Whether a vehicle that strays so far keeps what it should of the margin, over so much of the curve."""
        moments = np.arange(curve_s - _BEHIND_S, curve_s + ahead_s, _AHEAD_STEP_S)
        places = course.positions_at(np.minimum(moments, course.end_s))
        return float(self.clearance_m(places).min()) - strays_m >= (1.0 - _KEPT_SHARE) * self.track_margin_m
