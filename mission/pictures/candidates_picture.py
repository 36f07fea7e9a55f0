"""candidates.png: every candidate on a map of its own, best first."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mission.candidates import RankedCandidate
from mission.pictures.picture import GOOD, INK, LIMIT, PATH, SOFT, STYLE, draw_ground

if TYPE_CHECKING:
    from mission.planning import Planned

MOST_COLUMNS = 4
MOST_SHOWN = 24
PANEL_IN, TITLE_IN, HEADING_IN, LEFT_IN = 3.3, 0.7, 0.55, 0.6
SAMPLES = 2000


def draw_candidates(planned: Planned, rows: list[RankedCandidate], path: Path) -> None:
    """Draws the best `MOST_SHOWN` candidates over the information and the obstacles.

    The selected one is in full colour, the others that passed in grey, the refused dashed with a cross at the worst of
    what is broken first.

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
    width_in, height_in = columns * PANEL_IN + 0.6, lines * (map_in + TITLE_IN) + HEADING_IN + 0.3
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width_in, height_in), dpi=120, facecolor="white")
        grid = figure.add_gridspec(
            lines,
            columns,
            left=LEFT_IN / width_in,
            right=1.0 - 0.1 / width_in,
            bottom=0.45 / height_in,
            top=1.0 - (HEADING_IN + 0.2) / height_in,
            hspace=TITLE_IN / map_in,
            wspace=0.16,
        )
        left_out = f"; {len(rows) - len(shown)} more are not shown" if len(rows) > len(shown) else ""
        passed = sum(row.candidate.feasible for row in rows)
        title = f"{planned.mission.name}: {len(rows)} candidates, {passed} passed the gate{left_out}"
        figure.text(LEFT_IN / width_in, 1.0 - 0.3 / height_in, title, fontsize=11, fontweight="bold", va="center")
        for place, row in enumerate(shown):
            axis = figure.add_subplot(grid[place // columns, place % columns])
            _panel(axis, planned, row)
            if place % columns:
                axis.set_ylabel("")
            if place + columns < len(shown):
                axis.set_xlabel("")
        figure.savefig(path)


def _panel(axis: Axes, planned: Planned, row: RankedCandidate) -> None:
    candidate = row.candidate
    draw_ground(axis, planned.mission, planned.problem)
    curve = candidate.trajectory
    line = curve.sample(np.linspace(curve.start_s, curve.end_s, SAMPLES)).position_m
    selected = row.index == planned.plan.selected
    color = PATH if selected else INK if candidate.feasible else LIMIT
    axis.plot(*line[:, :2].T, color="white", linewidth=2.2, alpha=0.6, zorder=4)
    style = "-" if candidate.feasible else (0, (4, 2))
    axis.plot(*line[:, :2].T, color=color, linewidth=1.1, linestyle=style, zorder=5)
    axis.plot(*line[0, :2], "o", color="white", markeredgecolor=INK, markersize=5.0, zorder=8)
    axis.plot(*line[-1, :2], "s", color=INK, markeredgecolor="white", markersize=4.0, zorder=9)
    if not candidate.feasible:
        axis.plot(*candidate.report.violations[0].position_m[:2], "x", color=LIMIT, markersize=8.0, zorder=10)
    head = f"{row.rank}: candidate {row.index}, {candidate.seed_pattern}" + (" (selected)" if selected else "")
    ratio = f" ({row.over_lawnmower:.2f}× lawnmower)" if math.isfinite(row.over_lawnmower) else ""
    axis.set_title(head, fontsize=8.5, color=PATH if selected else INK, pad=15.0)
    figures = f"E {candidate.ergodic_metric:.3g}{ratio}, {candidate.report.length_m:.4g} m, "
    verdict = "passed" if candidate.feasible else f"{candidate.report.violations[0].kind.value} broken"
    axis.text(
        0.0,
        1.02,
        figures + verdict,
        transform=axis.transAxes,
        fontsize=7.5,
        va="bottom",
        color=GOOD if candidate.feasible else LIMIT,
    )
    axis.tick_params(labelsize=7, colors=SOFT)
