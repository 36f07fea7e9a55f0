"""A flight as a Rerun recording: the field, the obstacles, every candidate, what was selected and what was flown.

Rerun is large, so it is imported only here, when a recording is asked for. Static things are logged once, series as
whole columns. Nothing is sent anywhere: recordings are files, and the viewer is told to bind to this machine alone.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import binary_erosion

from mission.flying.flight_log import FlightLog
from mission.mission_file import Mission
from mission.pictures.relief import ground_of
from mission.site.fence import autopilot_fence
from mission.site.solids import solids_in
from planner.distance_grid import DistanceGrid
from planner.height_field import HeightField
from planner.obstacles import Box, Cylinder, ObstacleField, Prism, Sphere
from planner.problem import Problem
from planner.trajectory import Trajectory

if TYPE_CHECKING:
    import rerun as rr

RECORDING_NAME = "recording.rrd"
TIMELINE = "flight"
_CURVE_SAMPLES = 1500
_PATH, _PLANNED, _OTHER, _SOLID, _FORBIDDEN, _FENCE = (
    (217, 72, 15),
    (28, 78, 128),
    (123, 135, 148, 90),
    (145, 155, 166, 255),
    (201, 42, 42, 110),
    (43, 138, 62),
)
_TEXT_LEVEL = {True: "WARN", False: "INFO"}
_TEXT_KINDS = ("phase", "say", "replan", "order", "answer", "push", "stall", "course")


def record_flight(
    path: Path, log: FlightLog, mission: Mission, problem: Problem, candidates: Sequence[Trajectory]
) -> None:
    """Write a flight's recording.

    Args:
        path: The `.rrd` to write.
        log: What was flown.
        mission: What was asked, with what was pushed.
        problem: The same for the planner.
        candidates: The proven alternatives the flight began with.
    """
    os.environ.setdefault("RERUN_ANALYTICS", "false")
    import rerun as rr

    recording = rr.RecordingStream("ergonaut", recording_id=path.parent.name or "flight")
    recording.save(path, default_blueprint=_blueprint())
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    _log_site(recording, mission, problem)
    _log_information(recording, problem)
    _log_obstacles(recording, mission)
    _log_candidates(recording, candidates)
    _log_courses(recording, log)
    _log_flown(recording, log, problem)
    _log_words(recording, log)
    recording.flush()
    recording.disconnect()


def open_viewer(path: Path) -> int:
    """Show a recording; returns the viewer's exit code."""
    environment = {**os.environ, "RERUN_ANALYTICS": "false"}
    command = [sys.executable, "-m", "rerun", "--bind", "127.0.0.1", str(path)]
    return subprocess.run(command, env=environment, check=False).returncode


def _blueprint() -> rr.blueprint.Blueprint:
    import rerun.blueprint as rrb

    def series(name: str, *paths: str) -> rrb.TimeSeriesView:
        return rrb.TimeSeriesView(name=name, origin="/series", contents=[f"$origin/{path}" for path in paths])

    trail = rrb.VisibleTimeRanges(
        timeline=TIMELINE, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial3DView(name="flight", origin="/world", overrides={"world/flown": trail}),
                rrb.TextLogView(name="events", origin="/events"),
                row_shares=[4, 1],
            ),
            rrb.Vertical(
                series("height [m]", "height"),
                series("speed [m/s]", "speed", "speed_limit"),
                series("clearance [m]", "clearance", "margin"),
                series("distance from the course [m]", "tracking_error"),
                series("battery", "battery"),
            ),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
    )


def _log_site(recording: rr.RecordingStream, mission: Mission, problem: Problem) -> None:
    import rerun as rr

    low, high = problem.workspace.box_min_m, problem.workspace.box_max_m
    box = rr.Boxes3D(mins=[low], sizes=[high - low], colors=[(203, 210, 217)], labels=["box"], show_labels=False)
    recording.log("world/site/box", box, static=True)
    corners = np.array(autopilot_fence(mission.site))
    ring = np.column_stack([np.vstack([corners, corners[:1]]), np.full(len(corners) + 1, low[2])])
    recording.log("world/site/fence", rr.LineStrips3D([ring], colors=[_FENCE]), static=True)
    home = rr.Points3D([mission.home_enu_m], colors=[_FENCE], radii=[-6.0], labels=["home"])
    recording.log("world/site/home", home, static=True)


