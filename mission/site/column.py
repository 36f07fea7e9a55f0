"""Straight up and straight down: where the vehicle climbs, and where it lands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.obstacles import ObstacleField

_STEP_M = 0.25


class Nearest(NamedTuple):
    """Where a column comes nearest to what stands there.

    Attributes:
        distance_m: How near; infinite where the column has no extent.
        up_m: At which height.
    """

    distance_m: float
    up_m: float


def nearest_in_column(
    obstacles: ObstacleField, east_north_m: tuple[float, float], low_up_m: float, high_up_m: float
) -> Nearest:
    """How near a column comes to what stands around it; the ground and heights kept above it do not count.

    Args:
        obstacles: Everything that is known.
        east_north_m: Where the column is.
        low_up_m: Its lower end.
        high_up_m: Its upper end.
    """
    if high_up_m < low_up_m:
        return Nearest(np.inf, low_up_m)
    heights = np.linspace(low_up_m, high_up_m, int((high_up_m - low_up_m) / _STEP_M) + 2)
    column = np.column_stack([np.full((len(heights), 2), east_north_m), heights])
    distance = obstacles.standing.distance(column)
    worst = int(np.argmin(distance))
    return Nearest(float(distance[worst]), float(heights[worst]))


def ground_up_m(obstacles: ObstacleField, east_north_m: tuple[float, float], otherwise_m: float) -> float:
    """Height of the ground at a place, where a terrain is known.

    Args:
        obstacles: Everything that is known.
        east_north_m: The place.
        otherwise_m: What it is taken for without one.
    """
    ground = [surface for surface in obstacles.surfaces if surface.side > 0]
    place = np.array([east_north_m])
    return max((float(np.asarray(surface.height_at(place))[0]) for surface in ground), default=otherwise_m)
