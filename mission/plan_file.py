"""plan.json: a plan as a file, complete enough to be flown, exported, drawn and checked without anything else.

The spline is the curve that was proven; the trajectory is that curve sampled at the streaming rate.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from mission.findings import Finding, InputError
from planner.trajectory import Samples, Trajectory
from sim_bridge.state import GeodeticPoint

FORMAT = "ergonaut-plan"
VERSION = 1
SPLINE_AGREES_M = 1e-6

Vector = tuple[float, float, float]
Corner = tuple[float, float]


class Record(BaseModel):
    """A part of a plan file: finite numbers; entries of later versions are passed over."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)


class Origin(Record):
    """Zero of the local frame."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float

    def point(self) -> GeodeticPoint:
        """The origin as the vehicle side knows it."""
        return GeodeticPoint(self.latitude_deg, self.longitude_deg, self.altitude_amsl_m)


class Spline(Record):
    """A uniform cubic B-spline (`planner.trajectory.Trajectory`)."""

    control_points_enu_m: Annotated[list[Vector], Field(min_length=4)]
    knot_interval_s: Annotated[float, Field(gt=0.0)]
    start_s: float
    heading_control_enu_rad: list[float] | None = None
    """Of a heading that was planned, one for each of the path's; null: the vehicle looks where it goes."""

    @classmethod
    def of(cls, trajectory: Trajectory) -> Spline:
        """The curve's own numbers, none lost."""
        heading = trajectory.heading_control_rad
        return cls(
            control_points_enu_m=trajectory.control_points_m.tolist(),
            knot_interval_s=float(trajectory.knot_interval_s),
            start_s=float(trajectory.start_s),
            heading_control_enu_rad=None if heading is None else heading.tolist(),
        )

    @model_validator(mode="after")
    def _fits_together(self) -> Spline:
        self.trajectory()
        return self

    def trajectory(self) -> Trajectory:
        """The curve."""
        heading = self.heading_control_enu_rad
        return Trajectory(
            np.array(self.control_points_enu_m),
            self.knot_interval_s,
            self.start_s,
            None if heading is None else np.array(heading),
        )


class SampledTrajectory(Record):
    """The selected curve at the streaming rate."""

    time_s: Annotated[list[float], Field(min_length=2)]
    position_enu_m: list[Vector]
    velocity_enu_mps: list[Vector]
    acceleration_enu_mps2: list[Vector]
    yaw_enu_rad: list[float]

    @classmethod
    def of(cls, samples: Samples, yaw_enu_rad: np.ndarray) -> SampledTrajectory:
        """From the arrays of the planner."""
        return cls(
            time_s=samples.time_s.tolist(),
            position_enu_m=samples.position_m.tolist(),
            velocity_enu_mps=samples.velocity_mps.tolist(),
            acceleration_enu_mps2=samples.acceleration_mps2.tolist(),
            yaw_enu_rad=yaw_enu_rad.tolist(),
        )


class PlannedWaypoint(Record):
    """The end of a straight leg, for vehicles that fly waypoints."""

    time_s: float
    position_enu_m: Vector
    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    speed_mps: Annotated[float, Field(ge=0.0)]
    yaw_enu_rad: float | None = None
    """Where the nose points there, where that was planned; null: where the vehicle goes."""


class PlannedCandidate(Record):
    """One path of the set."""

    seed_pattern: str
    """What the candidate grew from."""
    feasible: bool
    """Whether the gate passed it."""
    violations: list[str]
    """What the gate refused it for, in words."""
    cost: float | None
    """What candidates are ranked by; null for one that diverged, as the other figures are."""
    ergodic_metric: float | None
    length_m: float | None
    duration_s: float
    min_clearance_m: float | None
    """From the hull to the nearest obstacle; null where there is none."""
    position_enu_m: list[Vector]
    """The path, coarsely."""
    spline: Spline
    """The path, exactly."""


class PlannedLimits(Record):
    """What the plan was proven against."""

    max_speed_mps: float
    max_climb_mps: float
    max_descent_mps: float
    max_acceleration_mps2: float
    max_yaw_rate_radps: float
    clearance_margin_m: float
    vehicle_radius_m: float
    box_min_enu_m: Vector
    box_max_enu_m: Vector
    fence_polygon_enu_m: list[Corner] | None
    max_jerk_mps3: float | None = None
    """Null where there is no limit."""
    max_turn_rate_radps: float | None = None
    """Null where there is no limit."""
    max_length_m: float | None = None
    """Null where there is no limit."""


class PlannedMetric(Record):
    """Which metric the figures are of."""

    kind: Literal["spectral", "kernel"]
    weights: Literal["linear", "squared"]
    """Convention of Λ."""
    modes: tuple[int, int, int]
    """K along east, north, up."""
    heading: Literal["travel", "explored"] = "travel"
    """Whether headings were explored with the places: then the figures are of both together."""
    ergodic_metric: float
    lawnmower_ergodic_metric: float | None
    """The best lawnmower of the same length over the same free space; null where it is not known."""
    probability_found: float | None = None
    """Of a search, that the path finds what it looks for; null: there is nothing to find."""
    lawnmower_probability_found: float | None = None
    """What the best lawnmower of the same length finds."""


