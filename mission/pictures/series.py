"""Heights, speeds and clearances over time, against their limits: for plans and for flights alike."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mission.pictures.relief import ground_of
from mission.pictures.style import GOOD, GROUND, LIMIT, LINE, SERIES_LEFT, SERIES_RIGHT

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from planner.obstacles import ObstacleField
    from planner.problem import Problem

Series = Float[np.ndarray, "time"]
LOGARITHMIC_FROM = 20.0
"""Where clearances reach this many margins, the small ones that matter are shown on a logarithmic axis."""
SIDE_VIEW_OVER_SERIES = 1.7
DASHES: Any = (0, (5, 3))
BESIDE = 4.0
"""Points between the end of an axis and the name of a limit."""


def stacked(figure: Figure, names: Sequence[str], top: float, bottom: float) -> dict[str, Axes]:
    """Axes beside the map, one below the other; a view from the side is the tallest of them."""
    tall = [SIDE_VIEW_OVER_SERIES if name == "side view" else 1.0 for name in names]
    grid = figure.add_gridspec(
        len(names), 1, left=SERIES_LEFT, right=SERIES_RIGHT, top=top, bottom=bottom, hspace=0.5, height_ratios=tall
    )
    return {name: figure.add_subplot(grid[row]) for row, name in enumerate(names)}


def draw_limit(
    axis: Axes, value: float, label: str, side: Literal["above", "level", "below"] = "level", color: str = LIMIT
) -> None:
    """A limit across a time series; its name stands beside the axis, where it hides nothing of the curve."""
    axis.axhline(value, color=color, linewidth=1.0, linestyle=DASHES, zorder=2)
    axis.annotate(
        label,
        xy=(1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(BESIDE, 0.0),
        textcoords="offset points",
        va={"above": "bottom", "level": "center", "below": "top"}[side],
        fontsize=8,
        color=color,
        annotation_clip=False,
    )


def draw_height(axis: Axes, time_s: Series, position_m: Float[np.ndarray, "time 3"], problem: Problem) -> None:
    """Height above the origin with the ground, the heights above it that are kept, and the box's floor and ceiling."""
    low, high = float(problem.workspace.box_min_m[2]), float(problem.workspace.box_max_m[2])
    room = 0.18 * (high - low)
    bottom = min(low - room, float(position_m[:, 2].min()) - 0.25 * room)
    ground = ground_of(problem.obstacles)
    axis.plot(time_s, position_m[:, 2], color=LINE, linewidth=1.3, zorder=3)
    if ground is not None:
        below = np.asarray(ground.height_at(position_m[:, :2]))
        bottom = min(bottom, float(below.min()))
        axis.fill_between(time_s, bottom, below, color=GROUND, alpha=0.35, linewidth=0.0, zorder=1)
        least, greatest = problem.obstacles.span_m(position_m[:, :2], problem.keep_out_m)
        kept = np.clip(least, low, high), np.clip(greatest, low, high)
        axis.fill_between(time_s, *kept, color=GOOD, alpha=0.13, linewidth=0.0, zorder=1)
    draw_limit(axis, high, f"ceiling {high:g} m")
    draw_limit(axis, low, f"floor {low:g} m")
    axis.set_ylim(bottom, max(high, float(position_m[:, 2].max())) + room)
    axis.set_title("height above the origin [m]")


def height_entries(problem: Problem) -> list[Artist]:
    """What a legend says of the areas in the heights."""
    if ground_of(problem.obstacles) is None:
        return []
    allowed = Patch(facecolor=GOOD, alpha=0.15, label="heights to keep above ground")
    return [Patch(facecolor=GROUND, alpha=0.35, label="ground below the path"), allowed]


def draw_height_above_ground(
    axis: Axes, time_s: Series, position_m: Float[np.ndarray, "time 3"], problem: Problem
) -> None:
    """Height above the ground with the least and the greatest that are kept; the ground must be known."""
    ground = ground_of(problem.obstacles)
    assert ground is not None
    below = np.asarray(ground.height_at(position_m[:, :2]))
    height = position_m[:, 2] - below
    least, greatest = (limit - below for limit in problem.obstacles.span_m(position_m[:, :2], problem.keep_out_m))
    axis.plot(time_s, height, color=LINE, linewidth=1.3, zorder=3)
    axis.fill_between(time_s, least, np.minimum(greatest, 1e6), color=GOOD, alpha=0.13, linewidth=0.0, zorder=1)
    top = 1.15 * float(height.max())
    for limit, word in ((least, "least"), (greatest, "greatest")):
        if np.isfinite(limit).all():
            draw_limit(axis, float(np.median(limit)), f"{word} {np.median(limit):.3g} m")
            top = max(top, 1.15 * float(np.median(limit)))
    axis.set_ylim(min(0.0, float(height.min())), top)
    axis.set_title("height above the ground [m]")


def solid_of(field: ObstacleField) -> ObstacleField:
    """What can be run into: without the least and greatest heights above the ground, which are only agreed on."""
    ground = ground_of(field)
    return dataclasses.replace(field, surfaces=() if ground is None else (ground,))


def draw_clearance(
    axis: Axes, time_s: Series, clearance_m: Series, problem: Problem, counts: np.ndarray | None = None
) -> None:
    """Clearance of the hull with its margin, the least of it marked and said.

    Args:
        axis: Where.
        time_s: The time.
        clearance_m: The clearance.
        problem: Its margin counts; its obstacles give the title.
        counts: Which samples the margin is held against; absent: all. The axis shows their range.
    """
    shown = clearance_m if counts is None else np.where(counts, clearance_m, np.nan)
    margin = problem.clearance_margin_m
    axis.plot(time_s, shown, color=LINE, linewidth=1.3, zorder=3)
    grounded = ground_of(problem.obstacles) is not None
    axis.set_title(f"clearance to obstacles{' and ground' if grounded else ''} [m]")
    draw_limit(axis, margin, f"margin {margin:g} m")
    known = np.flatnonzero(np.isfinite(shown))
    if not len(known):
        axis.set_ylim(0.0, 4.0 * max(margin, 0.1))
        return
    at = known[int(np.argmin(shown[known]))]
    least, most = float(shown[at]), float(shown[known].max())
    axis.plot(time_s[at], least, "o", color=LIMIT, markeredgecolor="white", markersize=6.0, zorder=5, clip_on=False)
    axis.annotate(
        f"● least {least:.3g} m\nat {time_s[at]:.0f} s",
        xy=(1.0, 1.0),
        xycoords="axes fraction",
        xytext=(BESIDE, 0.0),
        textcoords="offset points",
        va="top",
        fontsize=8,
        color=LIMIT,
    )
    top = max(float(np.quantile(shown[known], 0.9)), 4.0 * margin)
    bottom = min(0.0, 1.1 * least)
    if least > 0.0 < margin and top > LOGARITHMIC_FROM * margin:
        axis.set_yscale("log")
        bottom = 0.4 * min(margin, least)
        axis.set_ylim(bottom, 1.5 * most)
        axis.yaxis.set_major_formatter("{x:g}")
    else:
        axis.set_ylim(bottom, max(top, 1.2 * least))
    axis.axhspan(bottom, margin, color=LIMIT, alpha=0.07, linewidth=0.0, zorder=1)
