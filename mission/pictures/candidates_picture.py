"""candidates.png: every candidate on a map of its own, best first."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mission.candidates import RankedCandidate
from mission.pictures.ground_map import draw_ground, ground_entries
from mission.pictures.path_drawing import draw_by_height, draw_noses, is_tall
from mission.pictures.style import GOOD, INK, LIMIT, PATH, SOFT, STYLE, distance, fitted

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from mission.planning import Planned

MOST_COLUMNS = 4
MOST_SHOWN = 24
PANEL_IN, GAP_IN, TITLE_IN, HEADING_IN, LEFT_IN, FOOT_IN, AXIS_IN = 3.0, 0.45, 0.68, 0.5, 0.75, 0.3, 0.5
LEGEND_ROW_IN, LEGEND_ENTRY_IN = 0.22, 2.05
NARROWEST_IN = 4.9
SAMPLES = 2000
NOSES = 50


def draw_candidates(planned: Planned, rows: list[RankedCandidate], path: Path) -> None:
    """Draws the best `MOST_SHOWN` candidates over the information and the obstacles.

    The selected one is in full colour, the others that passed in grey, the refused dashed with a cross at the worst of
    what is broken first. Where heights matter, colour tells them.

    Args:
        planned: The plan.
        rows: Its candidates, best first.
        path: The PNG file to write.
    """
    shown = rows[:MOST_SHOWN]
    columns = min(MOST_COLUMNS, len(shown))
    lines = math.ceil(len(shown) / columns)
    east_m, north_m, _ = planned.problem.workspace.lengths_m
    map_in = float(np.clip(PANEL_IN * north_m / east_m, 1.2, 2.0 * PANEL_IN))
    entries = _entries(planned, shown)
    width_in = max(NARROWEST_IN, LEFT_IN + columns * (PANEL_IN + GAP_IN))
    across = max(1, int((width_in - LEFT_IN) / LEGEND_ENTRY_IN))
    legend_in = FOOT_IN + LEGEND_ROW_IN * math.ceil(len(entries) / across)
    height_in = HEADING_IN + lines * (TITLE_IN + map_in) + AXIS_IN + (lines - 1) * FOOT_IN + legend_in
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width_in, height_in), dpi=120, facecolor="white")
        _heading(figure, planned, rows, len(shown))
        for place, row in enumerate(shown):
            line, column = divmod(place, columns)
            left_in = LEFT_IN + column * (PANEL_IN + GAP_IN)
            top_in = HEADING_IN + line * (TITLE_IN + map_in + FOOT_IN) + TITLE_IN
            bottom = 1.0 - (top_in + map_in) / height_in
            axis = figure.add_axes((left_in / width_in, bottom, PANEL_IN / width_in, map_in / height_in))
            _panel(axis, planned, row)
            if column:
                axis.set_ylabel("")
            if place + columns < len(shown):
                axis.set_xlabel("")
        figure.legend(
            handles=entries,
            loc="lower left",
            bbox_to_anchor=((LEFT_IN - 0.1) / width_in, 0.02),
            ncols=across,
            fontsize=8,
            labelcolor=INK,
        )
        figure.savefig(path)


def _heading(figure: Figure, planned: Planned, rows: list[RankedCandidate], shown: int) -> None:
    """How many there are, behind as much of the name as there is room for."""
    width_in, height_in = figure.get_size_inches()
    passed = sum(row.candidate.feasible for row in rows)
    counted = f"{len(rows)} candidate{'' if len(rows) == 1 else 's'}, {passed} passed the gate"
    if len(rows) > shown:
        counted += f", the best {shown} shown"
    name = fitted(planned.mission.name, width_in - LEFT_IN - 0.2, 11.0, "bold")
    figure.text(LEFT_IN / width_in, 1.0 - 0.22 / height_in, name, fontsize=11, fontweight="bold", va="center")
    figure.text(LEFT_IN / width_in, 1.0 - 0.43 / height_in, counted, fontsize=9, color=SOFT, va="center")


def _entries(planned: Planned, shown: list[RankedCandidate]) -> list[Artist]:
    """What the legend below all maps says."""
    entries: list[Artist] = [
        Line2D([], [], marker="o", color="white", markeredgecolor=INK, markersize=6, linestyle="", label="start"),
        Line2D([], [], marker="s", color=INK, markersize=4, linestyle="", label="end"),
    ]
    if planned.options.explores_headings:
        entries.append(Line2D([], [], color=INK, marker=">", markersize=4, linewidth=1.2, label="where it looks"))
    if is_tall(planned.problem):
        entries.append(Line2D([], [], color=PATH, linewidth=2.0, label="colour: dark is low, bright is high"))
    if not all(row.candidate.feasible for row in shown):
        entries.append(Line2D([], [], color=LIMIT, marker="x", linestyle="--", label="refused, where it breaks most"))
    return [*entries, *ground_entries(planned.mission, planned.problem)]


def _panel(axis: Axes, planned: Planned, row: RankedCandidate) -> None:
    candidate = row.candidate
    draw_ground(axis, planned.mission, planned.problem)
    curve = candidate.trajectory
    line = curve.sample(np.linspace(curve.start_s, curve.end_s, SAMPLES)).position_m
    selected = row.index == planned.plan.selected
    color = PATH if selected else INK if candidate.feasible else LIMIT
    axis.plot(*line[:, :2].T, color="white", linewidth=2.2, alpha=0.6, zorder=4)
    if is_tall(planned.problem) and candidate.feasible:
        draw_by_height(axis, line, width=1.2)
    else:
        style = "-" if candidate.feasible else (0, (4, 2))
        axis.plot(*line[:, :2].T, color=color, linewidth=1.1, linestyle=style, zorder=5)
    if planned.options.explores_headings:
        draw_noses(axis, curve, NOSES)
    axis.plot(*line[0, :2], "o", color="white", markeredgecolor=INK, markersize=5.0, zorder=8)
    axis.plot(*line[-1, :2], "s", color=INK, markeredgecolor="white", markersize=4.0, zorder=9)
    if not candidate.feasible:
        axis.plot(*candidate.report.violations[0].position_m[:2], "x", color=LIMIT, markersize=8.0, zorder=10)
    head = f"{row.rank}: candidate {row.index}, {candidate.seed_pattern}" + (" (selected)" if selected else "")
    head = fitted(head, PANEL_IN + 0.8 * GAP_IN, 8.5, "bold")
    axis.set_title(head, fontsize=8.5, color=PATH if selected else INK, pad=27.0)
    ratio = f", {row.over_lawnmower:.2f}× lawnmower's" if math.isfinite(row.over_lawnmower) else ""
    worth = f"ergodic metric {candidate.ergodic_metric:.3g}{ratio}"
    if candidate.probability_found is not None:
        worth = f"finds with probability {candidate.probability_found:.3f}"
    verdict = "passed" if candidate.feasible else f"{candidate.report.violations[0].kind.value} broken"
    axis.text(
        0.0,
        1.02,
        f"{worth}\n{distance(candidate.report.length_m)}, {verdict}",
        transform=axis.transAxes,
        fontsize=7.5,
        va="bottom",
        color=GOOD if candidate.feasible else LIMIT,
    )
    axis.tick_params(labelsize=7, colors=SOFT)
    axis.locator_params(nbins=5)
