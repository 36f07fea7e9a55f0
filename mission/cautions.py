"""What is allowed and probably not meant: said with a plan or a check, and nothing is refused for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mission.mission_file import Mission
from mission.mission_file.information import Raster
from mission.mission_file.obstacle import Box, Cylinder, Prism, Sphere
from mission.site.nearness import FAR_M, gap_m

if TYPE_CHECKING:
    from mission.planning import Planned
    from planner.trajectory import Trajectory

LEAST_COVERED = 0.9
"""Of the box, by a raster of information."""
MOST_CUT = 0.1
"""Of a raster's weight, by the box."""
LEAST_MOVED = 0.02
"""Of what the speed allows: a path that is shorter stands still."""
SPEED_SAMPLES = 5000


def cautions_about(mission: Mission) -> list[str]:
    """What a mission probably does not mean, a sentence each."""
    return [*_about_the_raster(mission), *_about_far_obstacles(mission)]


def _about_far_obstacles(mission: Mission) -> Iterator[str]:
    """Files that lie elsewhere are refused; one obstacle in numbers may be one of a list that others use too."""
    from mission.site.solids import frame_of

    region = frame_of(mission)
    for section in ("obstacle", "no_fly"):
        for index, entry in enumerate(getattr(mission, section)):
            match entry:
                case Sphere() | Cylinder():
                    center = np.array(entry.center_enu_m)
                    part = np.stack([center - entry.radius_m, center + entry.radius_m])
                case Box():
                    part = np.array([entry.min_enu_m, entry.max_enu_m])
                case Prism():
                    part = np.array(entry.polygon_enu_m)
                case _:
                    continue
            if (far_m := gap_m(part, region.low_m, region.high_m)) > FAR_M:
                yield (
                    f"{section}.{index} ({entry.kind}) lies {far_m / 1000.0:.0f} km from the mission and keeps it from "
                    "nothing: are its numbers metres east and north of site.origin?"
                )


def _about_the_raster(mission: Mission) -> list[str]:
    information = mission.information
    if not isinstance(information, Raster) or information.georeferenced:
        # A georeferenced one with gaps in the box is refused.
        return []
    from mission.site.information import placed_raster

    raster = placed_raster(information)
    (west, south, _), (east, north, _) = mission.site.box_m
    low, high = np.array([west, south]), np.array([east, north])
    overlap_m = np.minimum(raster.high_m, high) - np.maximum(raster.low_m, low)
    covered = float(np.prod(overlap_m / (high - low)))
    known = np.nan_to_num(raster.values, nan=0.0, posinf=0.0, neginf=0.0).clip(0.0)
    cut = 1.0 - float(raster.clipped(low, high).values.sum() / known.sum())
    said = []
    if covered < LEAST_COVERED:
        said.append(
            f"{information.raster.name} covers {100.0 * covered:.2g} % of the box: the rest counts as without "
            "information; are cell_m and center_enu_m right?"
        )
    if cut > MOST_CUT:
        said.append(
            f"{100.0 * cut:.2g} % of the weight in {information.raster.name} lies outside the box and is cut off; "
            "probabilities of finding are of the rest alone"
        )
    return said


def cautions_about_plan(planned: Planned) -> list[str]:
    """What a plan that may be flown probably should not be, a sentence each."""
    plan, limits = planned.plan, planned.problem.limits
    if plan.selected is None:
        return []
    report, best = plan.best.report, plan.best
    said = []
    if report.length_m < LEAST_MOVED * limits.max_speed_mps * report.duration_s:
        said.append(
            f"the path hardly moves ({report.length_m:.3g} m in {report.duration_s:.0f} s): the information lies where "
            "it starts, or there was no time to find a better one (planner.time_limit_s)"
        )
    elif best.objective > plan.lawnmower_objective:
        measure = "ergodic metric" if best.probability_found is None else "probability of finding nothing"
        said.append(
            f"a lawnmower of the same length explores better ({measure} {plan.lawnmower_objective:.4g}, this path "
            f"{best.objective:.4g}): give it more time (planner.time_limit_s) or more candidates"
        )
    if planned.mission.vehicle.preset == "fixed-wing":
        slowest_mps, at_s = slowest_under_way(plan.best.trajectory)
        said.append(
            f"on the way its speed falls to {slowest_mps:.1f} m/s, at {at_s:.0f} s: plans know no least speed, and a "
            "wing that cannot fly so slowly does not follow this path"
        )
    return said


def slowest_under_way(curve: Trajectory) -> tuple[float, float]:
    """Least speed between getting to half the greatest for the first and the last time, m/s, and when."""
    samples = curve.sample(np.linspace(curve.start_s, curve.end_s, SPEED_SAMPLES))
    speed = np.linalg.norm(samples.velocity_mps, axis=1)
    fast = np.flatnonzero(speed >= 0.5 * speed.max())
    way = slice(int(fast[0]), int(fast[-1]) + 1)
    slowest = int(fast[0]) + int(np.argmin(speed[way]))
    return float(speed[slowest]), float(samples.time_s[slowest])
