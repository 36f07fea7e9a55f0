"""Obstacles as outlines on a map with their heights, for pictures."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from mission.mission_file import Mission
from mission.site.solids import solids_of
from planner import obstacles as shapes

CIRCLE = 2.0 * np.pi * np.arange(48) / 48


@dataclasses.dataclass(frozen=True)
class Footprint:
    """An obstacle seen from above.

    Attributes:
        polygon_m: Outline, shape (corner, 2), local ENU.
        floor_m: Its lower end.
        ceiling_m: Its upper end.
        no_fly: Whether it is forbidden rather than solid.
    """

    polygon_m: Float[np.ndarray, "corner 2"]
    floor_m: float
    ceiling_m: float
    no_fly: bool


def footprints_of(mission: Mission) -> list[Footprint]:
    """The outlines of everything that has one.

    Raises:
        ValueError: A file that cannot be used.
    """
    found = []
    for entries, no_fly in ((mission.obstacle, False), (mission.no_fly, True)):
        for entry in entries:
            for shape in solids_of(entry, mission):
                found += [Footprint(*outline, no_fly) for outline in _outline(shape)]
    return found


def _outline(shape: shapes.Obstacle) -> Iterator[tuple[Float[np.ndarray, "corner 2"], float, float]]:
    match shape:
        case shapes.Sphere(center_m=center, radius_m=radius):
            yield _circle(center[:2], radius), float(center[2] - radius), float(center[2] + radius)
        case shapes.Cylinder(center_m=center, radius_m=radius):
            yield _circle(center, radius), shape.floor_m, shape.ceiling_m
        case shapes.Box(min_m=low, max_m=high):
            corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
            yield corners, float(low[2]), float(high[2])
        case shapes.Prism(polygon_m=polygon):
            yield polygon, shape.floor_m, shape.ceiling_m
        case shapes.DistanceGrid() | shapes.HeightField():
            # Drawn as a map of what is solid (`mission.pictures.relief`).
            pass


def _circle(center_m: Float[np.ndarray, "2"], radius_m: float) -> Float[np.ndarray, "corner 2"]:
    return center_m + radius_m * np.stack([np.cos(CIRCLE), np.sin(CIRCLE)], axis=-1)
