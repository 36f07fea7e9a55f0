"""flight.png: what was flown, over what was looked for, and how well it kept to what was proven.

The map with the flown path, the courses it followed and where new plans took over; heights, speed, clearance, distance
from the course and battery over time, shaded where it was not exploring.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mission.flying.flight_log import EXPLORING, FlightLog
from mission.mission_file import Mission
from mission.pictures.ground_map import (
    draw_ground,
    draw_legend,
    draw_swath,
    ground_entries,
    swath_entry,
    swath_radius_m,
)
from mission.pictures.path_drawing import draw_by_height, draw_side_view, is_tall
from mission.pictures.relief import ground_of
from mission.pictures.series import (
    draw_clearance,
    draw_height,
    draw_height_above_ground,
    draw_limit,
    height_entries,
    solid_of,
    stacked,
)
from mission.pictures.style import (
    FAINT,
    HEADING_IN,
    INK,
    LIMIT,
    LINE,
    MAP_IN,
    MAP_LEFT,
    PATH,
    SOFT,
    STYLE,
    WIDTH_IN,
    distance,
    duration,
    fitted,
)
from planner.problem import Problem

FOOT_IN, ROW_IN = 1.3, 1.45
_CURVE_SAMPLES = 3000
_MOST_POINTS = 6000
_GAP_S = 2.0
_ALOFT = ("taking off", "landed")


def draw_flight(log: FlightLog, mission: Mission, problem: Problem, summary: dict[str, Any], path: Path) -> None:
    """Draw a flight.

    Args:
        log: What was flown.
        mission: What was asked, with what was pushed.
        problem: The same for the planner.
        summary: What it came to.
        path: The PNG file to write.
    """
    east_m, north_m, _ = problem.workspace.lengths_m
    panels = _panels(log, problem)
    map_in = float(np.clip(MAP_IN * north_m / east_m, 4.0, 8.5))
    body_in = max(map_in + FOOT_IN, ROW_IN * (len(panels) + ("side view" in panels)))
    height_in = HEADING_IN + body_in + 0.2
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, height_in), dpi=130, facecolor="white")
        top, bottom = 1.0 - HEADING_IN / height_in, 0.2 / height_in
        _heading(figure, log, problem, summary)
        foot = FOOT_IN / height_in
        _map(figure.add_axes((MAP_LEFT, bottom + foot, MAP_IN / WIDTH_IN, top - bottom - foot)), log, mission, problem)
        axes = stacked(figure, panels, top, bottom + 0.4 / height_in)
        if "side view" in axes:
            draw_side_view(axes.pop("side view"), _exploring_only(log), problem)
        draw_series(axes, log, mission, problem)
        figure.savefig(path)


def _heading(figure: Figure, log: FlightLog, problem: Problem, summary: dict[str, Any]) -> None:
    height = figure.get_figheight()
    outcome = str(summary.get("outcome", "not finished"))
    error = summary.get("tracking_error_mean_m")
    parts = [f"{distance(summary['length_m'])} in {duration(summary['flown_s'])}"]
    if summary.get("probability_found") is not None:
        parts.append(f"found with probability {summary['probability_found']:.2f}")
    if summary["replans_asked"]:
        parts.append(f"{summary['replans_taken']} of {summary['replans_asked']} replans taken")
    if error is not None:
        parts.append(f"{error:.2f} m from the course on average")
    if summary["min_clearance_m"] is not None:
        to = "nearest obstacle or height limit" if problem.obstacles.has_height_limits else "clearance at least"
        parts.append(f"{to} {summary['min_clearance_m']:.2f} m")
    broken = summary["violations"]
    room_in = 0.93 * WIDTH_IN
    name = fitted(str(log.header.get("name", "")), room_in, 15.0, "bold")
    figure.text(MAP_LEFT, 1.0 - 0.38 / height, name, fontsize=15, fontweight="bold", va="center")
    text = f"{outcome}   ·   " + "   ·   ".join(parts)
    figure.text(MAP_LEFT, 1.0 - 0.66 / height, fitted(text, room_in, 9.5), fontsize=9.5, color=SOFT, va="center")
    if broken:
        text = fitted("broken: " + "; ".join(broken), room_in, 9.5)
        figure.text(MAP_LEFT, 1.0 - 0.88 / height, text, fontsize=9.5, color=LIMIT, va="center")


def _map(axis: Axes, log: FlightLog, mission: Mission, problem: Problem) -> None:
    draw_ground(axis, mission, problem)
    exploring, position = log.exploring(), log.position_m
    for index, (_, trajectory) in enumerate(log.courses):
        ends = log.courses[index + 1][1].start_s if index + 1 < len(log.courses) else trajectory.end_s
        shown = trajectory.sample(np.linspace(trajectory.start_s, min(ends, trajectory.end_s), _CURVE_SAMPLES))
        axis.plot(*shown.position_m[:, :2].T, color=LINE, linewidth=0.8, linestyle=(0, (3, 2)), zorder=4)
        if index:
            place = trajectory.motion_at(trajectory.start_s).position_m
            axis.plot(
                *place[:2], "D", color=LINE, markeredgecolor="white", markersize=4.0, markeredgewidth=0.6, zorder=7
            )
    there = _thinned(position[~exploring])
    axis.plot(there[:, 0], there[:, 1], ".", color=SOFT, markersize=1.2, alpha=0.6, zorder=3)
    pieces = _pieces(position, exploring)
    if is_tall(problem) and pieces:
        draw_by_height(axis, _exploring_only(log), 1.8)
    for piece in [] if is_tall(problem) else pieces:
        axis.plot(piece[:, 0], piece[:, 1], color=PATH, linewidth=1.5, zorder=5)
    home = mission.home_enu_m
    axis.plot(*home[:2], "o", color="white", markeredgecolor=INK, markersize=7.5, markeredgewidth=1.4, zorder=8)
    if len(position):
        axis.plot(*position[-1, :2], "s", color=INK, markeredgecolor="white", markersize=5.0, zorder=9)
        _widen(axis, position)
    entries = [
        Line2D([], [], color=PATH, linewidth=1.8, label="flown, exploring"),
        Line2D([], [], color=SOFT, marker=".", linestyle="", label="flown, there and back"),
        Line2D([], [], color=LINE, linewidth=0.8, linestyle=(0, (3, 2)), label="course"),
        Line2D([], [], marker="o", color="white", markeredgecolor=INK, markersize=7, linestyle="", label="home"),
        Line2D([], [], marker="s", color=INK, markersize=5, linestyle="", label="end"),
        Patch(facecolor=FAINT, alpha=0.4, label="time not exploring"),
    ]
    if len(log.courses) > 1:
        entries.append(
            Line2D([], [], marker="D", color=LINE, markersize=4, linestyle="", label="a new plan takes over")
        )
    radius_m = swath_radius_m(mission)
    if radius_m is not None:
        draw_swath(axis, [piece[:, :2] for piece in pieces if len(piece) > 1], radius_m)
        entries.append(swath_entry(radius_m))
    draw_legend(axis, [*entries, *ground_entries(mission, problem), *height_entries(problem)])


def _widen(axis: Axes, position_m: np.ndarray) -> None:
    """Let everything that was flown be seen, also beside the box."""
    for axis_index, (get, put) in enumerate(((axis.get_xlim, axis.set_xlim), (axis.get_ylim, axis.set_ylim))):
        low, high = get()
        flown = position_m[:, axis_index]
        pad = 0.02 * (high - low)
        put(min(low, float(flown.min()) - pad), max(high, float(flown.max()) + pad))


def _thinned(points: np.ndarray) -> np.ndarray:
    return points[:: max(1, len(points) // _MOST_POINTS)]


def _exploring_only(log: FlightLog) -> np.ndarray:
    """Positions in order, NaN where it was not exploring."""
    return _thinned(np.where(log.exploring()[:, None], log.position_m, np.nan))


def _pieces(position_m: np.ndarray, keep: np.ndarray) -> list[np.ndarray]:
    """Runs of positions that belong together."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], keep, [False]]).astype(int)))
    return [_thinned(position_m[first:last]) for first, last in zip(edges[::2], edges[1::2], strict=True)]


