"""The least of many distances at many points, on the host, without measuring every distance at every point.

Each distance changes by at most a metre a metre. So with the least distance at the middle of some points known, what is
further from it there by more than twice their radius is nearest to none of them: it is left out, and the points are
halved until what is left is little. What remains is measured by the one formula there is; nothing is approximated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Float, Int

# So many evaluations cost about what it takes to decide how to do with fewer, and their arrays stay in the cache.
EVALUATIONS = 1 << 15
# Rounding must leave nothing out.
_SLACK_M = 1e-6

Distances = Callable[[Float[np.ndarray, "point 3"], Int[np.ndarray, "some"]], Float[np.ndarray, "some point"]]
"""1-Lipschitz signed distances from points to some of the bodies, by their numbers."""


def least(
    points_m: Float[np.ndarray, "point 3"], work: Int[np.ndarray, "body"], distances: Distances
) -> Float[np.ndarray, "point"]:
    """The least distance at each point.

    Args:
        points_m: Where.
        work: How many evaluations a body takes at a point, one or more; there is a body.
        distances: To some of the bodies.
    """
    found = np.empty(len(points_m))
    for mine, bodies in grouped(points_m, work, distances):
        found[mine] = distances(points_m[mine], bodies).min(axis=0, initial=np.inf)
    return found


def grouped(
    points_m: Float[np.ndarray, "point 3"], work: Int[np.ndarray, "body"], distances: Distances, reach_m: float = 0.0
) -> Iterator[tuple[Int[np.ndarray, "mine"], Int[np.ndarray, "some"]]]:
    """Points in groups that are near each other, each with the bodies that can be nearest to any of its points.

    Args:
        points_m: Where.
        work: How many evaluations a body takes at a point.
        distances: To some of the bodies.
        reach_m: Bodies that are nearest so far around a point count as well.

    Yields:
        Numbers of the points of a group, and of its bodies.
    """
    pending = [(np.arange(len(points_m)), np.arange(len(work)))]
    while pending:
        mine, bodies = pending.pop()
        if len(mine) <= 1 or len(mine) * work[bodies].sum() <= EVALUATIONS:
            yield mine, bodies
            continue
        points = points_m[mine]
        low, high = points.min(axis=0), points.max(axis=0)
        middle = 0.5 * (low + high)
        away = distances(middle[None], bodies)[:, 0]
        bodies = bodies[away <= away.min() + float(np.linalg.norm(high - low)) + 2.0 * reach_m + _SLACK_M]
        axis = int(np.argmax(high - low))
        upper = points[:, axis] > middle[axis]
        if not upper.any():
            # All in one place, to rounding.
            upper[len(mine) // 2 :] = True
        pending += [(mine[upper], bodies), (mine[~upper], bodies)]
