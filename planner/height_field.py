"""The ground, and lids at a height above it, as distances: for terrain, and for a band of heights that paths keep.

Heights stand at posts and are bilinear between them. With L the steepest slope of the surface, (z − h(x, y))/√(1 + L²)
is never above the distance to it, and it changes by at most a metre a metre: it is what `planner.gate` needs for a
proof, and on ground without cliffs it gives little away. Where cliffs make L large, a grid of distances
(`planner.distance_grid`) is sharper nearby, and whichever of the two proves more counts.

| symbol | identifier   | unit | meaning                                        |
|--------|--------------|------|------------------------------------------------|
| h      | `heights_m`  | m    | at posts; beyond the outermost they go on      |
| L      | `steepest`   | 1    | largest slope of the bilinear surface          |
| σ      | `side`       | 1    | +1: solid below the surface; −1: solid above it |
"""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.distance_grid import DistanceGrid, from_heights
from planner.polygon import AnyArray, Values
from planner.workspace import Workspace

# Posts come in multiples of this, so that grounds of similar size run compiled code.
POSTS_AT_ONCE = 32
# From this slope on the grid of distances is worth its memory.
STEEP = 0.7


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class HeightField:
    """A surface over the plane with everything below it, or everything above it, solid.

    Attributes:
        low_m: The first post, shape (2,).
        post_m: Distances between posts along east and north, shape (2,).
        heights_m: Shape (east, north), two or more along each axis.
        side: +1 where what is below is solid, −1 where what is above is.
        slant: 1/√(1 + L²).
        near: Distances close to a steep surface; None where the ground is gentle.
    """

    low_m: Float[np.ndarray | Array, "2"]
    post_m: Float[np.ndarray | Array, "2"]
    heights_m: Float[np.ndarray | Array, "east north"]
    side: Float[np.ndarray | Array, ""]
    slant: Float[np.ndarray | Array, ""]
    near: DistanceGrid | None = None

    def distance(self, points_m: AnyArray) -> AnyArray:
        """A continuous distance that is nowhere above the true one, for points of shape (..., 3)."""
        found: Values = self._slanted(points_m)
        if self.near is not None:
            maximum = np.maximum if isinstance(points_m, np.ndarray) else jnp.maximum
            found = maximum(found, self.near.distance(points_m))
        return found

    def lower_bound(self, points_m: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """The most that is proven of the distance, on the host."""
        slanted = self._slanted(points_m)
        return slanted if self.near is None else np.maximum(slanted, self.near.lower_bound(points_m))

    def height_at(self, places_m: AnyArray) -> AnyArray:
        """The surface's height h at places of shape (..., 2)."""
        xp = np if isinstance(places_m, np.ndarray) else jnp
        shape = self.heights_m.shape
        flat = self.heights_m.reshape(-1)
        index, part = [], []
        for axis in range(2):
            place = xp.clip((places_m[..., axis] - self.low_m[axis]) / self.post_m[axis], 0.0, shape[axis] - 1.0)
            first = xp.clip(xp.floor(place), 0, shape[axis] - 2).astype(int)
            index.append(first)
            part.append(place - first)
        corner = index[0] * shape[1] + index[1]
        south = flat[corner] + part[0] * (flat[corner + shape[1]] - flat[corner])
        north = flat[corner + 1] + part[0] * (flat[corner + shape[1] + 1] - flat[corner + 1])
        return south + part[1] * (north - south)

    def free_from_m(self, places_m: Float[np.ndarray, "*batch 2"], away_m: float) -> Float[np.ndarray, "*batch"]:
        """The height at which the surface is so far away, by the slope's bound alone."""
        return self.height_at(places_m) + self.side * away_m / self.slant

    def _slanted(self, points: Values) -> Values:
        return self.side * (points[..., 2] - self.height_at(points[..., :2])) * self.slant


def ground(
    heights_m: Float[np.ndarray, "east north"],
    low_m: Float[np.ndarray, "2"],
    post_m: Float[np.ndarray, "2"],
    region: Workspace,
    cell_m: float,
    reach_m: float,
) -> HeightField:
    """Terrain: solid below.

    Args:
        heights_m: At the posts.
        low_m: Where the first post stands.
        post_m: Distances between posts along east and north.
        region: Where distances are wanted.
        cell_m: Edge length of a cell of the grid that steep ground gets besides.
        reach_m: How far beyond the region's sides that grid looks for ground: further than is kept from it, or the grid
            is no help near the sides.

    Raises:
        ValueError: Heights that are not finite, or fewer than two posts along an axis.
    """
    heights, post = np.asarray(heights_m, dtype=float), np.asarray(post_m, dtype=float)
    if heights.ndim != 2 or min(heights.shape) < 2 or not np.isfinite(heights).all():
        raise ValueError(f"terrain needs finite heights, two or more along two axes, got shape {heights.shape}")
    steepest = steepest_slope(heights, post)
    near = None
    if steepest > STEEP and post[0] == post[1]:
        near = from_heights(heights, low_m, float(post[0]), region, cell_m, reach_m)
    return HeightField(
        np.asarray(low_m, dtype=float), post, _padded(heights), np.array(1.0), np.array(_slant(steepest)), near
    )


def band(below: HeightField, least_m: float | None, greatest_m: float | None, away_m: float) -> tuple[HeightField, ...]:
    """Surfaces that keep paths between two heights above the ground, when they are stayed away from as obstacles are.

    Args:
        below: The ground.
        least_m: Least height above it; None: no least.
        greatest_m: Greatest height above it; None: no greatest.
        away_m: What is kept from obstacles: the surfaces lie so much lower, and higher.
    """
    steps = [] if least_m is None else [(1.0, least_m - away_m / float(below.slant))]
    steps += [] if greatest_m is None else [(-1.0, greatest_m + away_m / float(below.slant))]
    return tuple(
        HeightField(below.low_m, below.post_m, below.heights_m + offset_m, np.array(side), below.slant)
        for side, offset_m in steps
    )


def steepest_slope(heights_m: Float[np.ndarray, "east north"], post_m: Float[np.ndarray, "2"]) -> float:
    """L: in a bilinear piece each derivative lies between those along its two edges."""
    east = np.abs(np.diff(heights_m, axis=0)) / post_m[0]
    north = np.abs(np.diff(heights_m, axis=1)) / post_m[1]
    east = np.maximum(east[:, :-1], east[:, 1:])
    north = np.maximum(north[:-1], north[1:])
    return float(np.sqrt((east**2 + north**2).max()))


def _slant(steepest: float) -> float:
    return 1.0 / float(np.sqrt(1.0 + steepest**2))


def _padded(heights: Float[np.ndarray, "east north"]) -> Float[np.ndarray, "east north"]:
    """More posts as high as the outermost: the same surface."""
    return np.pad(heights, [(0, -count % POSTS_AT_ONCE) for count in heights.shape], mode="edge")