def _log_information(recording: rr.RecordingStream, problem: Problem) -> None:
    import rerun as rr

    mass, low, lengths = problem.information.mass, problem.workspace.box_min_m, problem.workspace.lengths_m
    if mass.shape[2] > 1:
        values = np.ascontiguousarray((mass / mass.max()).transpose(2, 1, 0)).astype(np.float16)
        volume = rr.Volume3D(
            values, voxel_size=problem.information.cell_m, translation=low, gamma=1.5, optical_density=2.0
        )
        recording.log("world/information", volume, static=True)
        return
    seen = mass[:, :, 0] / mass.max()
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    vertices = np.column_stack([low[:2] + corners * lengths[:2], np.full(4, low[2])])
    shade = np.stack([255 - 220 * seen.T, 255 - 150 * seen.T, 255 - 108 * seen.T], axis=-1)[::-1].astype(np.uint8)
    sheet = rr.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=[[0, 1, 2], [0, 2, 3]],
        vertex_texcoords=np.column_stack([corners[:, 0], 1 - corners[:, 1]]),
        albedo_texture=np.ascontiguousarray(shade),
    )
    recording.log("world/information", sheet, static=True)


def _log_obstacles(recording: rr.RecordingStream, mission: Mission) -> None:
    import rerun as rr

    solids = list(solids_in(mission))
    boxes = [solid for solid in solids if isinstance(solid, Box)]
    if boxes:
        shown = rr.Boxes3D(
            mins=[box.min_m for box in boxes],
            sizes=[box.max_m - box.min_m for box in boxes],
            colors=[_SOLID],
            fill_mode="solid",
        )
        recording.log("world/obstacles/boxes", shown, static=True)
    spheres = [solid for solid in solids if isinstance(solid, Sphere)]
    if spheres:
        shown = rr.Ellipsoids3D(
            centers=[sphere.center_m for sphere in spheres],
            half_sizes=[[sphere.radius_m] * 3 for sphere in spheres],
            colors=[_SOLID],
            fill_mode="solid",
        )
        recording.log("world/obstacles/spheres", shown, static=True)
    cylinders = [solid for solid in solids if isinstance(solid, Cylinder)]
    if cylinders:
        shown = rr.Cylinders3D(
            lengths=[cylinder.ceiling_m - cylinder.floor_m for cylinder in cylinders],
            radii=[cylinder.radius_m for cylinder in cylinders],
            centers=[[*cylinder.center_m, 0.5 * (cylinder.floor_m + cylinder.ceiling_m)] for cylinder in cylinders],
            colors=[_SOLID],
            fill_mode="solid",
        )
        recording.log("world/obstacles/cylinders", shown, static=True)
    for index, prism in enumerate(solid for solid in solids if isinstance(solid, Prism)):
        vertices, triangles = prism_mesh(prism)
        shown = rr.Mesh3D(vertex_positions=vertices, triangle_indices=triangles, albedo_factor=_SOLID)
        recording.log(f"world/obstacles/prism_{index}", shown, static=True)
    for index, grid in enumerate(solid for solid in solids if isinstance(solid, DistanceGrid)):
        places, cell_m = surface_of(grid)
        shown = rr.Points3D(places, radii=0.5 * cell_m, colors=[_SOLID])
        recording.log(f"world/obstacles/grid_{index}", shown, static=True)
    ground = ground_of(ObstacleField.of(solids))
    if ground is not None:
        vertices, triangles = ground_mesh(ground)
        shown = rr.Mesh3D(vertex_positions=vertices, triangle_indices=triangles, albedo_factor=_SOLID)
        recording.log("world/ground", shown, static=True)


def surface_of(grid: DistanceGrid) -> tuple[Float[np.ndarray, "node 3"], float]:
    """Nodes of a grid that are solid and have air beside them, and the distance between nodes."""
    solid = np.asarray(grid.values_m) <= 0.0
    skin = solid & ~binary_erosion(solid)
    return np.asarray(grid.low_m) + np.argwhere(skin) * np.asarray(grid.cell_m), float(np.max(grid.cell_m))


def ground_mesh(ground: HeightField) -> tuple[Float[np.ndarray, "vertex 3"], Int[np.ndarray, "triangle 3"]]:
    """The ground as triangles, two to each square of posts."""
    east, north = np.indices(ground.heights_m.shape)
    places = np.asarray(ground.low_m) + np.stack([east, north], axis=-1) * np.asarray(ground.post_m)
    number = np.arange(ground.heights_m.size).reshape(ground.heights_m.shape)
    corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    west, south, far, upper = (corner.ravel() for corner in corners)
    triangles = np.concatenate([np.column_stack([west, south, far]), np.column_stack([west, far, upper])])
    return np.concatenate([places, np.asarray(ground.heights_m)[..., None]], axis=-1).reshape(-1, 3), triangles


