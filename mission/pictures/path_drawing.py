"""Paths on a map: where they lead, how high they are, where the vehicle looks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from mission.pictures.series import solid_of
from mission.pictures.style import HEIGHTS, INK, LOW, PATH

if TYPE_CHECKING:
    from planner.problem import Problem
    from planner.trajectory import Samples, Trajectory

TALL_FROM = 0.5
"""Height over the shorter side of the box from which a map alone does not tell a path."""
SIDE_PLACES = 90, 30, 60
"""Along east, north and up, where the side view looks for obstacles."""


def is_tall(problem: Problem) -> bool:
    """Whether paths lie over and under each other so much that heights are shown as colours."""
    east_m, north_m, up_m = problem.workspace.lengths_m
    return bool(up_m >= TALL_FROM * min(east_m, north_m))


def draw_by_height(
    axis: Axes,
    position_m: Float[np.ndarray, "time 3"],
    width: float,
    seen: Literal["from above", "from the south"] = "from above",
) -> None:
    """A line whose colour is its height, `HEIGHTS` from its lowest to its highest place; NaN parts it."""
    points, height_m = position_m[:, [0, 1 if seen == "from above" else 2]], position_m[:, 2]
    line = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)),
        cmap=HEIGHTS,
        norm=Normalize(float(np.nanmin(height_m)), float(np.nanmax(height_m))),
        linewidths=width,
        capstyle="round",
        zorder=5.0,
    )
    line.set_array(0.5 * (height_m[1:] + height_m[:-1]))
    axis.add_collection(line)


def draw_arrows(axis: Axes, samples: Samples, count: int) -> None:
    """Arrow heads at equal distances along the path."""
    position = samples.position_m[:, :2]
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    for wanted in (np.arange(count) + 0.5) / count * travelled[-1]:
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


def draw_noses(axis: Axes, curve: Trajectory, count: int) -> None:
    """Arrows from the path to where the nose points, where that was planned with it."""
    time_s = np.linspace(curve.start_s, curve.end_s, count)
    heading = curve.headings_at(time_s)
    if heading is None:
        return
    east, north = curve.sample(time_s).position_m[:, :2].T
    arrows: dict[str, Any] = {"headwidth": 4.0, "headlength": 4.5, "headaxislength": 4.0, "scale": 24.0}
    axis.quiver(east, north, np.cos(heading), np.sin(heading), color=INK, width=0.0028, zorder=7, **arrows)


def draw_side_view(axis: Axes, position_m: Float[np.ndarray, "time 3"], problem: Problem) -> None:
    """The path seen from the south, its colours the same as on the map, and what stands there."""
    low, high = problem.workspace.box_min_m, problem.workspace.box_max_m
    east, north, up = (np.linspace(low[side], high[side], places) for side, places in enumerate(SIDE_PLACES))
    solid = solid_of(problem.obstacles)
    if not solid.is_empty:
        grid = np.stack(np.meshgrid(east, north, up, indexing="ij"), axis=-1)
        seen = (np.asarray(solid.distance(grid)) < 0.0).any(axis=1)
        if seen.any():
            axis.contourf(east, up, seen.T, levels=[0.5, 1.5], colors=[LOW], zorder=2)
    draw_by_height(axis, position_m, 1.2, "from the south")
    known = position_m[np.isfinite(position_m[:, 0])]
    axis.plot(*known[0, [0, 2]], "o", color="white", markeredgecolor=INK, markersize=6.0, zorder=8)
    axis.plot(*known[-1, [0, 2]], "s", color=INK, markeredgecolor="white", markersize=4.5, zorder=9)
    axis.set_xlim(low[0], high[0])
    axis.set_ylim(low[2], high[2])
    axis.set_aspect("equal", anchor="NW")
    axis.set_title("seen from the south: height over east [m], colour is height")
