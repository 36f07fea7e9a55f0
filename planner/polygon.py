"""Signed distance to upright prisms over polygons, and to the fence that holds a flight.

A polygon is a closed ring of edges; the distance to it is the least distance to an edge, and the sign is the parity of
the edges that a ray to the east crosses. Any simple polygon is exact, convex or not; one that crosses itself counts as
filled where the parity is odd.

| symbol | identifier  | unit | meaning                                                        |
|--------|-------------|------|----------------------------------------------------------------|
| h      | `horizontal`| m    | signed distance to the polygon in the plane, negative inside   |
| v      | `vertical`  | m    | signed distance to the slab between floor and ceiling          |
| d      |             | m    | √(max(h,0)² + max(v,0)²) + min(max(h,v), 0), exact for a prism |

Edges come in blocks of `BLOCK`, so that a field of many polygons is one flat loop that XLA turns into vector code over
the points: no array of points × edges is ever made. The nearest edge is found without derivatives and measured again
with them, which is the derivative of the minimum.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Sequence
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from planner.near_lists import SPARE, NearLists, each_in_turn, most_cells, near_lists, nearest_somewhere
from planner.nearest import Distances, least

# Distance to what is not there: far outside any mission, harmless in single precision.
FAR_M = 1e6
BLOCK = 4
FEWEST_BLOCKS = 8
# Below this a square root has no usable slope: its derivative is taken as zero.
TINY_M2 = 1e-24

# What a formula takes and gives: numpy arrays in, numpy out; jax arrays in, jax out.
AnyArray = TypeVar("AnyArray", np.ndarray, Array)
Values = Any


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class Prisms:
    """Upright prisms over polygons, as blocks of edges.

    Attributes:
        start_m: Where an edge begins, shape (block, edge, 2).
        step_m: From there to its end; zero for the edges that fill a block.
        inverse_m2: One over the edge's squared length, zero where that is zero.
        first: 1 where a prism's edges begin, else 0.
        last: 1 where they end, else 0.
        floor_m: Lower end of the block's prism.
        ceiling_m: Upper end.
        near: Which blocks can be nearest where, those of a prism together; None: all of them anywhere.
    """

    start_m: Float[np.ndarray | Array, "block edge 2"]
    step_m: Float[np.ndarray | Array, "block edge 2"]
    inverse_m2: Float[np.ndarray | Array, "block edge"]
    first: Float[np.ndarray | Array, "block"]
    last: Float[np.ndarray | Array, "block"]
    floor_m: Float[np.ndarray | Array, "block"]
    ceiling_m: Float[np.ndarray | Array, "block"]
    near: NearLists | None = None

    @classmethod
    def of(
        cls,
        polygons_m: Sequence[Float[np.ndarray, "corner 2"]],
        floor_m: Sequence[float],
        ceiling_m: Sequence[float],
    ) -> Prisms:
        """Prisms, padded to one of few numbers of blocks (none stays none).

        Raises:
            ValueError: A polygon of fewer than three corners or without area.
        """
        starts, steps, first, last, owner = [], [], [], [], []
        for index, polygon in enumerate(polygons_m):
            corners = checked_polygon(polygon)
            blocks = -(-len(corners) // BLOCK)
            # A filler is a corner once more: an edge of no length changes neither distance nor parity.
            start = np.concatenate([corners, np.tile(corners[:1], (blocks * BLOCK - len(corners), 1))])
            step = np.zeros_like(start)
            step[: len(corners)] = np.roll(corners, -1, axis=0) - corners
            starts.append(start.reshape(blocks, BLOCK, 2))
            steps.append(step.reshape(blocks, BLOCK, 2))
            first += [1.0] + [0.0] * (blocks - 1)
            last += [0.0] * (blocks - 1) + [1.0]
            owner += [index] * blocks
        used = len(owner)
        total = 0 if used == 0 else padded_count(used, FEWEST_BLOCKS)
        absent = total - used
        start_m = np.concatenate([*starts, np.full((absent, BLOCK, 2), FAR_M)])
        step_m = np.concatenate([*steps, np.zeros((absent, BLOCK, 2))])
        squared = np.sum(step_m**2, axis=-1)
        return cls(
            start_m=start_m,
            step_m=step_m,
            inverse_m2=np.divide(1.0, squared, out=np.zeros_like(squared), where=squared > 0.0),
            first=np.array(first + [1.0] * absent),
            last=np.array(last + [1.0] * absent),
            floor_m=np.concatenate([np.asarray(floor_m, dtype=float)[owner], np.full(absent, -FAR_M)]),
            ceiling_m=np.concatenate([np.asarray(ceiling_m, dtype=float)[owner], np.full(absent, FAR_M)]),
        )

    def distance(self, x: Values, y: Values, z: Values) -> Values:
        """Signed distance to the nearest prism, for coordinates of one shape; negative inside.

        Numpy arrays are measured on the host in their own precision, jax arrays under jit with derivatives.
        """
        if self.first.shape[0] == 0:
            return x * 0.0 + FAR_M
        if isinstance(x, np.ndarray):
            return self._host_distance(x, y, z)
        still = jax.lax.stop_gradient((x, y, z))
        edge, sign = _nearest_edge(self, *still)
        start, step = (jnp.asarray(part).reshape(-1, 2)[edge] for part in (self.start_m, self.step_m))
        inverse = jnp.asarray(self.inverse_m2).reshape(-1)[edge]
        floor, ceiling = (jnp.asarray(part)[edge // BLOCK] for part in (self.floor_m, self.ceiling_m))
        squared = _edge(jnp, x, y, start, step, inverse)
        return extruded(jnp, sign * safe_sqrt(jnp, squared), jnp.maximum(floor - z, z - ceiling))

    def listed(self, low_m: Float[np.ndarray, "3"], high_m: Float[np.ndarray, "3"]) -> Prisms:
        """The same with lists of what is near in each part of a box."""
        begins, blocks, distances = self._by_prism()
        most = most_cells(len(self.first))
        lists = [
            np.concatenate([begins[prism] + np.arange(int(blocks[prism])) for prism in some])
            for some in nearest_somewhere(low_m, high_m, most, len(begins), distances)
        ]
        width = padded_count(max(map(len, lists)) + SPARE, FEWEST_BLOCKS)
        return dataclasses.replace(self, near=near_lists(low_m, high_m, most, lists, width))

    def _host_distance(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        _, blocks, distances = self._by_prism()
        return least(points, BLOCK * blocks, distances).reshape(x.shape)

    def _by_prism(self) -> tuple[Int[np.ndarray, "prism"], Int[np.ndarray, "prism"], Distances]:
        """The first block of each prism, how many it has, and distances to some of them."""
        begins = np.flatnonzero(self.first)
        blocks = np.diff(np.append(begins, len(self.first)))

        def to_some(
            points_m: Float[np.ndarray, "point 3"], prisms: Int[np.ndarray, "some"]
        ) -> Float[np.ndarray, "some point"]:
            """Every edge against every point, and the least over each prism."""
            count = blocks[prisms]
            here = np.cumsum(count) - count
            block = np.arange(count.sum()) + np.repeat(begins[prisms] - here, count)
            start, step, inverse = (part[block][:, :, None] for part in (self.start_m, self.step_m, self.inverse_m2))
            east, north, height = points_m.T
            squared = _edge(np, east, north, start, step, inverse).min(axis=1)
            crossed = _crossed(east, north, start, step).sum(axis=1)
            horizontal = np.sqrt(np.minimum.reduceat(squared, here, axis=0))
            inside = np.add.reduceat(crossed, here, axis=0) % 2 == 1
            floor, ceiling = self.floor_m[begins[prisms], None], self.ceiling_m[begins[prisms], None]
            vertical = np.maximum(floor - height, height - ceiling)
            return extruded(np, np.where(inside, -horizontal, horizontal), vertical)

        return begins, blocks, to_some


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class KeepIn:
    """A fence around a flight: signed distance in the plane, positive inside.

    Attributes:
        prism: The fence as one prism without floor or ceiling; none: no fence.
    """

    prism: Prisms

    @classmethod
    def of(cls, polygon_m: Float[np.ndarray, "corner 2"]) -> KeepIn:
        """The fence along a polygon.

        Raises:
            ValueError: Fewer than three corners, or no area.
        """
        return cls(Prisms.of([polygon_m], [-FAR_M], [FAR_M]))

    @classmethod
    def everywhere(cls) -> KeepIn:
        """No fence."""
        return cls(Prisms.of([], [], []))

    def distance(self, points_m: AnyArray) -> AnyArray:
        """Distance to the fence in metres, positive inside, negative outside.

        Args:
            points_m: Shape (..., 2), numpy or jax.
        """
        x, y = points_m[..., 0], points_m[..., 1]
        if self.prism.first.shape[0] == 0:
            return x * 0.0 + FAR_M
        return -self.prism.distance(x, y, x * 0.0)


def checked_polygon(polygon_m: Float[np.ndarray, "corner 2"]) -> Float[np.ndarray, "corner 2"]:
    """The corners of a polygon, the last not repeating the first.

    Raises:
        ValueError: Not finite, fewer than three corners, or no area.
    """
    corners = np.asarray(polygon_m, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or not np.isfinite(corners).all():
        raise ValueError(f"a polygon needs finite corners of shape (corner, 2), got shape {corners.shape}")
    if len(corners) > 1 and np.array_equal(corners[0], corners[-1]):
        corners = corners[:-1]
    if len(corners) < 3:
        raise ValueError(f"a polygon needs three corners or more, got {len(corners)}")
    centered = corners - corners.mean(axis=0)
    x, y = centered.T
    if not np.abs(x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0.0:
        raise ValueError("a polygon needs area: its corners lie on one line")
    return corners


def padded_count(count: int, fewest: int) -> int:
    """The next of 4, 6, 8, 12, 16, 24 …, at least `fewest`: sizes in few steps, so that compiled code is used again."""
    power = 1 << (max(count, fewest) - 1).bit_length()
    return power * 3 // 4 if max(count, fewest) <= power * 3 // 4 else power


def safe_sqrt(xp: types.ModuleType, squared: Values) -> Values:
    """√s with derivative zero at zero instead of NaN."""
    usable = squared > TINY_M2
    return xp.where(usable, xp.sqrt(xp.where(usable, squared, 1.0)), 0.0)


def extruded(xp: types.ModuleType, horizontal: Values, vertical: Values) -> Values:
    """Signed distance to an upright body from those to its cross-section and to its slab of heights."""
    beyond = xp.maximum(horizontal, 0.0) ** 2 + xp.maximum(vertical, 0.0) ** 2
    return safe_sqrt(xp, beyond) + xp.minimum(xp.maximum(horizontal, vertical), 0.0)


def _edge(xp: types.ModuleType, x: Values, y: Values, start: Values, step: Values, inverse: Values) -> Values:
    """Squared distance in the plane from points to edges."""
    east, north = x - start[..., 0], y - start[..., 1]
    share = xp.clip((east * step[..., 0] + north * step[..., 1]) * inverse, 0.0, 1.0)
    return (east - share * step[..., 0]) ** 2 + (north - share * step[..., 1]) ** 2


def _crossed(x: Values, y: Values, start: Values, step: Values) -> Values:
    """Whether a ray from the point to the east crosses the edge; an edge owns its lower end."""
    east, north = x - start[..., 0], y - start[..., 1]
    spans = (north < 0.0) != (north < step[..., 1])
    left = east * step[..., 1] < north * step[..., 0]
    return spans & (left == (step[..., 1] > 0.0))


@jax.jit  # traced once for all that calls it
def _nearest_edge(prisms: Prisms, x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    """For each point the edge (flat index) of the nearest prism, and −1 inside that prism's polygon, else 1."""
    everything = dataclasses.replace(prisms, near=None)

    def looked_at(carry: tuple[Array, ...], number: Array) -> tuple[Array, ...]:
        best, best_edge, best_sign, squared, edge, sign = carry
        # A filler begins a prism that has no edge and never ends.
        there, index = number >= 0, jnp.maximum(number, 0)
        prism: Prisms = jax.tree.map(lambda leaf: jnp.asarray(leaf)[index], everything)
        begins = (prism.first > 0.0) | ~there
        squared = jnp.where(begins, jnp.inf, squared)
        sign = jnp.where(begins, 1.0, sign)
        for part in range(BLOCK):
            start, step = prism.start_m[..., part, :], prism.step_m[..., part, :]
            found = _edge(jnp, x, y, start, step, prism.inverse_m2[..., part])
            edge = jnp.where(found < squared, index * BLOCK + part, edge)
            squared = jnp.minimum(squared, found)
            sign = jnp.where(_crossed(x, y, start, step), -sign, sign)
        vertical = jnp.maximum(prism.floor_m - z, z - prism.ceiling_m)
        distance = extruded(jnp, sign * jnp.sqrt(squared), vertical)
        nearer = (prism.last > 0.0) & there & (distance < best)
        best = jnp.where(nearer, distance, best)
        return (
            best,
            jnp.where(nearer, edge, best_edge),
            jnp.where(nearer, sign, best_sign),
            squared,
            edge,
            sign,
        )

    far, none, one = jnp.full_like(x, jnp.inf), jnp.zeros(x.shape, jnp.int32), jnp.ones_like(x)
    begin = (far, none, one, far, none, one)
    _, edge, sign, *_ = each_in_turn(looked_at, begin, prisms.first.shape[0], prisms.near, (x, y, z))
    return edge, sign