def prism_mesh(prism: Prism) -> tuple[Float[np.ndarray, "vertex 3"], Int[np.ndarray, "triangle 3"]]:
    """The walls and the roof of a prism as triangles; its underside is never seen."""
    import shapely

    corners = np.asarray(prism.polygon_m)
    count = len(corners)
    lower = np.column_stack([corners, np.full(count, prism.floor_m)])
    upper = np.column_stack([corners, np.full(count, prism.ceiling_m)])
    here, there = np.arange(count), (np.arange(count) + 1) % count
    walls = np.concatenate(
        [np.column_stack([here, there, count + there]), np.column_stack([here, count + there, count + here])]
    )
    pieces = shapely.constrained_delaunay_triangles(shapely.Polygon(corners))
    roof = np.array(
        [np.asarray(piece.exterior.coords)[:3] for piece in pieces.geoms if isinstance(piece, shapely.Polygon)]
    ).reshape(-1, 2)
    vertices = np.concatenate([lower, upper, np.column_stack([roof, np.full(len(roof), prism.ceiling_m)])])
    return vertices, np.concatenate([walls, 2 * count + np.arange(len(roof)).reshape(-1, 3)])


def _points_of(trajectory: Trajectory) -> Float[np.ndarray, "time 3"]:
    return trajectory.sample(np.linspace(trajectory.start_s, trajectory.end_s, _CURVE_SAMPLES)).position_m


def _log_candidates(recording: rr.RecordingStream, candidates: Sequence[Trajectory]) -> None:
    import rerun as rr

    for index, trajectory in enumerate(candidates):
        strip = rr.LineStrips3D([_points_of(trajectory)], colors=[_OTHER], radii=[-0.7])
        recording.log(f"world/candidates/{index:02d}", strip, static=True)


def _log_courses(recording: rr.RecordingStream, log: FlightLog) -> None:
    import rerun as rr

    for time_s, trajectory in log.courses:
        recording.set_time(TIMELINE, duration=time_s)
        recording.log("world/selected", rr.LineStrips3D([_points_of(trajectory)], colors=[_PLANNED], radii=[-1.2]))


def _log_flown(recording: rr.RecordingStream, log: FlightLog, problem: Problem) -> None:
    import rerun as rr

    if not len(log.time_s):
        return
    index = rr.TimeColumn(TIMELINE, duration=log.time_s)
    recording.log("world/flown", rr.Points3D.from_fields(colors=[_PATH], radii=[-1.8]), static=True)
    recording.send_columns("world/flown", indexes=[index], columns=rr.Points3D.columns(positions=log.position_m))
    recording.log("world/vehicle", rr.Points3D.from_fields(colors=[_PATH], radii=[-7.0]), static=True)
    recording.send_columns("world/vehicle", indexes=[index], columns=rr.Points3D.columns(positions=log.position_m))
    count = len(log.time_s)
    series = {
        "height": log.position_m[:, 2],
        "speed": np.linalg.norm(log.velocity_mps, axis=1),
        "speed_limit": np.full(count, problem.limits.max_speed_mps),
        "tracking_error": np.linalg.norm(log.position_m - log.target_m, axis=1),
        "battery": log.battery_fraction,
    }
    if not problem.obstacles.is_empty:
        series["clearance"] = problem.obstacles.distance(log.position_m) - problem.vehicle_radius_m
        series["margin"] = np.full(count, problem.clearance_margin_m)
    for name, values in series.items():
        told = np.isfinite(values)
        if told.any():
            recording.log(f"series/{name}", rr.SeriesLines(names=[name.replace("_", " ")]), static=True)
            recording.send_columns(
                f"series/{name}",
                indexes=[rr.TimeColumn(TIMELINE, duration=log.time_s[told])],
                columns=rr.Scalars.columns(scalars=values[told]),
            )


def _log_words(recording: rr.RecordingStream, log: FlightLog) -> None:
    import rerun as rr

    for event in log.events:
        if event["kind"] in _TEXT_KINDS:
            recording.set_time(TIMELINE, duration=event["t"])
            level = _TEXT_LEVEL[bool(event.get("warning", False))]
            recording.log("events", rr.TextLog(words_of(event), level=level))


def words_of(event: dict[str, object]) -> str:
    """An event of the log as a line a person can read."""
    match event["kind"]:
        case "phase":
            return f"{event['phase']}: {event['why']}"
        case "say":
            return str(event["text"])
        case "replan":
            verdict = "taken" if event["taken"] else "not taken"
            return f"replan {event['number']} {verdict}: {event['reason']} ({event['solve_s']} s)"
        case "order":
            return f"told to {event['command']}"
        case "answer":
            refused = f"refused: {event['reason']}"
            return f"{event['command']} {'accepted' if event['accepted'] else refused}"
        case "push":
            return f"pushed: {event['what']}"
        case "stall":
            return "the stream was not renewed in time and braked"
        case "course":
            return f"course {event['number']} from {event['start_s']:.1f} s on ({event['origin']})"
        case kind:
            return str(kind)
