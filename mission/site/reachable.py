"""Where the vehicle's middle may be: inside the fence, and far enough from every obstacle."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from mission.mission_file.site import Site
from planner.information import DensityGrid
from planner.obstacles import ObstacleField
from planner.polygon import KeepIn

Spare = Callable[[Float[np.ndarray, "point 3"]], Float[np.ndarray, "point"]]
"""How much farther than they must points are from everything, metres: changes by at most a metre a metre."""

BLOCK_CELLS = 3


def spare_in(site: Site, obstacles: ObstacleField, keep_out_m: float) -> Spare:
    """What points have to spare at a site.

    Args:
        site: Its polygon is the fence.
        obstacles: What to stay away from.
        keep_out_m: How far.
    """
    fence = KeepIn.everywhere() if site.polygon_enu_m is None else KeepIn.of(np.array(site.polygon_enu_m))

    def spare_m(points_m: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point"]:
        return np.minimum(obstacles.lower_bound(points_m) - keep_out_m, fence.distance(points_m[:, :2]))

    return spare_m


def reachable(density: DensityGrid, spare_m: Spare) -> DensityGrid:
    """The information where the vehicle can be; the rest is cut out.

    Raises:
        ValueError: Nothing is left.
    """
    mass = density.mass * roomy(density.centers_m(), spare_m)
    if not mass.any():
        raise ValueError("no information is left in the free space: obstacles or the fence cover all of it")
    return dataclasses.replace(density, mass=mass)


def roomy(centers_m: Float[np.ndarray, "nx ny nz 3"], spare_m: Spare) -> Bool[np.ndarray, "nx ny nz"]:
    """Which places of a grid have something to spare.

    Blocks of cells are decided by their middle where it has more to spare, or lacks more, than the block reaches; only
    along the borders each cell is asked.
    """
    shape = centers_m.shape[:3]
    first = [np.arange(0, count, BLOCK_CELLS) for count in shape]
    last = [np.minimum(start + BLOCK_CELLS, count) - 1 for start, count in zip(first, shape, strict=True)]
    low, high = centers_m[np.ix_(*first)], centers_m[np.ix_(*last)]
    spare = spare_m(0.5 * (low + high).reshape(-1, 3)).reshape(low.shape[:3])
    reach = 0.5 * np.linalg.norm(high - low, axis=-1)
    of_cell = np.ix_(*(np.arange(count) // BLOCK_CELLS for count in shape))
    free, open_cells = (spare >= reach)[of_cell], (np.abs(spare) < reach)[of_cell]
    free[open_cells] = spare_m(centers_m[open_cells]) >= 0.0
    return free
