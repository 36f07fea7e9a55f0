"""A mission that the vehicle flies by itself: what is left of its legs, held against what is known now."""

from __future__ import annotations

import numpy as np

from mission.executive.events import MissionPlace
from mission.waypoints import legs_clear
from planner.problem import Problem

# Legs were proven between samples of a curve that may touch what must be kept.
_ROUNDING_M = 0.05


def is_blocked(places: tuple[MissionPlace, ...], reached: int | None, known: Problem) -> bool:
    """Whether a leg that is still to be flown comes nearer to what is known than it must.

    Args:
        places: Of the mission, in order.
        reached: Number of the item that was reached last; None: none yet.
        known: What is known.
    """
    passed = [index for index, place in enumerate(places) if reached is not None and place.number <= reached]
    left_m = np.array([place.position_m for place in places[passed[-1] if passed else 0 :]])
    if len(left_m) < 2:
        return False

    def spare_m(points_m: np.ndarray) -> np.ndarray:
        return known.obstacles.distance(points_m) - known.keep_out_m + _ROUNDING_M

    return not legs_clear(left_m[:-1], left_m[1:], spare_m).all()
