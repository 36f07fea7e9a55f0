"""What a mission means for its flight: what is to be done, what flying costs, what telemetry is held against."""

from __future__ import annotations

import numpy as np

from mission.executive.energy import Energy
from mission.executive.events import Assignment, FlightEnd, FlightMethod
from mission.executive.monitors import Monitors
from mission.flying.belief import Belief
from mission.mission_file import Mission
from mission.mission_file.vehicle import Vehicle
from mission.mission_items import item_times_s
from mission.plan_output import plan_file_of
from mission.planning import Planned
from mission.site.descent import Descent
from mission.site.fence import autopilot_fence
from planner.polygon import KeepIn
from planner.problem import Problem

_FENCE_TOLERANCE_M = 1.0
_LEAST_CLEARANCE_SHARE = 0.3
_TRACK_ERROR_S = 1.0
_LEAST_TRACK_ERROR_M = 0.5
_MOST_TRACK_ERROR_M = 5.0


def assignment_of(
    planned: Planned, method: FlightMethod, resumed: bool = False, *, only_home: bool = False
) -> Assignment:
    """What the executive is given to do.

    Args:
        planned: The mission and its plan.
        method: Setpoints, or an uploaded mission.
        resumed: Whether it goes on with an earlier flight.
        only_home: Whether only its way home is left.
    """
    mission, limits = planned.mission, planned.problem.limits
    return Assignment(
        exploration=planned.plan.best.proven,
        takeoff_altitude_m=mission.takeoff_altitude_m,
        end=FlightEnd(mission.flight.end),
        method=method,
        max_acceleration_mps2=limits.max_acceleration_mps2,
        max_yaw_rate_radps=limits.max_yaw_rate_radps,
        max_climb_mps=limits.max_climb_mps,
        ready_timeout_s=mission.link.ready_timeout_s,
        only_home=only_home,
        item_times_s=item_times_s(plan_file_of(planned)) if method is FlightMethod.MISSION else (),
        resumed=resumed,
        rally_m=mission.site.rally_enu_m,
    )


def leaned_against_per_s(vehicle: Vehicle) -> float | None:
    """The drag that setpoints lean against, 1/s; None: the vehicle has no place for it in them.

    PX4 adds a streamed acceleration to what it finds to be needed itself. Copter takes it for the path's, and moves
    what it follows by it: flown so, its simulation was 1.1 m from its course on average instead of 0.2 m.
    """
    return vehicle.drag_per_s if vehicle.autopilot == "px4" else None


def energy_of(mission: Mission, problem: Problem) -> Energy:
    """What flying costs."""
    limits = problem.limits
    return Energy(
        mission.vehicle.endurance_s,
        mission.flight.reserve_fraction,
        limits.max_speed_mps,
        limits.max_climb_mps,
        Descent(limits.max_descent_mps),
    )


def monitors_of(mission: Mission, belief: Belief, energy: Energy) -> Monitors:
    """What telemetry is held against: always what is known now, pushed obstacles too."""
    keep_in = KeepIn.of(np.array(autopilot_fence(mission.site)))
    ceiling_m = mission.site.box_m[1][2] + mission.site.fence_margin_m
    radius_m = mission.vehicle.radius_m

    def fence_distance_m(place: np.ndarray) -> float:
        return min(float(keep_in.distance(place[None, :2])[0]), ceiling_m - float(place[2]))

    return Monitors(
        clearance_m=lambda places: belief.problem.obstacles.distance(places) - radius_m,
        least_clearance_m=_LEAST_CLEARANCE_SHARE * mission.flight.clearance_margin_m,
        fence_distance_m=fence_distance_m,
        fence_tolerance_m=_FENCE_TOLERANCE_M,
        max_track_error_m=float(
            np.clip(_TRACK_ERROR_S * mission.vehicle.max_speed_mps, _LEAST_TRACK_ERROR_M, _MOST_TRACK_ERROR_M)
        ),
        track_margin_m=max(mission.flight.clearance_margin_m, _LEAST_TRACK_ERROR_M),
        energy=energy,
        cruise_height_m=mission.takeoff_altitude_m,
    )
