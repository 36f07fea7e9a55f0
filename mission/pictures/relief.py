"""Measured obstacles and the ground as maps, for pictures."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Bool, Float

from planner.height_field import HeightField
from planner.obstacles import ObstacleField
from planner.problem import Problem

PLACES = 160
LEVELS = 16


@dataclasses.dataclass(frozen=True)
class Relief:
    """What cannot be drawn as outlines, seen from above.

    Attributes:
        east_m: Shape (east,).
        north_m: Shape (north,).
        somewhere: Where some height of the box is in a measured obstacle, shape (north, east).
        everywhere: Where every height of it is, or in the ground.
        kept_clear: Where some height of it is too near to a measured obstacle for the vehicle's middle.
        ground_m: Height of the ground; None where none is known.
    """

    east_m: Float[np.ndarray, "east"]
    north_m: Float[np.ndarray, "north"]
    somewhere: Bool[np.ndarray, "north east"]
    everywhere: Bool[np.ndarray, "north east"]
    kept_clear: Bool[np.ndarray, "north east"]
    ground_m: Float[np.ndarray, "north east"] | None


def relief_of(problem: Problem) -> Relief | None:
    """The maps of a problem; None where outlines tell it all."""
    field = problem.obstacles
    if not (field.grids or field.surfaces):
        return None
    low, high = problem.workspace.box_min_m, problem.workspace.box_max_m
    east, north = (np.linspace(low[axis], high[axis], PLACES) for axis in (0, 1))
    heights = np.linspace(low[2], high[2], LEVELS)
    grid = np.stack(np.meshgrid(east, north, heights, indexing="xy"), axis=-1)
    away = np.asarray(ObstacleField.of(field.grids).distance(grid))
    solid = away < 0.0
    below = ground_of(field)
    ground = None if below is None else np.asarray(below.height_at(grid[:, :, 0, :2]))
    buried = solid if ground is None else solid | (ground[:, :, None] > grid[..., 2])
    near = np.any(away < problem.keep_out_m, axis=2)
    return Relief(east, north, np.any(solid, axis=2), np.all(buried, axis=2), near, ground)


def ground_of(field: ObstacleField) -> HeightField | None:
    """The ground itself, which comes before the heights that are kept above it; None where none is known."""
    return next((surface for surface in field.surfaces if surface.side > 0), None)
