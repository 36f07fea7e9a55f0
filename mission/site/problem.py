"""From a mission to what the planner is given: numbers and arrays, local ENU metres and seconds."""

from __future__ import annotations

import math

import numpy as np

from mission.mission_file import Mission
from mission.mission_file.site import Site
from mission.mission_file.vehicle import Vehicle
from mission.site.information import density_of, workspace_of
from mission.site.reachable import reachable, spare_in
from mission.site.solids import obstacle_field_of
from planner.effort import Search
from planner.information import DensityGrid
from planner.problem import HeadingRule, Kernel, Limits, Method, Metric, MetricWeights, Options, Problem
from planner.trajectory import Motion

CELLS_A_RADIUS = 3


def limits_of(vehicle: Vehicle) -> Limits:
    """What plans may ask of the vehicle: its limits, less what is left to it for keeping on the course."""
    share = 1.0 - vehicle.speed_reserve
    return Limits(
        max_speed_mps=share * vehicle.max_speed_mps,
        max_climb_mps=share * vehicle.max_climb_mps,
        max_descent_mps=share * vehicle.max_descent_mps,
        max_acceleration_mps2=vehicle.max_acceleration_mps2,
        max_yaw_rate_radps=math.radians(vehicle.max_yaw_rate_degps),
        max_jerk_mps3=vehicle.max_jerk_mps3 or math.inf,
        max_turn_rate_radps=math.radians(vehicle.max_turn_rate_degps or math.inf),
    )


def fence_of(site: Site) -> np.ndarray | None:
    """The polygon that paths stay inside, shape (corner, 2); None where the box alone holds them."""
    return np.array(site.polygon_enu_m) if site.polygon_enu_m is not None else None


def problem_from_mission(mission: Mission) -> Problem:
    """What the planner solves.

    Raises:
        ValueError: A file that cannot be used, or numbers that do not fit together (`mission.loading.load` has checked
            both, so this means that a file changed since).
    """
    obstacles = obstacle_field_of(mission)
    spare_m = spare_in(mission.site, obstacles, mission.keep_out_m)
    density = reachable(density_of(mission.information, mission.site), spare_m)
    search, limits = search_of(mission, density), limits_of(mission.vehicle)
    max_length_m = mission.planner.max_length_m or math.inf
    if search is not None:
        density = search.effort(min(max_length_m, limits.max_speed_mps * mission.planner.duration_s))
    end = mission.planner.ends_at_m
    return Problem(
        workspace=workspace_of(mission.site),
        information=density,
        obstacles=obstacles,
        limits=limits,
        start=Motion.at_rest(np.array(mission.planner.start_enu_m)),
        end_position_m=np.array(end) if end is not None else None,
        duration_s=mission.planner.duration_s,
        vehicle_radius_m=mission.vehicle.radius_m,
        clearance_margin_m=mission.flight.clearance_margin_m,
        fence_polygon_m=fence_of(mission.site),
        search=search,
        max_length_m=max_length_m,
    )


def search_of(mission: Mission, prior: DensityGrid) -> Search | None:
    """The search that `belief.kind = "detection"` asks for; None: time is shared out as the information is."""
    radius_m = mission.sensor.detection_radius_m
    if mission.belief.kind != "detection" or radius_m is None:
        return None
    return Search(for_search(prior, radius_m), radius_m, mission.sensor.detection_probability)


def for_search(prior: DensityGrid, detection_radius_m: float) -> DensityGrid:
    """The prior in cells so fine that what a pass leaves beside it is not taken for seen."""
    return prior.finer_on_the_map(detection_radius_m / CELLS_A_RADIUS)


def options_from_mission(mission: Mission) -> Options:
    """How the planner solves it."""
    planner = mission.planner
    return Options(
        candidates=planner.candidates,
        modes=mission.modes,
        kernel=Kernel(planner.kernel),
        metric=Metric(planner.metric),
        heading=HeadingRule(planner.heading),
        metric_weights=MetricWeights(planner.metric_weights),
        method=Method(planner.method),
        time_step_s=mission.time_step_s,
        seed=planner.seed,
    )