def _panels(log: FlightLog, problem: Problem) -> list[str]:
    """What is drawn over time: what there is nothing to say of is left out."""
    told = np.isfinite(log.target_m).all(axis=1).any()
    wanted = {
        "side view": is_tall(problem) and bool(log.exploring().any()),
        "height": True,
        "above ground": ground_of(problem.obstacles) is not None,
        "speed": True,
        "off course": bool(told),
        "battery": bool(np.isfinite(log.battery_fraction).any()),
        "clearance": not solid_of(problem.obstacles).is_empty,
    }
    return [name for name, there in wanted.items() if there]


def draw_series(axes: dict[str, Axes], log: FlightLog, mission: Mission, problem: Problem) -> None:
    """Heights, speed, distance from the course, battery and clearance over time."""
    time_s, position = log.time_s, log.position_m
    if not len(time_s):
        return
    # A resumed flight has a gap in it, which no line may bridge.
    time_s = np.where(np.diff(time_s, prepend=time_s[0]) > _GAP_S, np.nan, time_s)
    draw_height(axes["height"], time_s, position, problem)
    if "above ground" in axes:
        draw_height_above_ground(axes["above ground"], time_s, position, problem)
    _speed(axes["speed"], time_s, np.linalg.norm(log.velocity_mps, axis=1), mission, problem)
    if "off course" in axes:
        axis, error = axes["off course"], np.linalg.norm(position - log.target_m, axis=1)
        axis.plot(time_s, error, color=LINE, linewidth=1.1, zorder=3)
        axis.set_ylim(0.0, 1.2 * max(0.1, float(np.nanmax(error))))
        axis.set_title("distance from the course [m]")
    if "battery" in axes:
        axes["battery"].plot(time_s, 100.0 * log.battery_fraction, color=LINE, linewidth=1.1, zorder=3)
        axes["battery"].set_ylim(0.0, 105.0)
        axes["battery"].set_title("battery [%]")
    if "clearance" in axes:
        # On its way up and down a vehicle is near the ground, and nothing is held against it there.
        solid = solid_of(problem.obstacles)
        counts = log.exploring() if solid.surfaces else log.armed
        away = np.asarray(solid.distance(position)) - problem.vehicle_radius_m
        draw_clearance(axes["clearance"], time_s, away, problem, counts)
    aloft = [t for t, phase in zip(log.time_s, log.phase, strict=True) if phase == _ALOFT[0]]
    begin_s = aloft[0] if aloft else float(log.time_s[0])
    # A flight that was broken off at once still has an axis of time.
    end_s = max(float(log.time_s[-1]), begin_s + 1.0)
    *_, last = axes.values()
    for axis in axes.values():
        axis.set_xlim(begin_s, end_s)
        axis.tick_params(labelbottom=axis is last)
        _shade_phases(axis, log)
    last.set_xlabel("flight clock [s]")


