"""plan.png: a picture a person can judge a plan by.

The map with the information, the obstacles and every candidate; altitude, speed and clearance over time against their
limits; and a row a candidate.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path as Outline

from mission.pictures.relief import Relief, ground_of, relief_of
from mission.site.fence import planned_fence
from mission.site.footprints import Footprint, footprints_of
from planner.plan import Candidate
from planner.trajectory import Samples, Trajectory

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

    from mission.mission_file import Mission
    from mission.planning import Planned
    from planner.problem import Problem

INK, SOFT, FAINT = "#1f2933", "#7b8794", "#cbd2d9"
PATH, LIMIT, LINE, GOOD = "#d9480f", "#c92a2a", "#1c4e80", "#2b8a3e"
INFORMATION = LinearSegmentedColormap.from_list("information", ["#ffffff", "#d3e6f0", "#8fbdd6", "#4a8fb5", "#236a93"])
TALL, LOW = "#52606d", "#b6bec8"

WIDTH_IN, MAP_IN, HEADING_IN, LEGEND_IN = 13.0, 7.1, 1.05, 1.0
SERIES_SAMPLES = 1500
MOST_ROWS = 12
LOGARITHMIC_FROM = 20.0
"""Where clearances reach this many margins, the small ones that matter are shown on a logarithmic axis."""
ARROWS = 14
NOSES = 120
STYLE: dict[RcKeyType, Any] = {
    "font.size": 9.0,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "text.color": INK,
    "legend.frameon": False,
}


def draw_plan(planned: Planned, path: Path) -> None:
    """Draws a plan, also one with nothing to fly.

    Args:
        planned: The plan.
        path: The PNG file to write.
    """
    east_m, north_m, _ = planned.problem.workspace.lengths_m
    body_in = float(np.clip(MAP_IN * north_m / east_m, 5.2, 8.5)) + LEGEND_IN
    table_in = 0.24 * (min(len(planned.plan.candidates), MOST_ROWS + 1) + 1)
    height_in = HEADING_IN + body_in + table_in + 0.65
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, height_in), dpi=130, facecolor="white")
        top, bottom = 1.0 - HEADING_IN / height_in, 1.0 - (HEADING_IN + body_in) / height_in
        legend = LEGEND_IN / height_in
        place = (0.055, bottom + legend, MAP_IN / WIDTH_IN, top - bottom - legend)
        _heading(figure, planned)
        _map(figure.add_axes(place), planned)
        grid = figure.add_gridspec(3, 1, left=0.66, right=0.985, top=top, bottom=bottom + 0.35 / height_in, hspace=0.45)
        axes = [figure.add_subplot(grid[row]) for row in range(3)]
        candidate = _shown(planned)
        curve = candidate.trajectory
        samples = curve.sample(np.linspace(curve.start_s, curve.end_s, SERIES_SAMPLES))
        _altitude(axes[0], planned, samples)
        _speed(axes[1], planned, samples)
        _clearance(axes[2], planned, samples)
        for axis in axes:
            axis.set_xlim(curve.start_s, curve.end_s)
            axis.margins(x=0.0)
        axes[2].set_xlabel("time [s]")
        _table(figure.add_axes((0.055, 0.12 / height_in, 0.93, table_in / height_in)), planned)
        figure.savefig(path)


def _shown(planned: Planned) -> Candidate:
    """The candidate in front: the selected one; where there is none, the one of the lowest cost."""
    plan = planned.plan
    if plan.selected is not None:
        return plan.best
    costs = [candidate.cost if np.isfinite(candidate.cost) else np.inf for candidate in plan.candidates]
    return plan.candidates[int(np.argmin(costs))]


def _heading(figure: Figure, planned: Planned) -> None:
    plan, candidate = planned.plan, _shown(planned)
    report = candidate.report
    if plan.selected is None:
        verdict, color = f"nothing to fly: {plan.status.value}", LIMIT
    else:
        ratio = candidate.ergodic_metric / plan.lawnmower_ergodic_metric
        length = f"{report.length_m / 1000.0:.2f} km" if report.length_m >= 2000.0 else f"{report.length_m:.1f} m"
        finds = "" if candidate.probability_found is None else f"finds with {candidate.probability_found:.2f}   ·   "
        verdict = (
            f"candidate {plan.selected} of {len(plan.candidates)}, grown from {candidate.seed_pattern}   ·   {finds}"
            f"ergodic metric {candidate.ergodic_metric:.3g}, {ratio:.2f} × that of a lawnmower of its length   ·   "
            f"{length} in {_duration(report.duration_s)}"
        )
        color = SOFT
    height = figure.get_figheight()
    figure.text(0.055, 1.0 - 0.38 / height, planned.mission.name, fontsize=15, fontweight="bold", va="center")
    figure.text(0.055, 1.0 - 0.66 / height, verdict, fontsize=9.5, color=color, va="center")


def _duration(seconds: float) -> str:
    return f"{int(seconds // 60)} min {seconds % 60:.0f} s" if seconds >= 120.0 else f"{seconds:.1f} s"


def draw_ground(axis: Axes, mission: Mission, problem: Problem) -> None:
    """What lies below every path: the information, the obstacles, the fence, in metres east and north."""
    low, high = problem.workspace.box_min_m, problem.workspace.box_max_m
    seen = problem.information.mass.sum(axis=2)
    axis.imshow(
        seen.T,
        origin="lower",
        extent=(low[0], high[0], low[1], high[1]),
        cmap=INFORMATION,
        vmin=0.0,
        vmax=_bright(seen),
        interpolation="bilinear",
        zorder=0,
    )
    relief = relief_of(problem)
    if relief is not None:
        _relief(axis, relief)
    for footprint in footprints_of(mission):
        _footprint(axis, footprint, float(low[2]), float(high[2]))
    fence = Polygon(planned_fence(mission.site), closed=True, fill=False, edgecolor=GOOD, linewidth=1.2)
    axis.add_patch(fence)
    pad = 0.02 * float(max(high[0] - low[0], high[1] - low[1]))
    axis.set_xlim(low[0] - pad, high[0] + pad)
    axis.set_ylim(low[1] - pad, high[1] + pad)
    axis.set_aspect("equal", anchor="NW")
    axis.set_xlabel("east [m]")
    axis.set_ylabel("north [m]")


def _map(axis: Axes, planned: Planned) -> None:
    plan = planned.plan
    draw_ground(axis, planned.mission, planned.problem)
    front = _shown(planned)
    for candidate in plan.candidates:
        if candidate is not front:
            curve = candidate.trajectory
            line = curve.sample(np.linspace(curve.start_s, curve.end_s, SERIES_SAMPLES)).position_m
            style = "-" if candidate.feasible else (0, (2, 2))
            axis.plot(*line[:, :2].T, linestyle=style, color=SOFT, linewidth=0.6, alpha=0.65, zorder=3)
    curve = front.trajectory
    samples = curve.sample(np.linspace(curve.start_s, curve.end_s, 4 * SERIES_SAMPLES))
    axis.plot(samples.position_m[:, 0], samples.position_m[:, 1], color="white", linewidth=2.8, alpha=0.7, zorder=4)
    axis.plot(samples.position_m[:, 0], samples.position_m[:, 1], color=PATH, linewidth=1.5, zorder=5)
    _arrows(axis, samples)
    _noses(axis, curve)
    start, end = samples.position_m[0], samples.position_m[-1]
    axis.plot(*start[:2], "o", color="white", markeredgecolor=INK, markersize=7.5, markeredgewidth=1.4, zorder=8)
    axis.plot(*end[:2], "s", color=INK, markeredgecolor="white", markersize=5.0, markeredgewidth=0.8, zorder=9)
    _legend(axis, planned)


def _bright(seen: np.ndarray) -> float:
    """Upper end of the colour scale: extreme cells must not turn the rest white, nor an even field dark."""
    return float(max(np.quantile(seen, 0.995), 4.0 * seen.mean()))


def _relief(axis: Axes, relief: Relief) -> None:
    """Measured obstacles as areas, and the ground as lines of equal height."""
    for solid, color in ((relief.somewhere, LOW), (relief.everywhere, TALL)):
        if solid.any():
            axis.contourf(relief.east_m, relief.north_m, solid, levels=[0.5, 1.5], colors=[color], zorder=2)
    if relief.ground_m is not None and np.ptp(relief.ground_m) > 0.0:
        lines = axis.contour(
            relief.east_m, relief.north_m, relief.ground_m, levels=8, colors=[INK], linewidths=0.5, alpha=0.5, zorder=2
        )
        axis.clabel(lines, fontsize=6, fmt="%g m")


def _footprint(axis: Axes, footprint: Footprint, floor_m: float, ceiling_m: float) -> None:
    """The outline of an obstacle; darker where it cannot be flown over, nothing where it ends below the box."""
    if footprint.ceiling_m <= floor_m or footprint.floor_m >= ceiling_m:
        return
    through = footprint.ceiling_m >= ceiling_m and footprint.floor_m <= floor_m
    outline = Outline(np.vstack([footprint.polygon_m, footprint.polygon_m[:1]]), closed=True)
    if footprint.no_fly:
        patch = PathPatch(outline, facecolor="none", edgecolor=LIMIT, linewidth=0.9, hatch="////", alpha=0.8, zorder=2)
    else:
        patch = PathPatch(outline, facecolor=TALL if through else LOW, edgecolor="white", linewidth=0.5, zorder=2)
    axis.add_patch(patch)


def _arrows(axis: Axes, samples: Samples) -> None:
    """Arrow heads at equal distances along the path."""
    position = samples.position_m[:, :2]
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    for wanted in (np.arange(ARROWS) + 0.5) / ARROWS * travelled[-1]:
        index = int(np.searchsorted(travelled, wanted))
        before, after = position[max(index - 3, 0)], position[min(index + 3, len(position) - 1)]
        if np.linalg.norm(after - before) > 0.0:
            axis.annotate(
                "",
                xy=tuple(after),
                xytext=tuple(before),
                arrowprops={"arrowstyle": "-|>", "color": PATH, "linewidth": 0.0, "mutation_scale": 13.0},
                zorder=6,
            )


def _noses(axis: Axes, curve: Trajectory) -> None:
    """Strokes from the path to where the nose points, where that was planned with it."""
    time_s = np.linspace(curve.start_s, curve.end_s, NOSES)
    heading = curve.headings_at(time_s)
    if heading is None:
        return
    east, north = curve.sample(time_s).position_m[:, :2].T
    strokes: dict[str, Any] = {"headwidth": 0.0, "headlength": 0.0, "headaxislength": 0.0, "scale": 55.0}
    axis.quiver(east, north, np.cos(heading), np.sin(heading), color=INK, width=0.002, zorder=6, **strokes)


def _legend(axis: Axes, planned: Planned) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries = [
        Line2D([], [], color=PATH, linewidth=1.8, label="selected" if planned.plan.selected is not None else "refused"),
        Line2D([], [], color=SOFT, linewidth=0.8, alpha=0.8, label="other candidates"),
        Line2D([], [], marker="o", color="white", markeredgecolor=INK, markersize=7, linestyle="", label="start"),
        Line2D([], [], marker="s", color=INK, markersize=5, linestyle="", label="end"),
        Line2D([], [], color=GOOD, linewidth=1.2, label="fence"),
        Patch(facecolor=INFORMATION(0.75), label="information"),
    ]
    if planned.options.explores_headings:
        entries.insert(1, Line2D([], [], color=INK, linewidth=1.2, label="where it looks"))
    footprints = footprints_of(planned.mission)
    low, high = planned.problem.workspace.box_min_m[2], planned.problem.workspace.box_max_m[2]
    inside = [f for f in footprints if f.ceiling_m > low and f.floor_m < high]
    relief = relief_of(planned.problem)
    through = relief is not None and relief.everywhere.any()
    partly = relief is not None and (relief.somewhere & ~relief.everywhere).any()
    if through or any(not f.no_fly and f.ceiling_m >= high and f.floor_m <= low for f in inside):
        entries.append(Patch(facecolor=TALL, label="obstacle, full height"))
    if partly or any(not f.no_fly and (f.ceiling_m < high or f.floor_m > low) for f in inside):
        entries.append(Patch(facecolor=LOW, label="obstacle, flown over or under"))
    if relief is not None and relief.ground_m is not None:
        entries.append(Line2D([], [], color=INK, linewidth=0.6, alpha=0.6, label="height of the ground"))
    if any(f.no_fly for f in inside):
        entries.append(Patch(facecolor="none", edgecolor=LIMIT, hatch="////", label="no-fly"))
    axis.legend(
        handles=entries,
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        ncols=5,
        fontsize=8,
        handlelength=1.6,
        columnspacing=1.3,
        borderaxespad=5.0,
        labelcolor=INK,
    )


def draw_limit(axis: Axes, value: float, label: str, above: bool = True) -> None:
    """A limit across a time series, with its name."""
    axis.axhline(value, color=LIMIT, linewidth=1.0, linestyle=(0, (5, 3)), zorder=2)
    axis.annotate(
        label,
        xy=(1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(-2, 3 if above else -3),
        textcoords="offset points",
        ha="right",
        va="bottom" if above else "top",
        fontsize=8,
        color=LIMIT,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
        zorder=6,
    )


def _altitude(axis: Axes, planned: Planned, samples: Samples) -> None:
    low, high = planned.problem.workspace.box_min_m[2], planned.problem.workspace.box_max_m[2]
    axis.plot(samples.time_s, samples.position_m[:, 2], color=LINE, linewidth=1.3, zorder=3)
    ground = ground_of(planned.problem.obstacles)
    if ground is not None:
        below = np.asarray(ground.height_at(samples.position_m[:, :2]))
        axis.fill_between(samples.time_s, low - (high - low), below, color=TALL, alpha=0.45, linewidth=0.0, zorder=1)
        for kept in planned.problem.obstacles.span_m(samples.position_m[:, :2], planned.problem.keep_out_m):
            if np.isfinite(kept).all():
                axis.plot(samples.time_s, kept, color=LIMIT, linewidth=0.8, linestyle=(0, (5, 3)), zorder=2)
    draw_limit(axis, float(high), f"ceiling {high:g} m")
    draw_limit(axis, float(low), f"floor {low:g} m", above=False)
    room = 0.18 * (high - low)
    axis.set_ylim(low - room, high + room)
    axis.set_title("height above the origin [m]")


def _speed(axis: Axes, planned: Planned, samples: Samples) -> None:
    limit = planned.problem.limits.max_speed_mps
    speed = np.linalg.norm(samples.velocity_mps, axis=1)
    axis.plot(samples.time_s, speed, color=LINE, linewidth=1.3, zorder=3)
    draw_limit(axis, limit, f"limit {limit:g} m/s")
    axis.set_ylim(0.0, 1.2 * max(limit, float(speed.max())))
    axis.set_title("speed [m/s]")


def _clearance(axis: Axes, planned: Planned, samples: Samples) -> None:
    problem = planned.problem
    axis.set_title("clearance of the hull to the nearest obstacle [m]")
    if problem.obstacles.is_empty:
        axis.text(0.5, 0.5, "no obstacles", transform=axis.transAxes, ha="center", va="center", color=SOFT)
        axis.set_yticks([])
        return
    clearance = problem.obstacles.distance(samples.position_m) - problem.vehicle_radius_m
    margin = problem.clearance_margin_m
    least, top = float(clearance.min()), max(float(np.quantile(clearance, 0.9)), 4.0 * margin)
    axis.plot(samples.time_s, clearance, color=LINE, linewidth=1.3, zorder=3)
    axis.fill_between(samples.time_s, 0.0, margin, color=LIMIT, alpha=0.07, linewidth=0.0, zorder=1)
    draw_limit(axis, margin, f"margin {margin:g} m")
    if least > 0.0 < margin and top > LOGARITHMIC_FROM * margin:
        axis.set_yscale("log")
        axis.set_ylim(0.4 * min(margin, least), 1.5 * float(clearance.max()))
        axis.yaxis.set_major_formatter("{x:g}")
    else:
        axis.set_ylim(min(0.0, 1.1 * least), max(top, 1.2 * least))


def _table(axis: Axes, planned: Planned) -> None:
    plan = planned.plan
    axis.set_axis_off()
    order = sorted(
        range(len(plan.candidates)), key=lambda i: (not plan.candidates[i].feasible, plan.candidates[i].cost)
    )
    shown = order[:MOST_ROWS]
    columns = (
        (0.0, "left", "candidate"),
        (0.075, "left", "grown from"),
        (0.27, "right", "ergodic metric"),
        (0.35, "right", "cost"),
        (0.43, "right", "length [m]"),
        (0.515, "right", "clearance [m]"),
        (0.60, "right", "speed [m/s]"),
        (0.63, "left", "gate"),
    )
    lines = len(shown) + 1 + (len(order) > len(shown))
    for line in range(lines):
        height = 1.0 - (line + 0.5) / lines
        if line == 0:
            for place, align, name in columns:
                axis.text(place, height, name, ha=align, va="center", fontsize=8.5, color=SOFT)
            axis.axhline(1.0 - 1.0 / lines, color=FAINT, linewidth=0.8)
            continue
        if line > len(shown):
            axis.text(0.0, height, f"… and {len(order) - len(shown)} more", va="center", fontsize=8.5, color=SOFT)
            continue
        index = shown[line - 1]
        candidate, report = plan.candidates[index], plan.candidates[index].report
        gate = "passed" if candidate.feasible else _shortened(report.violations[0].text, 62)
        cells = (
            str(index),
            candidate.seed_pattern,
            f"{candidate.ergodic_metric:.4g}",
            f"{candidate.cost:.4g}",
            f"{report.length_m:.1f}",
            f"{report.min_clearance_m:.2f}" if np.isfinite(report.min_clearance_m) else "–",
            f"{report.max_speed_mps:.2f}",
            gate,
        )
        is_selected = index == plan.selected
        if is_selected:
            axis.axhspan(height - 0.5 / lines, height + 0.5 / lines, color=PATH, alpha=0.10, linewidth=0.0)
        for (place, align, name), text in zip(columns, cells, strict=True):
            color = (GOOD if candidate.feasible else LIMIT) if name == "gate" else INK
            weight = "bold" if is_selected else "normal"
            axis.text(place, height, text, ha=align, va="center", fontsize=8.5, color=color, fontweight=weight)
    axis.set_xlim(-0.008, 1.0)
    axis.set_ylim(0.0, 1.0)


def _shortened(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
