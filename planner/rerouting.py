"""Led around what a path runs through: for candidates that the optimiser left on both sides of an obstacle.

A penalty's gradient pushes neighbouring points of a path that crosses an obstacle to opposite sides, and no number of
steps brings them together. Here the blocked moments get a way around, and the rest of the path keeps its time.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from planner.free_space import FreeSpace
from planner.polyline import at_lengths, length_of
from planner.trajectory import Trajectory

SAMPLES_PER_SEGMENT = 4
# So many segments before and after the blocked moments give way too: a detour takes longer than the way through.
GIVES_WAY_SEGMENTS = 3
# A way that is shorter than this share of what it replaces is none: the vehicle would stand there instead.
LEAST_LEFT = 0.01


def rerouted(curve: Trajectory, free: FreeSpace) -> Float[np.ndarray, "moment 3"]:
    """Positions at equal times along a curve, those that are blocked led around what blocks them.

    Args:
        curve: Any curve; its ends are kept.
        free: Where the vehicle may be.
    """
    moments = np.linspace(curve.start_s, curve.end_s, SAMPLES_PER_SEGMENT * curve.segments + 1)
    points = free.clipped(curve.sample(moments).position_m)
    blocked = np.flatnonzero(free.margin(points) < 0.0)
    if blocked.size == 0:
        return points
    reach = SAMPLES_PER_SEGMENT * GIVES_WAY_SEGMENTS
    last = len(points) - 1
    breaks = np.flatnonzero(np.diff(blocked) > 2 * reach) + 1
    for run in np.split(blocked, breaks):
        first, end = max(0, int(run[0]) - reach), min(last, int(run[-1]) + reach)
        way = free.path_through(points[[first, end]])
        if len(way) < 2 or length_of(way) < LEAST_LEFT * length_of(points[first : end + 1]):
            continue
        legs = free.flown_lengths(way)
        points[first : end + 1] = at_lengths(way, legs, np.linspace(0.0, legs.sum(), end - first + 1))
    return points