def _speed(axis: Axes, time_s: np.ndarray, speed_mps: np.ndarray, mission: Mission, problem: Problem) -> None:
    """Speed with the vehicle's limit, which counts in flight, and what plans leave of it."""
    limit_mps, planned_mps = mission.vehicle.max_speed_mps, problem.limits.max_speed_mps
    axis.plot(time_s, speed_mps, color=LINE, linewidth=1.1, zorder=3)
    draw_limit(axis, limit_mps, f"vehicle's limit\n{limit_mps:.3g} m/s", side="above")
    if planned_mps < limit_mps:
        draw_limit(axis, planned_mps, f"planned up to\n{planned_mps:.3g} m/s", side="below", color=SOFT)
    axis.set_ylim(0.0, 1.2 * max(limit_mps, float(speed_mps.max())))
    axis.set_title("speed [m/s]")


def _shade_phases(axis: Axes, log: FlightLog) -> None:
    """Everything but the exploration is shaded."""
    for event, after in zip(log.of_kind("phase"), [*log.of_kind("phase")[1:], None], strict=True):
        until_s = float(log.time_s[-1]) if after is None else after["t"]
        if event["phase"] not in EXPLORING and until_s > event["t"]:
            axis.axvspan(event["t"], until_s, color=FAINT, alpha=0.25, linewidth=0.0, zorder=0)
