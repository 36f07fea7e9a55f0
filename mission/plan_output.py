"""What `mission plan` leaves: the plan file, its exports, its picture, and a summary for machines."""

from __future__ import annotations

import math
import platform
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mission.candidates import RankedCandidate, candidates_as_json
from mission.cautions import cautions_about, cautions_about_plan
from mission.console import say
from mission.exports import Format, exported
from mission.mission_file.obstacle import Box, Cylinder, NoFly, Prism
from mission.plan_file import (
    Airframe,
    ExclusionZone,
    Origin,
    PlanFile,
    PlannedCandidate,
    PlannedLimits,
    PlannedMetric,
    PlannedWaypoint,
    SampledTrajectory,
    SolvedProblem,
    Spline,
    write_plan_file,
)
from mission.site.fence import autopilot_fence, planned_fence
from mission.site.reachable import spare_in
from mission.waypoints import waypoints_along
from planner.gate import ProvenTrajectory
from planner.plan import Candidate
from planner.yaw import headings
from sim_bridge.frames import geodetic_from_enu

if TYPE_CHECKING:
    from mission.planning import Planned

PLAN_NAME, PICTURE_NAME, CANDIDATES_NAME = "plan.json", "plan.png", "candidates.png"

COARSE_SAMPLES = 400
"""Positions of each candidate in the plan file."""

WAYPOINT_TOLERANCE = 0.002
"""How far a waypoint leg may stray from the curve, as a share of the box's longer side."""

CIRCLE_CORNERS = 32


def plan_file_of(planned: Planned) -> PlanFile:
    """A plan as its file.

    Raises:
        ValueError: No candidate passed the gate, so there is nothing to fly.
    """
    mission, problem, plan = planned.mission, planned.problem, planned.plan
    best, selected = plan.best, plan.selected
    assert selected is not None
    curve = best.proven
    samples = curve.sampled_every(1.0 / mission.flight.stream_rate_hz)
    yaw = headings(
        samples.time_s,
        samples.velocity_mps,
        problem.limits.max_yaw_rate_radps,
        planned_rad=curve.headings_at(samples.time_s),
    )
    return PlanFile(
        name=mission.name,
        origin=Origin(**mission.site.origin.model_dump()),
        trajectory=SampledTrajectory.of(samples, yaw),
        spline=Spline.of(curve),
        waypoints=_waypoints(planned, curve),
        selected=selected,
        candidates=[_candidate(candidate) for candidate in plan.candidates],
        limits=PlannedLimits(
            max_speed_mps=problem.limits.max_speed_mps,
            max_climb_mps=problem.limits.max_climb_mps,
            max_descent_mps=problem.limits.max_descent_mps,
            max_acceleration_mps2=problem.limits.max_acceleration_mps2,
            max_yaw_rate_radps=problem.limits.max_yaw_rate_radps,
            max_jerk_mps3=finite(problem.limits.max_jerk_mps3),
            max_turn_rate_radps=finite(problem.limits.max_turn_rate_radps),
            max_length_m=finite(problem.max_length_m),
            clearance_margin_m=problem.clearance_margin_m,
            vehicle_radius_m=problem.vehicle_radius_m,
            box_min_enu_m=mission.site.box_m[0],
            box_max_enu_m=mission.site.box_m[1],
            fence_polygon_enu_m=list(planned_fence(mission.site)) if mission.site.polygon_enu_m else None,
        ),
        metric=PlannedMetric(
            kind=planned.options.metric.value,
            weights=planned.options.metric_weights.value,
            modes=planned.options.modes,
            heading=planned.options.heading.value,
            ergodic_metric=best.ergodic_metric,
            lawnmower_ergodic_metric=finite(plan.lawnmower_ergodic_metric),
            probability_found=best.probability_found,
            lawnmower_probability_found=plan.lawnmower_probability_found,
        ),
        flight=Airframe(
            autopilot=mission.vehicle.autopilot,
            home_enu_m=mission.home_enu_m,
            takeoff_altitude_m=mission.takeoff_altitude_m,
            end=mission.flight.end,
            fence_enu_m=list(autopilot_fence(mission.site)),
            no_fly=[_exclusion(zone) for zone in mission.no_fly],
            rally_enu_m=list(mission.site.rally_enu_m),
        ),
        problem=SolvedProblem(
            mission=mission.model_dump(mode="json", exclude_none=True),
            seed=mission.planner.seed,
            versions=_versions(),
        ),
    )