class ExclusionZone(Record):
    """A no-fly volume: an upright prism."""

    polygon_enu_m: Annotated[list[Corner], Field(min_length=3)]
    floor_m: float
    ceiling_m: float


class Airframe(Record):
    """What a ground station is told of the vehicle and its flight."""

    autopilot: Literal["px4", "ardupilot"]
    home_enu_m: Vector
    takeoff_altitude_m: float
    """Above home."""
    end: Literal["return", "land"]
    """What follows the path."""
    fence_enu_m: Annotated[list[Corner], Field(min_length=3)]
    """The fence that holds the flight, corners counter-clockwise."""
    no_fly: list[ExclusionZone]
    rally_enu_m: list[Vector]


class SolvedProblem(Record):
    """What was asked, so that it can be asked again."""

    mission: dict[str, Any]
    """The resolved mission."""
    seed: int
    versions: dict[str, str]


class PlanFile(Record):
    """A plan with a proven path to fly."""

    format: Literal["ergonaut-plan"] = FORMAT
    version: Literal[1] = VERSION
    name: str
    origin: Origin
    trajectory: SampledTrajectory
    spline: Spline
    waypoints: Annotated[list[PlannedWaypoint], Field(min_length=2)]
    selected: Annotated[int, Field(ge=0)]
    candidates: Annotated[list[PlannedCandidate], Field(min_length=1)]
    limits: PlannedLimits
    metric: PlannedMetric
    flight: Airframe
    problem: SolvedProblem

    def curve(self) -> Trajectory:
        """The curve to fly, exactly as it was proven."""
        return self.spline.trajectory()

    def findings(self) -> list[Finding]:
        """What does not fit together."""
        found = []
        flown = self.trajectory
        for key in ("position_enu_m", "velocity_enu_mps", "acceleration_enu_mps2", "yaw_enu_rad"):
            if len(getattr(flown, key)) != len(flown.time_s):
                found.append(
                    Finding(
                        f"trajectory.{key}",
                        f"{len(getattr(flown, key))} samples",
                        f"time_s has {len(flown.time_s)}: the file was changed or cut, plan again",
                    )
                )
        if not (np.diff(flown.time_s) > 0.0).all():
            found.append(Finding("trajectory.time_s", "", "must increase: the file was changed, plan again"))
        if self.selected >= len(self.candidates):
            found.append(
                Finding("selected", str(self.selected), f"there are only {len(self.candidates)} candidates: plan again")
            )
        if not found:
            curve = self.curve().sample(np.array(flown.time_s)).position_m
            gap = float(np.abs(curve - np.array(flown.position_enu_m)).max())
            if gap > SPLINE_AGREES_M:
                found.append(
                    Finding(
                        "spline",
                        "",
                        f"differs from the sampled trajectory by {gap:.3g} m: one of the two was changed, plan again",
                    )
                )
        return found


def write_plan_file(plan: PlanFile, path: Path) -> None:
    """Writes a plan; numbers are written in full, so that reading gives them back exactly."""
    path.write_text(json.dumps(plan.model_dump(mode="json"), allow_nan=False, indent=None) + "\n", encoding="utf-8")


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"it holds {name}, which is not a number to fly: plan again")


def read_plan_file(path: Path | str) -> PlanFile:
    """Reads a plan back.

    Raises:
        InputError: A file that is not a plan of this version, or whose parts do not fit together.
    """
    source = str(path)

    def refused(got: str, advice: str) -> InputError:
        return InputError(source, [Finding("file", got, advice)])

    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"), parse_constant=_refuse_constant)
    except OSError as error:
        raise refused(source, f"cannot be read: {error.strerror or error}") from error
    except json.JSONDecodeError as error:
        raise refused(
            f"{error.msg} at line {error.lineno}, column {error.colno}", "is not complete JSON: plan again"
        ) from error
    except (ValueError, RecursionError) as error:
        raise refused(source, f"is not a plan: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise refused(source, f'is not a plan file: its "format" must be "{FORMAT}" (written by `mission plan`)')
    if data.get("version") != VERSION:
        raise refused(
            f"version {data.get('version')}", f"this program reads version {VERSION}: plan again with this version"
        )
    try:
        plan = PlanFile.model_validate(data)
    except ValidationError as error:
        raise InputError(
            source,
            [
                Finding(".".join(map(str, fault["loc"])), str(fault["input"])[:60], f"{fault['msg']}: plan again")
                for fault in error.errors(include_url=False)[:20]
            ],
        ) from error
    if found := plan.findings():
        raise InputError(source, found)
    return plan
