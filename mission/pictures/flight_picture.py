"""flight.png: what was flown, over what was looked for, and how well it kept to what was proven.

The map with the flown path, the courses it followed and where new plans took over; height, speed, clearance, distance
from the course and battery over time, with the phases of the flight behind them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mission.flying.flight_log import EXPLORING, FlightLog
from mission.flying.summary import clearance_m
from mission.mission_file import Mission
from mission.pictures.picture import FAINT, GOOD, INK, LIMIT, LINE, PATH, SOFT, STYLE, draw_ground, draw_limit
from planner.problem import Problem

WIDTH_IN, MAP_IN, HEADING_IN, FOOT_IN = 13.0, 7.1, 1.05, 0.75
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
    body_in = float(np.clip(MAP_IN * north_m / east_m, 6.0, 8.5)) + FOOT_IN
    height_in = HEADING_IN + body_in + 0.2
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, height_in), dpi=130, facecolor="white")
        top, bottom = 1.0 - HEADING_IN / height_in, 0.2 / height_in
        _heading(figure, log, summary)
        foot = FOOT_IN / height_in
        _map(figure.add_axes((0.055, bottom + foot, MAP_IN / WIDTH_IN, top - bottom - foot)), log, mission, problem)
        rows = 5 if not problem.obstacles.is_empty else 4
        grid = figure.add_gridspec(rows, 1, left=0.66, right=0.985, top=top, bottom=bottom + 0.04, hspace=0.5)
        draw_series([figure.add_subplot(grid[row]) for row in range(rows)], log, problem)
        figure.savefig(path)


def _heading(figure: Figure, log: FlightLog, summary: dict[str, Any]) -> None:
    height = figure.get_figheight()
    outcome = str(summary.get("outcome", "not finished"))
    error = summary.get("tracking_error_mean_m")
    parts = [
        f"{summary['length_m'] / 1000.0:.2f} km in {summary['flown_s'] / 60.0:.1f} min",
        f"{summary['replans_taken']} of {summary['replans_asked']} replans taken",
    ]
    if error is not None:
        parts.append(f"{error:.2f} m from the course on average")
    if summary["min_clearance_m"] is not None:
        parts.append(f"clearance at least {summary['min_clearance_m']:.2f} m")
    broken = summary["violations"]
    figure.text(
        0.055, 1.0 - 0.38 / height, str(log.header.get("name", "")), fontsize=15, fontweight="bold", va="center"
    )
    text = f"{outcome}   ·   " + "   ·   ".join(parts)
    figure.text(0.055, 1.0 - 0.66 / height, text, fontsize=9.5, color=SOFT, va="center")
    if broken:
        figure.text(0.055, 1.0 - 0.88 / height, "broken: " + "; ".join(broken), fontsize=9.5, color=LIMIT, va="center")


def _map(axis: Axes, log: FlightLog, mission: Mission, problem: Problem) -> None:
    from matplotlib.lines import Line2D

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
    for piece in _pieces(position, exploring):
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
        Line2D([], [], marker="D", color=LINE, markersize=4, linestyle="", label="a new plan takes over"),
        Line2D([], [], marker="o", color="white", markeredgecolor=INK, markersize=7, linestyle="", label="home"),
        Line2D([], [], marker="s", color=INK, markersize=5, linestyle="", label="end"),
        Line2D([], [], color=GOOD, linewidth=1.2, label="box"),
    ]
    axis.legend(
        handles=entries,
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        ncols=4,
        fontsize=8,
        columnspacing=1.3,
        borderaxespad=4.5,
        labelcolor=INK,
    )


def _widen(axis: Axes, position_m: np.ndarray) -> None:
    """Let everything that was flown be seen, also beside the box."""
    for axis_index, (get, put) in enumerate(((axis.get_xlim, axis.set_xlim), (axis.get_ylim, axis.set_ylim))):
        low, high = get()
        flown = position_m[:, axis_index]
        pad = 0.02 * (high - low)
        put(min(low, float(flown.min()) - pad), max(high, float(flown.max()) + pad))


def _thinned(points: np.ndarray) -> np.ndarray:
    return points[:: max(1, len(points) // _MOST_POINTS)]


def _pieces(position_m: np.ndarray, keep: np.ndarray) -> list[np.ndarray]:
    """Runs of positions that belong together."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], keep, [False]]).astype(int)))
    return [_thinned(position_m[first:last]) for first, last in zip(edges[::2], edges[1::2], strict=True)]