def _waypoints(planned: Planned, curve: ProvenTrajectory) -> list[PlannedWaypoint]:
    origin = planned.mission.site.origin.point()
    tolerance_m = WAYPOINT_TOLERANCE * float(planned.problem.workspace.lengths_m[:2].max())
    found = []
    spare_m = spare_in(planned.mission.site, planned.problem.obstacles, planned.problem.keep_out_m)
    for waypoint in waypoints_along(curve, spare_m, tolerance_m=tolerance_m):
        place = geodetic_from_enu(waypoint.position_enu_m, origin)
        heading = curve.headings_at(np.array([waypoint.time_s]))
        found.append(
            PlannedWaypoint(
                time_s=waypoint.time_s,
                position_enu_m=waypoint.position_enu_m,
                latitude_deg=place.latitude_deg,
                longitude_deg=place.longitude_deg,
                altitude_amsl_m=place.altitude_amsl_m,
                speed_mps=waypoint.speed_mps,
                yaw_enu_rad=None if heading is None else float(heading[0]),
            )
        )
    return found


def _candidate(candidate: Candidate) -> PlannedCandidate:
    curve, report = candidate.trajectory, candidate.report
    coarse = curve.sample(np.linspace(curve.start_s, curve.end_s, COARSE_SAMPLES))
    return PlannedCandidate(
        seed_pattern=candidate.seed_pattern,
        feasible=candidate.feasible,
        violations=[violation.text for violation in report.violations],
        cost=finite(candidate.cost),
        ergodic_metric=finite(candidate.ergodic_metric),
        length_m=finite(report.length_m),
        duration_s=report.duration_s,
        min_clearance_m=finite(report.min_clearance_m),
        position_enu_m=coarse.position_m.tolist(),
        spline=Spline.of(curve),
    )


def _exclusion(zone: NoFly) -> ExclusionZone:
    """A no-fly volume as an upright prism; a cylinder's polygon lies around it."""
    match zone:
        case Prism():
            return ExclusionZone(polygon_enu_m=list(zone.polygon_enu_m), floor_m=zone.floor_m, ceiling_m=zone.ceiling_m)
        case Box():
            (west, south, floor), (east, north, ceiling) = zone.min_enu_m, zone.max_enu_m
            corners = [(west, south), (east, south), (east, north), (west, north)]
            return ExclusionZone(polygon_enu_m=corners, floor_m=floor, ceiling_m=ceiling)
        case Cylinder():
            radius_m = zone.radius_m / math.cos(math.pi / CIRCLE_CORNERS)
            angles = [2.0 * math.pi * (k + 0.5) / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS)]
            east, north = zone.center_enu_m
            ring = [(east + radius_m * math.cos(a), north + radius_m * math.sin(a)) for a in angles]
            return ExclusionZone(polygon_enu_m=ring, floor_m=zone.floor_m, ceiling_m=zone.ceiling_m)


def _versions() -> dict[str, str]:
    """What the plan depends on beside the mission."""
    packages = ("ergonaut", "jax", "jaxlib", "numpy", "scipy")
    return {"python": platform.python_version(), **{name: metadata.version(name) for name in packages}}


def finite(value: float) -> float | None:
    """A number that JSON can hold; None for one that is not finite."""
    return float(value) if math.isfinite(value) else None


