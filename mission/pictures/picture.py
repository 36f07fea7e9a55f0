"""plan.png: a picture a person can judge a plan by.

The map with the information, the obstacles and the candidates; altitude, speed and clearance over time against their
limits, what is tall from the side as well; and a row a candidate.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mission.pictures.ground_map import (
    draw_ground,
    draw_legend,
    draw_swath,
    ground_entries,
    swath_entry,
    swath_radius_m,
)
from mission.pictures.path_drawing import draw_arrows, draw_by_height, draw_noses, draw_side_view, is_tall
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
    GOOD,
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
from planner.plan import Candidate, Plan
from planner.trajectory import Samples

if TYPE_CHECKING:
    from mission.planning import Planned
    from planner.problem import Problem

LEGEND_IN, GATE_IN = 1.35, 4.4
SAMPLES, OTHERS_SAMPLES = 6000, 1500
MOST_ROWS = 12
MOST_OTHERS = 24
"""Candidates drawn beside the selected one: more hide the map."""
ARROWS = 14
NOSES = 80


def draw_plan(planned: Planned, path: Path) -> None:
    """Draws a plan, also one with nothing to fly.

    Args:
        planned: The plan.
        path: The PNG file to write.
    """
    east_m, north_m, _ = planned.problem.workspace.lengths_m
    candidate = _shown(planned)
    curve = candidate.trajectory
    samples = curve.sample(np.linspace(curve.start_s, curve.end_s, SAMPLES))
    panels = _panels(planned.problem)
    body_in = float(np.clip(MAP_IN * north_m / east_m, 5.2 if len(panels) <= 3 else 6.2, 8.5)) + LEGEND_IN
    table_in = 0.24 * (min(len(planned.plan.candidates), MOST_ROWS + 1) + 1)
    height_in = HEADING_IN + body_in + table_in + 0.65
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_IN, height_in), dpi=130, facecolor="white")
        top, bottom = 1.0 - HEADING_IN / height_in, 1.0 - (HEADING_IN + body_in) / height_in
        legend = LEGEND_IN / height_in
        place = (MAP_LEFT, bottom + legend, MAP_IN / WIDTH_IN, top - bottom - legend)
        _heading(figure, planned)
        _map(figure.add_axes(place), planned)
        axes = stacked(figure, panels, top, bottom + 0.35 / height_in)
        if "side view" in axes:
            draw_side_view(axes.pop("side view"), samples.position_m, planned.problem)
        _series(axes, planned.problem, samples)
        _table(figure.add_axes((MAP_LEFT, 0.12 / height_in, 0.93, table_in / height_in)), planned)
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
        verdict = (
            f"candidate {plan.selected}, one of {len(plan.candidates)}, grown from {candidate.seed_pattern}   ·   "
            f"{_worth(plan)}   ·   {distance(report.length_m)} in {duration(report.duration_s)}"
        )
        color = SOFT
    height = figure.get_figheight()
    name = fitted(planned.mission.name, 0.93 * WIDTH_IN, 15.0, "bold")
    figure.text(MAP_LEFT, 1.0 - 0.38 / height, name, fontsize=15, fontweight="bold", va="center")
    figure.text(MAP_LEFT, 1.0 - 0.66 / height, verdict, fontsize=9.5, color=color, va="center")


def _worth(plan: Plan) -> str:
    """What the selected path is worth beside the lawnmower of its length."""
    found, by_lawnmower = plan.best.probability_found, plan.lawnmower_probability_found
    if found is not None and by_lawnmower is not None:
        return f"finds with probability {found:.2f}, a lawnmower of its length with {by_lawnmower:.2f}"
    ratio = plan.best.ergodic_metric / plan.lawnmower_ergodic_metric
    return f"ergodic metric {plan.best.ergodic_metric:.3g}, {ratio:.2f} × that of a lawnmower of its length"


def _map(axis: Axes, planned: Planned) -> None:
    front = _shown(planned)
    tall = is_tall(planned.problem)
    draw_ground(axis, planned.mission, planned.problem)
    entries = [
        Line2D([], [], color=PATH, linewidth=1.8, label="selected" if planned.plan.selected is not None else "refused"),
    ]
    others = [
        planned.plan.candidates[index] for index in _ranked(planned) if planned.plan.candidates[index] is not front
    ]
    drawn = others[:MOST_OTHERS]
    for candidate in drawn:
        curve = candidate.trajectory
        line = curve.sample(np.linspace(curve.start_s, curve.end_s, OTHERS_SAMPLES)).position_m
        style = "-" if candidate.feasible else (0, (2, 2))
        axis.plot(*line[:, :2].T, linestyle=style, color=SOFT, linewidth=0.6, alpha=0.3 if tall else 0.65, zorder=3)
    if drawn:
        label = "other candidates" if len(drawn) == len(others) else f"the best {len(drawn)} of {len(others)} others"
        if not all(candidate.feasible for candidate in drawn):
            label += ", refused dashed"
        entries.append(Line2D([], [], color=SOFT, linewidth=0.8, alpha=0.8, label=label))
    curve = front.trajectory
    samples = curve.sample(np.linspace(curve.start_s, curve.end_s, SAMPLES))
    position = samples.position_m
    axis.plot(position[:, 0], position[:, 1], color="white", linewidth=2.8, alpha=0.7, zorder=4)
    if tall:
        draw_by_height(axis, position, width=1.8)
    else:
        axis.plot(position[:, 0], position[:, 1], color=PATH, linewidth=1.5, zorder=5)
        draw_arrows(axis, samples, ARROWS)
    if planned.options.explores_headings:
        draw_noses(axis, curve, NOSES)
        entries.append(Line2D([], [], color=INK, marker=">", markersize=4, linewidth=1.2, label="where it looks"))
    axis.plot(*position[0, :2], "o", color="white", markeredgecolor=INK, markersize=7.5, markeredgewidth=1.4, zorder=8)
    axis.plot(*position[-1, :2], "s", color=INK, markeredgecolor="white", markersize=5.0, markeredgewidth=0.8, zorder=9)
    entries += [
        Line2D([], [], marker="o", color="white", markeredgecolor=INK, markersize=7, linestyle="", label="start"),
        Line2D([], [], marker="s", color=INK, markersize=5, linestyle="", label="end"),
    ]
    radius_m = swath_radius_m(planned.mission)
    if radius_m is not None:
        draw_swath(axis, [position[:, :2]], radius_m)
    swath = [] if radius_m is None else [swath_entry(radius_m)]
    draw_legend(
        axis, [*entries, *swath, *ground_entries(planned.mission, planned.problem), *height_entries(planned.problem)]
    )


def _panels(problem: Problem) -> list[str]:
    """What is drawn beside the map: what there is nothing to say of is left out."""
    wanted = {
        "side view": is_tall(problem),
        "height": True,
        "above ground": ground_of(problem.obstacles) is not None,
        "speed": True,
        "clearance": not solid_of(problem.obstacles).is_empty,
    }
    return [name for name, there in wanted.items() if there]


def _series(axes: dict[str, Axes], problem: Problem, samples: Samples) -> None:
    """Heights, speed and clearance over time."""
    time_s, position = samples.time_s, samples.position_m
    draw_height(axes["height"], time_s, position, problem)
    if "above ground" in axes:
        draw_height_above_ground(axes["above ground"], time_s, position, problem)
    limit, speed = problem.limits.max_speed_mps, np.linalg.norm(samples.velocity_mps, axis=1)
    axes["speed"].plot(time_s, speed, color=LINE, linewidth=1.3, zorder=3)
    draw_limit(axes["speed"], limit, f"planned up to\n{limit:.3g} m/s")
    axes["speed"].set_ylim(0.0, 1.2 * max(limit, float(speed.max())))
    axes["speed"].set_title("speed [m/s]")
    if "clearance" in axes:
        # What the gate proves of it, so that the table's number and the picture's agree.
        away = solid_of(problem.obstacles).lower_bound(position) - problem.vehicle_radius_m
        draw_clearance(axes["clearance"], time_s, away, problem)
    *_, last = axes.values()
    for axis in axes.values():
        axis.set_xlim(time_s[0], time_s[-1])
    last.set_xlabel("time [s]")


def _ranked(planned: Planned) -> list[int]:
    """Candidates by what they are worth: first those that passed."""
    candidates = planned.plan.candidates
    return sorted(range(len(candidates)), key=lambda index: (not candidates[index].feasible, candidates[index].cost))


def _table(axis: Axes, planned: Planned) -> None:
    plan = planned.plan
    axis.set_axis_off()
    order = _ranked(planned)
    shown = order[:MOST_ROWS]
    searching = all(candidate.probability_found is not None for candidate in plan.candidates)
    columns = (
        (0.0, "left", "candidate"),
        (0.075, "left", "grown from"),
        (0.27, "right", "finds with" if searching else "ergodic metric"),
        (0.35, "right", "cost"),
        (0.43, "right", "length [m]"),
        (0.515, "right", "to limits [m]" if planned.problem.obstacles.has_height_limits else "clearance [m]"),
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
        gate = "passed" if candidate.feasible else fitted(report.violations[0].text, GATE_IN, 8.5)
        cells = (
            str(index),
            candidate.seed_pattern,
            f"{candidate.probability_found if searching else candidate.ergodic_metric:.4g}",
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