def draw_series(axes: Sequence[Axes], log: FlightLog, problem: Problem) -> None:
    """Height, speed, distance from the course, battery, and clearance where there is something to keep away from."""
    time_s = log.time_s
    if not len(time_s):
        return
    # A resumed flight has a gap in it, which no line may bridge.
    time_s = np.where(np.diff(time_s, prepend=time_s[0]) > _GAP_S, np.nan, time_s)
    low, high = problem.workspace.box_min_m[2], problem.workspace.box_max_m[2]
    speed = np.linalg.norm(log.velocity_mps, axis=1)
    error = np.linalg.norm(log.position_m - log.target_m, axis=1)
    axes[0].plot(time_s, log.position_m[:, 2], color=LINE, linewidth=1.1, zorder=3)
    draw_limit(axes[0], float(high), f"ceiling {high:g} m")
    draw_limit(axes[0], float(low), f"floor {low:g} m", above=False)
    axes[0].set_ylim(min(0.0, float(log.position_m[:, 2].min())), 1.25 * max(high, float(log.position_m[:, 2].max())))
    axes[0].set_title("height above the origin [m]")
    limit = problem.limits.max_speed_mps
    axes[1].plot(time_s, speed, color=LINE, linewidth=1.1, zorder=3)
    draw_limit(axes[1], limit, f"limit {limit:g} m/s")
    axes[1].set_ylim(0.0, 1.25 * max(limit, float(speed.max())))
    axes[1].set_title("speed [m/s]")
    axes[2].plot(time_s, error, color=LINE, linewidth=1.1, zorder=3)
    told = error[np.isfinite(error)]
    axes[2].set_ylim(0.0, 1.2 * max(0.1, float(told.max()) if len(told) else 0.1))
    axes[2].set_title("distance from the course [m]")
    axes[3].plot(time_s, 100.0 * log.battery_fraction, color=LINE, linewidth=1.1, zorder=3)
    axes[3].set_ylim(0.0, 105.0)
    axes[3].set_title("battery [%]")
    if len(axes) > 4:
        _clearance(axes[4], log, problem)
    aloft = [t for t, phase in zip(log.time_s, log.phase, strict=True) if phase == _ALOFT[0]]
    begin_s = aloft[0] if aloft else float(log.time_s[0])
    for axis in axes:
        axis.set_xlim(begin_s, float(log.time_s[-1]))
        axis.tick_params(labelbottom=axis is axes[-1])
        _shade_phases(axis, log)
    axes[-1].set_xlabel("flight time [s]")


def _clearance(axis: Axes, log: FlightLog, problem: Problem) -> None:
    clearance = clearance_m(log, problem)
    margin = problem.clearance_margin_m
    axis.plot(log.time_s, clearance, color=LINE, linewidth=1.1, zorder=3)
    axis.fill_between(log.time_s, 0.0, margin, color=LIMIT, alpha=0.07, linewidth=0.0, zorder=1)
    draw_limit(axis, margin, f"margin {margin:g} m")
    top = max(float(np.quantile(clearance, 0.9)), 4.0 * margin, 1.2 * float(clearance.min()))
    axis.set_ylim(min(0.0, 1.1 * float(clearance.min())), top)
    axis.set_title("clearance of the hull to the nearest obstacle [m]")


def _shade_phases(axis: Axes, log: FlightLog) -> None:
    """Everything but the exploration is shaded."""
    for event, after in zip(log.of_kind("phase"), [*log.of_kind("phase")[1:], None], strict=True):
        until_s = float(log.time_s[-1]) if after is None else after["t"]
        if event["phase"] not in EXPLORING and until_s > event["t"]:
            axis.axvspan(event["t"], until_s, color=FAINT, alpha=0.25, linewidth=0.0, zorder=0)