def write_outputs(planned: Planned, folder: Path, rows: list[RankedCandidate] | None = None) -> list[Path]:
    """Writes the plan, its exports and its pictures; of a plan with nothing to fly, the pictures alone.

    What an earlier plan left there goes first: a path that was refused must not lie beside one that can be flown.

    Args:
        planned: The plan.
        folder: Where to; it is made where it is not there.
        rows: The candidates side by side, which are drawn too; None: they are not.

    Returns:
        The files written.

    Raises:
        OSError: The folder cannot be written to.
    """
    from mission.pictures.picture import draw_plan

    folder.mkdir(parents=True, exist_ok=True)
    remove_outputs(folder)
    written = []
    if planned.plan.selected is not None:
        plan = plan_file_of(planned)
        written.append(folder / PLAN_NAME)
        write_plan_file(plan, written[0])
        for format in Format:
            path = folder / f"plan{format.suffix}"
            try:
                text = exported(plan, format)
            except ValueError as reason:
                # What one format cannot hold is no reason to lose the others, or the flight.
                say(f"{path} is not written: {reason}")
                continue
            path.write_text(text, encoding="utf-8")
            written.append(path)
    written.append(folder / PICTURE_NAME)
    draw_plan(planned, written[-1])
    if rows is not None:
        from mission.pictures.candidates_picture import draw_candidates

        written.append(folder / CANDIDATES_NAME)
        draw_candidates(planned, rows, written[-1])
    return written


def remove_outputs(folder: Path) -> None:
    """Takes away what `write_outputs` left in a folder.

    Raises:
        OSError: A file cannot be removed.
    """
    for name in (PLAN_NAME, *(f"plan{format.suffix}" for format in Format), PICTURE_NAME, CANDIDATES_NAME):
        (folder / name).unlink(missing_ok=True)


def summary_of(planned: Planned, files: list[Path], rows: list[RankedCandidate] | None = None) -> dict[str, Any]:
    """The one JSON object of `mission plan --json`; figures of the selected path are null where there is none.

    Args:
        planned: The plan.
        files: What was written.
        rows: The candidates side by side, which makes their rows longer; None: only what each is by itself.
    """
    plan = planned.plan
    compared = [{}] * len(plan.candidates) if rows is None else candidates_as_json(rows)
    best = plan.best if plan.selected is not None else None
    report = best.report if best is not None else None
    return {
        "feasible": best is not None,
        "warnings": [*cautions_about(planned.mission), *cautions_about_plan(planned)],
        "status": plan.status.value,
        "selected": plan.selected,
        "ergodic_metric": best.ergodic_metric if best is not None else None,
        "lawnmower_ergodic_metric": finite(plan.lawnmower_ergodic_metric),
        "probability_found": best.probability_found if best is not None else None,
        "lawnmower_probability_found": plan.lawnmower_probability_found,
        "length_m": report.length_m if report is not None else None,
        "duration_s": report.duration_s if report is not None else None,
        "min_clearance_m": finite(report.min_clearance_m) if report is not None else None,
        "max_speed_mps": report.max_speed_mps if report is not None else None,
        "max_acceleration_mps2": report.max_acceleration_mps2 if report is not None else None,
        "solve_s": planned.solve_s,
        "compile_s": planned.compile_s,
        "total_s": planned.total_s,
        "candidates": [
            {
                "seed_pattern": candidate.seed_pattern,
                "feasible": candidate.feasible,
                "ergodic_metric": finite(candidate.ergodic_metric),
                "probability_found": candidate.probability_found,
                "cost": finite(candidate.cost),
                "length_m": finite(candidate.report.length_m),
                "min_clearance_m": finite(candidate.report.min_clearance_m),
                "max_speed_mps": finite(candidate.report.max_speed_mps),
                "violations": [violation.text for violation in candidate.report.violations],
                **beside,
            }
            for candidate, beside in zip(plan.candidates, compared, strict=True)
        ],
        "diversity": {
            "determinant": plan.diversity.determinant,
            "mean_pair_distance": plan.diversity.mean_pair_distance,
            "frechet": plan.diversity.frechet,
            "effective_plans": plan.diversity.effective_plans,
        },
        "files": [str(file) for file in files],
    }
