"""How long a flight takes, from take-off to landing, against how long the vehicle flies."""

from __future__ import annotations

import dataclasses
import math

from mission.mission_file import Mission


@dataclasses.dataclass(frozen=True)
class EnduranceBudget:
    """Seconds of flight, part by part.

    Attributes:
        climb_s: From home to the take-off altitude.
        approach_s: From there to the start.
        path_s: The path itself.
        return_s: From where the path ends back to home (the farthest corner of the box where the end is free); nothing
            where the flight lands at its end.
        descent_s: To the ground.
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
    """The budget of a mission, at the vehicle's own limits.

    Args:
        mission: Its site, planner, vehicle and flight sections are used.
    """
    vehicle, home = mission.vehicle, mission.home_enu_m
    start, end = mission.planner.start_enu_m, mission.planner.ends_at_m
    low, high = mission.site.box_m
    cruise_up_m = home[2] + mission.takeoff_altitude_m
    height_m = abs(start[2] - cruise_up_m)
    approach_s = math.dist(home[:2], start[:2]) / vehicle.max_speed_mps
    approach_s += height_m / (vehicle.max_climb_mps if start[2] > cruise_up_m else vehicle.max_descent_mps)
    ends = (
        [end[:2]] if end is not None else [(east, north) for east in (low[0], high[0]) for north in (low[1], high[1])]
    )
    end_up_m = end[2] if end is not None else high[2]
    way_home_m = max(math.dist(home[:2], place) for place in ends) if mission.flight.end == "return" else 0.0
    return EnduranceBudget(
        climb_s=max(mission.takeoff_altitude_m, 0.0) / vehicle.max_climb_mps,
        approach_s=approach_s,
        path_s=mission.planner.duration_s,
        return_s=way_home_m / vehicle.max_speed_mps,
        descent_s=max(end_up_m - home[2], 0.0) / vehicle.max_descent_mps,
        reserve_s=mission.flight.reserve_fraction * vehicle.endurance_s,
        endurance_s=vehicle.endurance_s,
    )
