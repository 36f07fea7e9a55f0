"""How long a flight takes, from take-off to landing, against how long the vehicle flies."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from mission.mission_file import Mission
from mission.site.descent import Descent
from mission.site.fence import planned_fence

if TYPE_CHECKING:
    from planner.free_space import FreeSpace


@dataclasses.dataclass(frozen=True)
class EnduranceBudget:
    """Seconds of flight, part by part.

    Attributes:
        climb_s: From home to the take-off altitude.
        approach_s: From there to the start, around what is in the way.
        path_s: The path itself.
        return_s: From where the path ends (the farthest corner, at the top, where the end is free) likewise back over
            home; nothing where the flight lands at its end.
        descent_s: From there to the ground.
        reserve_s: Kept for what nobody planned.
        endurance_s: What there is.
    """

    climb_s: float
    approach_s: float
    path_s: float
    return_s: float
    descent_s: float
    reserve_s: float
    endurance_s: float

    @property
    def needed_s(self) -> float:
        """Everything together, reserve included."""
        return self.climb_s + self.approach_s + self.path_s + self.return_s + self.descent_s + self.reserve_s

    @property
    def spare_s(self) -> float:
        """What is left over; negative: the flight cannot be flown."""
        return self.endurance_s - self.needed_s


def endurance_budget(mission: Mission) -> EnduranceBudget:
    """The budget of a mission, at the speeds that are flown.

    Args:
        mission: Its site, planner, vehicle and flight sections are used, and its obstacles as far as they can be read.
    """
    from mission.site.problem import limits_of

    limits = limits_of(mission.vehicle)
    free = _free_space(mission)
    home, start, end = np.array(mission.home_enu_m), np.array(mission.planner.start_enu_m), mission.planner.ends_at_m
    over_home = home + np.array([0.0, 0.0, mission.takeoff_altitude_m])
    if end is None:
        corners = np.array([(*corner, mission.site.box_m[1][2]) for corner in planned_fence(mission.site)])
        last = free.pushed(corners)[np.argmax(np.linalg.norm(corners - over_home, axis=1))]
    else:
        last = np.array(end)
    returns = mission.flight.end == "return"
    landing_m = (over_home if returns else last)[2] - home[2]

    def way_s(begin_m: np.ndarray, end_m: np.ndarray) -> float:
        length_m = float(free.flown_lengths(free.path_through(np.stack([begin_m, end_m]))).sum())
        # Speeding up and braking cost the time of half of each at full speed.
        ramps_s = limits.max_speed_mps / limits.max_acceleration_mps2 if length_m > 0.0 else 0.0
        return length_m / limits.max_speed_mps + ramps_s

    return EnduranceBudget(
        climb_s=max(mission.takeoff_altitude_m, 0.0) / limits.max_climb_mps,
        approach_s=way_s(over_home, start),
        path_s=mission.planner.duration_s,
        return_s=way_s(last, over_home) if returns else 0.0,
        descent_s=Descent(limits.max_descent_mps).to_ground_s(float(landing_m)),
        reserve_s=mission.flight.reserve_fraction * mission.vehicle.endurance_s,
        endurance_s=mission.vehicle.endurance_s,
    )


def _free_space(mission: Mission) -> FreeSpace:
    """Where ways to the start and home lead."""
    from mission.site.problem import fence_of, limits_of
    from mission.site.solids import frame_of, obstacle_field_of
    from planner.free_space import FreeSpace
    from planner.information import uniform
    from planner.obstacles import ObstacleField
    from planner.problem import Problem
    from planner.trajectory import Motion

    try:
        obstacles = obstacle_field_of(mission).below_lids
    except ValueError:
        # Another check says what is wrong with them.
        obstacles = ObstacleField.of([])
    region = frame_of(mission).region
    return FreeSpace(
        Problem(
            workspace=region,
            information=uniform(region, (1, 1, 1)),
            obstacles=obstacles,
            limits=limits_of(mission.vehicle),
            start=Motion.at_rest(0.5 * (region.box_min_m + region.box_max_m)),
            end_position_m=None,
            duration_s=mission.planner.duration_s,
            vehicle_radius_m=mission.vehicle.radius_m,
            clearance_margin_m=mission.flight.clearance_margin_m,
            fence_polygon_m=fence_of(mission.site),
        )
    )
