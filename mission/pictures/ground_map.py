"""The map that lies below every path, and the words for what is on it.

The information, obstacles and what is kept clear around them, the box that paths stay in and the autopilot's fence.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Polygon
from matplotlib.path import Path as Outline
from matplotlib.transforms import ScaledTranslation

from mission.pictures.relief import Relief, relief_of
from mission.pictures.style import GOOD, GROUND, INFORMATION, INK, LIMIT, LOW, PATH, TALL
from mission.site.fence import autopilot_fence, planned_fence
from mission.site.footprints import Footprint, footprints_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from mission.mission_file import Mission
    from planner.problem import Problem

BORDER = 0.02
LEGEND_BELOW_IN = 0.5
FENCE_SEEN, FENCE_ROOM = 0.01, 0.15
"""Of the box's longer side: a nearer fence is not told apart, one farther out would make the map small; both are only
named."""
RING_SEEN = 0.006
"""Of it as well: narrower rings around obstacles would hide them."""
DASHES: Any = (0, (5, 3))
DOTS: Any = (0, (1, 1.5))


def draw_ground(axis: Axes, mission: Mission, problem: Problem) -> None:
    """Draw what lies below every path, in metres east and north."""
    low, high = problem.workspace.box_min_m, problem.workspace.box_max_m
    # A search shares its time out as effort, which is flat where the most is found: where the target may be is the map.
    shown = problem.information if problem.search is None else problem.search.prior
    mass = shown.map_mass
    axis.imshow(
        mass.T,
        origin="lower",
        extent=(low[0], high[0], low[1], high[1]),
        cmap=INFORMATION,
        vmin=0.0,
        vmax=_bright(mass),
        interpolation="bilinear",
        zorder=0,
    )
    relief = relief_of(problem)
    if relief is not None:
        _draw_relief(axis, relief, ring=_ring_drawn(problem))
    inside = _inside(mission, problem)
    for footprint in inside:
        axis.add_patch(_patch(footprint, problem))
    if _ring_drawn(problem):
        for ring in _kept_clear(inside, problem):
            axis.add_patch(ring)
    axis.add_patch(Polygon(planned_fence(mission.site), closed=True, fill=False, edgecolor=GOOD, linewidth=1.2))
    beyond = mission.site.fence_margin_m if _fence_drawn(mission, problem) else 0.0
    if beyond:
        fence = autopilot_fence(mission.site)
        axis.add_patch(Polygon(fence, closed=True, fill=False, edgecolor=LIMIT, linewidth=1.0, linestyle=DASHES))
    pad = BORDER * _longer_side_m(problem) + beyond
    axis.set_xlim(low[0] - pad, high[0] + pad)
    axis.set_ylim(low[1] - pad, high[1] + pad)
    axis.set_aspect("equal", anchor="NW")
    axis.set_xlabel("east [m]")
    axis.set_ylabel("north [m]")


def ground_entries(mission: Mission, problem: Problem) -> list[Artist]:
    """What a legend says of the map."""
    site = mission.site
    box = "area of the paths" if site.polygon_enu_m else "box of the paths"
    informative = "information" if problem.search is None else "where the target may be"
    entries: list[Artist] = [Patch(facecolor=INFORMATION(0.75), label=informative)]
    if site.fence_margin_m == 0.0:
        box += " and fence"
    entries.append(Line2D([], [], color=GOOD, linewidth=1.2, label=box))
    if _fence_drawn(mission, problem):
        entries.append(Line2D([], [], color=LIMIT, linewidth=1.0, linestyle=DASHES, label="fence of the autopilot"))
    elif site.fence_margin_m:
        label = f"fence, {site.fence_margin_m:g} m farther out"
        entries.append(Line2D([], [], color=LIMIT, linewidth=1.0, linestyle=DASHES, label=label))
    inside, relief = _inside(mission, problem), relief_of(problem)
    solid = [footprint for footprint in inside if not footprint.no_fly]
    passable = [footprint for footprint in solid if not _full_height(footprint, problem)]
    partly = relief is not None and (relief.somewhere & ~relief.everywhere).any()
    if len(passable) < len(solid) or (relief is not None and relief.everywhere.any()):
        entries.append(Patch(facecolor=TALL, label="obstacle, full height"))
    if passable or partly:
        under = any(footprint.floor_m - problem.keep_out_m > _low_m(problem) for footprint in passable)
        label = "obstacle, can be flown over" + (" or under" if under else "")
        entries.append(Patch(facecolor=LOW, label=label))
    if _ring_drawn(problem) and (inside or (relief is not None and relief.kept_clear.any())):
        label = f"kept clear, {problem.keep_out_m:.3g} m"
        entries.append(Line2D([], [], color=INK, linewidth=0.9, linestyle=DOTS, label=label))
    if relief is not None and relief.ground_m is not None:
        entries.append(Line2D([], [], color=GROUND, linewidth=0.8, label="height of the ground"))
    if len(solid) < len(inside):
        entries.append(Patch(facecolor="none", edgecolor=LIMIT, hatch="////", label="no-fly"))
    return entries


def draw_legend(axis: Axes, entries: Iterable[Artist]) -> None:
    """The legend, below the map."""
    figure = axis.get_figure(root=True)
    assert figure is not None
    axis.legend(
        handles=list(entries),
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=axis.transAxes + ScaledTranslation(0.0, -LEGEND_BELOW_IN, figure.dpi_scale_trans),
        ncols=4,
        fontsize=8,
        handlelength=1.6,
        columnspacing=1.0,
        borderaxespad=0.0,
        labelcolor=INK,
    )


def draw_swath(axis: Axes, pieces_m: Iterable[Float[np.ndarray, "time 2"]], radius_m: float) -> None:
    """The band on the ground that the sensor of a search sees along its paths: what it leaves out are the gaps."""
    bands = [shapely.LineString(piece).simplify(0.02 * radius_m).buffer(radius_m) for piece in pieces_m]
    for part in shapely.get_parts(shapely.union_all(bands)):
        axis.add_patch(PathPatch(_outline(part), facecolor=PATH, alpha=0.1, linewidth=0.0, zorder=1.5))
        axis.add_patch(
            PathPatch(_outline(part), facecolor="none", edgecolor=PATH, alpha=0.5, linewidth=0.4, zorder=1.5)
        )


def swath_entry(radius_m: float) -> Artist:
    """What a legend says of it."""
    return Patch(facecolor=PATH, alpha=0.2, label=f"seen by the sensor, {radius_m:g} m each side")


def swath_radius_m(mission: Mission) -> float | None:
    """Of the band that a search sees; None: the mission is no search."""
    return mission.sensor.detection_radius_m if mission.belief.kind == "detection" else None


def _bright(mass: np.ndarray) -> float:
    """Upper end of the colour scale: extreme cells must not turn the rest white, nor an even field dark."""
    return float(max(np.quantile(mass, 0.995), 4.0 * mass.mean()))


def _low_m(problem: Problem) -> float:
    return float(problem.workspace.box_min_m[2])


def _high_m(problem: Problem) -> float:
    return float(problem.workspace.box_max_m[2])


def _longer_side_m(problem: Problem) -> float:
    return float(max(problem.workspace.lengths_m[:2]))


def _ring_drawn(problem: Problem) -> bool:
    return problem.keep_out_m >= RING_SEEN * _longer_side_m(problem)


def _fence_drawn(mission: Mission, problem: Problem) -> bool:
    side_m = _longer_side_m(problem)
    return FENCE_SEEN * side_m <= mission.site.fence_margin_m <= FENCE_ROOM * side_m


def _inside(mission: Mission, problem: Problem) -> list[Footprint]:
    """What reaches into the heights of the box."""
    low_m, high_m = _low_m(problem), _high_m(problem)
    return [found for found in footprints_of(mission) if found.ceiling_m > low_m and found.floor_m < high_m]


def _full_height(footprint: Footprint, problem: Problem) -> bool:
    """Whether the box leaves no height to pass above or below it, with what is kept clear."""
    away_m = problem.keep_out_m
    return footprint.ceiling_m + away_m > _high_m(problem) and footprint.floor_m - away_m < _low_m(problem)


def _patch(footprint: Footprint, problem: Problem) -> PathPatch:
    """Its outline; darker where it can be passed neither above nor below."""
    outline = _outline(shapely.Polygon(footprint.polygon_m))
    if footprint.no_fly:
        return PathPatch(outline, facecolor="none", edgecolor=LIMIT, linewidth=0.9, hatch="////", alpha=0.8, zorder=2)
    color = TALL if _full_height(footprint, problem) else LOW
    return PathPatch(outline, facecolor=color, edgecolor="white", linewidth=0.5, zorder=2)


def _kept_clear(footprints: list[Footprint], problem: Problem) -> list[PathPatch]:
    """How far the vehicle's middle stays away from outlines."""
    grown = shapely.union_all([shapely.Polygon(one.polygon_m).buffer(problem.keep_out_m) for one in footprints])
    style: dict[str, Any] = {"facecolor": "none", "edgecolor": INK, "linewidth": 0.7, "linestyle": DOTS, "zorder": 2}
    return [PathPatch(_outline(part), **style) for part in shapely.get_parts(grown)]


def _outline(shape: Any) -> Outline:
    """A polygon with its holes."""
    return Outline.make_compound_path(
        *(Outline(ring.coords, closed=True) for ring in (shape.exterior, *shape.interiors))
    )


def _draw_relief(axis: Axes, relief: Relief, ring: bool) -> None:
    """Measured obstacles as areas, and the ground as lines of equal height."""
    for solid, color in ((relief.somewhere, LOW), (relief.everywhere, TALL)):
        if solid.any():
            axis.contourf(relief.east_m, relief.north_m, solid, levels=[0.5, 1.5], colors=[color], zorder=2)
    if ring and relief.kept_clear.any():
        axis.contour(
            relief.east_m,
            relief.north_m,
            relief.kept_clear,
            levels=[0.5],
            colors=[INK],
            linewidths=0.7,
            linestyles=[DOTS],
            zorder=2,
        )
    if relief.ground_m is not None and np.ptp(relief.ground_m) > 0.0:
        lines = axis.contour(
            relief.east_m, relief.north_m, relief.ground_m, levels=8, colors=[GROUND], linewidths=0.6, zorder=2
        )
        axis.clabel(lines, fontsize=6, fmt="%g m")
