"""What is flown next, held against what is known now.

A curve was proven with what was known then. So whenever something was learned, or another curve is flown, the way ahead
is looked along again, a stretch at a time, so that a long way never holds up the flight: what was not looked along yet
counts as blocked. A piece is clear where its middle has more to spare than the rest of the piece is away from it.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from planner.obstacles import ObstacleField
from planner.problem import Problem
from planner.trajectory import Trajectory

_STRETCH_S = 20.0
_FINEST_S = 0.05
# Distances that are interpolated on a grid change by up to √3 metres a metre.
_STEEPEST = 1.75
# A proven curve may touch what must be kept: rounding is no block.
_ROUNDING_M = 1e-6

Curves = tuple[Trajectory, ...]
"""Curves flown one after another, each from its own start until the next one's."""


@dataclasses.dataclass(frozen=True)
class Block:
    """Where what is known is nearer to the way ahead than it must be.

    Attributes:
        curve_s: Curve time.
        place_m: Place on the curve, mission frame.
    """

    curve_s: float
    place_m: Float[np.ndarray, "3"]


class Lookout:
    """Looks along the way ahead.

    Args:
        known: What is known now; its obstacles are another object whenever some were learned.
    """

    def __init__(self, known: Callable[[], Problem]) -> None:
        self._known = known
        self._obstacles: ObstacleField | None = None
        self._curves: Curves = ()
        self._from_s = math.inf
        self.looked_s = -math.inf
        """Curve time up to which it was looked along."""
        self._blocks: list[Block] = []

    def look(self, curves: Curves, here_s: float, least_s: float) -> Block | None:
        """Look further along a way, or along it anew where it is another one or something was learned.

        Args:
            curves: The way.
            here_s: Curve time from which it is flown.
            least_s: Curve time up to which it must have been looked along.

        Returns:
            The first block that was seen ahead; None: none yet.
        """
        known, end_s = self._known(), curves[-1].end_s
        if known.obstacles is not self._obstacles or not _same(curves, self._curves) or here_s < self._from_s:
            self._obstacles, self._curves, self._blocks = known.obstacles, curves, []
            self._from_s = self.looked_s = here_s
        until_s = min(end_s, max(least_s, self.looked_s) + _STRETCH_S)
        if self.looked_s < end_s:
            self._blocks += blocks(curves, self.looked_s, until_s, known)
            self.looked_s = math.inf if until_s >= end_s else until_s
        return next((block for block in self._blocks if block.curve_s >= here_s), None)


def blocks(curves: Curves, first_s: float, last_s: float, known: Problem) -> list[Block]:
    """Where a stretch of a way comes nearer to what is known than it must, in order; none: it is clear.

    Args:
        curves: The way.
        first_s: Curve time at which the stretch begins.
        last_s: Curve time at which it ends.
        known: What is known.
    """
    fastest_mps = max(
        float(np.linalg.norm(np.diff(curve.control_points_m, axis=0), axis=1).max()) / curve.knot_interval_s
        for curve in curves
    )
    middles, half_s = np.array([0.5 * (first_s + last_s)]), 0.5 * (last_s - first_s)
    while True:
        places = _places(curves, middles)
        spare_m = known.obstacles.distance(places) - known.keep_out_m + _ROUNDING_M
        if half_s <= _FINEST_S:
            near = np.flatnonzero(spare_m < 0.0)
            return [Block(float(middles[index]), places[index]) for index in near[np.argsort(middles[near])]]
        open_s = middles[spare_m < _STEEPEST * fastest_mps * half_s]
        if not len(open_s):
            return []
        half_s *= 0.5
        middles = np.concatenate([open_s - half_s, open_s + half_s])


def _places(curves: Curves, moments_s: Float[np.ndarray, "time"]) -> Float[np.ndarray, "time 3"]:
    places = curves[0].sample(moments_s).position_m
    for _, curve in itertools.pairwise(curves):
        later = moments_s >= curve.start_s
        places[later] = curve.sample(moments_s[later]).position_m
    return places


def _same(first: Curves, second: Curves) -> bool:
    return len(first) == len(second) and all(a is b for a, b in zip(first, second, strict=True))
