"""Headings to start from, where they are explored: turning all round on the way, and looking where the vehicle goes.

A vehicle that turns while it passes sees every place from many sides at once, which is what an even target asks for;
what looks along the path sees each from few. The set has both, so that it differs.
"""

from __future__ import annotations

import enum
import itertools

import numpy as np
from jaxtyping import Float

from planner.problem import Problem
from planner.yaw import along_travel, headings

# Inside the limit, as whatever the optimiser begins with.
RATE_SHARE = 0.9
SLOW_SHARE = 0.4


class Facing(enum.Enum):
    """How the nose moves along a seed."""

    ROUND = "turning"
    ROUND_BACK = "turning back"
    TRAVEL = "along travel"
    SLOWLY_ROUND = "turning slowly"
    SWINGING = "swinging to and fro"


def seed_headings(paths_m: list[Float[np.ndarray, "moment 3"]], problem: Problem) -> list[Float[np.ndarray, "moment"]]:
    """A heading for each path, of each kind in turn.

    Args:
        paths_m: Positions at equal times over the problem's duration.
        problem: The time, the vehicle's yaw rate, and the heading it begins with.

    Returns:
        Radians counter-clockwise from east at the same moments, no faster than the vehicle turns.
    """
    kinds = itertools.cycle(Facing)
    return [_heading(kind, path, problem) for kind, path in zip(kinds, paths_m, strict=False)]


def _heading(kind: Facing, path_m: Float[np.ndarray, "moment 3"], problem: Problem) -> Float[np.ndarray, "moment"]:
    time_s = np.linspace(0.0, problem.duration_s, len(path_m))
    fastest = RATE_SHARE * problem.limits.max_yaw_rate_radps
    travel = along_travel(path_m)
    begins = float(travel[0]) if problem.start_turning is None else problem.start_turning.yaw_rad
    match kind:
        case Facing.ROUND:
            return begins + fastest * time_s
        case Facing.ROUND_BACK:
            return begins - fastest * time_s
        case Facing.SLOWLY_ROUND:
            return begins + SLOW_SHARE * fastest * time_s
        case Facing.TRAVEL:
            velocity = np.gradient(path_m, time_s, axis=0)
            return headings(time_s, velocity, fastest, start_yaw_rad=begins, planned_rad=travel)
        case Facing.SWINGING:
            # A whole turn to one side and back.
            there_s = 2.0 * np.pi / fastest
            return begins + fastest * np.abs((time_s + there_s) % (2.0 * there_s) - there_s)
