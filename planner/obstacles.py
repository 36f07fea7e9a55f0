"""What to stay away from, as signed distances in metres: negative inside, with finite derivatives everywhere.

Shapes are exact; voxels, points and meshes are grids of distances (`planner.distance_grid`), terrain and the heights
kept above it are surfaces (`planner.height_field`).

One formula a kind serves both the proof (numpy, double precision) and the optimiser (jax, single precision, inside jit,
vmap and grad). Over many obstacles the nearest is found without derivatives and measured again with them: the
derivative of the minimum, for a tenth of the work of differentiating through it.

They are dataclasses that JAX knows as trees, and no equinox modules: the host asks them often, and a module takes 20 µs
to bind a method.

Arrays are padded to a few sizes with obstacles at `FAR_M`, so that a mission of similar size runs compiled code.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Iterable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from planner.distance_grid import DistanceGrid
from planner.height_field import HeightField
from planner.near_lists import SPARE, NearLists, each_in_turn, most_cells, near_lists, nearest_somewhere
from planner.nearest import least
from planner.polygon import FAR_M, AnyArray, Prisms, Values, checked_polygon, extruded, padded_count

FEWEST_SHAPES = 8
MANY = 64
"""From so many solids, or blocks of edges, on lists of what is near cost less than looking at everything."""


@dataclasses.dataclass(frozen=True)
class Sphere:
    """A ball.

    Attributes:
        center_m: Shape (3,).
        radius_m: Positive.
    """

    center_m: Float[np.ndarray, "3"]
    radius_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center_m", _vector("center_m", self.center_m, 3))
        _positive("radius_m", self.radius_m)


@dataclasses.dataclass(frozen=True)
class Cylinder:
    """An upright cylinder.

    Attributes:
        center_m: Axis, shape (2,).
        radius_m: Positive.
        floor_m: Lower end.
        ceiling_m: Upper end.
    """

    center_m: Float[np.ndarray, "2"]
    radius_m: float
    floor_m: float
    ceiling_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center_m", _vector("center_m", self.center_m, 2))
        _positive("radius_m", self.radius_m)
        _positive("ceiling_m - floor_m", self.ceiling_m - self.floor_m)


@dataclasses.dataclass(frozen=True)
class Box:
    """A box along the axes.

    Attributes:
        min_m: Lower corner, shape (3,).
        max_m: Upper corner, shape (3,).
    """

    min_m: Float[np.ndarray, "3"]
    max_m: Float[np.ndarray, "3"]

    def __post_init__(self) -> None:
        low, high = _vector("min_m", self.min_m, 3), _vector("max_m", self.max_m, 3)
        object.__setattr__(self, "min_m", low)
        object.__setattr__(self, "max_m", high)
        for axis, extent in zip("xyz", high - low, strict=True):
            _positive(f"max_m - min_m along {axis}", float(extent))


@dataclasses.dataclass(frozen=True)
class Prism:
    """An upright prism over a simple polygon, convex or not.

    Attributes:
        polygon_m: Corners, shape (corner, 2), either way round.
        floor_m: Lower end.
        ceiling_m: Upper end.
    """

    polygon_m: Float[np.ndarray, "corner 2"]
    floor_m: float
    ceiling_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "polygon_m", checked_polygon(self.polygon_m))
        _positive("ceiling_m - floor_m", self.ceiling_m - self.floor_m)


Obstacle = Sphere | Cylinder | Box | Prism | DistanceGrid | HeightField


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class GrownBoxes:
    """Spheres, upright cylinders and boxes as arrays: boxes along the axes whose surface is moved outwards.

    A cylinder is an upright line grown in the plane, a sphere a point grown in space. With one formula for the three,
    what is compiled depends on how many there are, not on how many of which.

    Attributes:
        center_m: In the plane, shape (obstacle, 2).
        half_m: Half the extent in the plane, shape (obstacle, 2).
        floor_m: Lower end.
        ceiling_m: Upper end.
        planar_growth_m: How far the cross-section is grown.
        growth_m: How far the whole is grown after that.
        near: Which of them can be nearest where; None: all of them anywhere.
    """

    center_m: Float[np.ndarray | Array, "obstacle 2"]
    half_m: Float[np.ndarray | Array, "obstacle 2"]
    floor_m: Float[np.ndarray | Array, "obstacle"]
    ceiling_m: Float[np.ndarray | Array, "obstacle"]
    planar_growth_m: Float[np.ndarray | Array, "obstacle"]
    growth_m: Float[np.ndarray | Array, "obstacle"]
    near: NearLists | None = None

    @classmethod
    def of(cls, shapes: Sequence[Sphere | Cylinder | Box]) -> GrownBoxes:
        """Arrays, padded to one of few sizes (none stays none)."""
        used = len(shapes)
        total = 0 if used == 0 else padded_count(used, FEWEST_SHAPES)
        rows = np.zeros((total, 8))
        rows[used:, :2] = FAR_M
        for row, shape in zip(rows, shapes, strict=False):
            match shape:
                case Sphere(center_m=center, radius_m=radius):
                    row[:] = *center[:2], 0.0, 0.0, center[2], center[2], 0.0, radius
                case Cylinder(center_m=center, radius_m=radius, floor_m=floor, ceiling_m=ceiling):
                    row[:] = *center, 0.0, 0.0, floor, ceiling, radius, 0.0
                case Box(min_m=low, max_m=high):
                    row[:] = *((low + high) / 2.0)[:2], *((high - low) / 2.0)[:2], low[2], high[2], 0.0, 0.0
        return cls(rows[:, :2], rows[:, 2:4], *rows[:, 4:].T)

    def signed(self, xp: types.ModuleType, x: Values, y: Values, z: Values) -> Values:
        """Cross-section, grown in the plane, and slab, grown in space; both are extruded rectangles of distances."""
        east, north = (xp.abs(at - self.center_m[..., axis]) - self.half_m[..., axis] for axis, at in enumerate((x, y)))
        planar = extruded(xp, east, north) - self.planar_growth_m
        return extruded(xp, planar, xp.maximum(self.floor_m - z, z - self.ceiling_m)) - self.growth_m

    def distance(self, x: Values, y: Values, z: Values) -> Values:
        """Signed distance to the nearest, for coordinates of one shape; negative inside.

        Numpy arrays are measured on the host in their own precision, jax arrays under jit with derivatives.
        """
        if self.floor_m.shape[0] == 0:
            return x * 0.0 + FAR_M
        if isinstance(x, np.ndarray):
            points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
            return least(points, np.ones(self.floor_m.shape[0], dtype=int), self._to_some).reshape(x.shape)

        nearest = _nearest_body(self, *jax.lax.stop_gradient((x, y, z)))
        return self.numbered(nearest).signed(jnp, x, y, z)

    def listed(self, low_m: Float[np.ndarray, "3"], high_m: Float[np.ndarray, "3"]) -> GrownBoxes:
        """The same with lists of what is near in each part of a box."""
        bodies = self.floor_m.shape[0]
        most = most_cells(bodies)
        lists = nearest_somewhere(low_m, high_m, most, bodies, self._to_some)
        width = padded_count(max(map(len, lists)) + SPARE, FEWEST_SHAPES)
        # One body more than once is nearest all the same.
        full = [np.resize(some, width) for some in lists]
        return dataclasses.replace(self, near=near_lists(low_m, high_m, most, full, width))

    @property
    def _bodies(self) -> GrownBoxes:
        """Without lists."""
        return dataclasses.replace(self, near=None)

    def numbered(self, number: Array) -> GrownBoxes:
        """Some of them, under jit, by their numbers."""
        return jax.tree.map(lambda leaf: jnp.asarray(leaf)[number], self._bodies)

    def _to_some(
        self, points_m: Float[np.ndarray, "point 3"], bodies: Int[np.ndarray, "some"]
    ) -> Float[np.ndarray, "some point"]:
        some: GrownBoxes = jax.tree.map(lambda leaf: leaf[bodies, None], self._bodies)
        return some.signed(np, *points_m.T)


@jax.jit  # traced once for all that calls it
def _nearest_body(bodies: GrownBoxes, x: Array, y: Array, z: Array) -> Array:
    """Which body is nearest to each point."""

    def looked_at(carry: tuple[Array, Array], number: Array) -> tuple[Array, Array]:
        least, nearest = carry
        distance = bodies.numbered(number).signed(jnp, x, y, z)
        return jnp.minimum(least, distance), jnp.where(distance < least, number, nearest)

    begin = (jnp.full_like(x, jnp.inf), jnp.zeros(x.shape, jnp.int32))
    return each_in_turn(looked_at, begin, bodies.floor_m.shape[0], bodies.near, (x, y, z))[1]


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class ObstacleField:
    """All obstacles of a mission as one signed distance.

    Attributes:
        solids: Spheres, upright cylinders, and boxes along the axes.
        prisms: Upright prisms.
        grids: Anything else.
        surfaces: The ground, and the band of heights above it that paths keep.
    """

    solids: GrownBoxes
    prisms: Prisms
    grids: tuple[DistanceGrid, ...]
    surfaces: tuple[HeightField, ...] = ()

    @classmethod
    def of(cls, obstacles: Iterable[Obstacle]) -> ObstacleField:
        """The field of a list of obstacles; an empty list is allowed."""
        listed = list(obstacles)
        prisms = [o for o in listed if isinstance(o, Prism)]
        return cls(
            GrownBoxes.of([o for o in listed if isinstance(o, Sphere | Cylinder | Box)]),
            Prisms.of([p.polygon_m for p in prisms], [p.floor_m for p in prisms], [p.ceiling_m for p in prisms]),
            tuple(o for o in listed if isinstance(o, DistanceGrid)),
            tuple(o for o in listed if isinstance(o, HeightField)),
        )

    def listed(self, low_m: Float[np.ndarray, "3"], high_m: Float[np.ndarray, "3"]) -> ObstacleField:
        """The same distances inside a box, from lists of what is near in each part of it where there are many shapes.

        Args:
            low_m: Lower corner of the box.
            high_m: Upper corner.
        """
        many = self.solids.floor_m.shape[0] >= MANY, self.prisms.first.shape[0] >= MANY
        return dataclasses.replace(
            self,
            solids=self.solids.listed(low_m, high_m) if many[0] else self.solids,
            prisms=self.prisms.listed(low_m, high_m) if many[1] else self.prisms,
        )

    @property
    def has_height_limits(self) -> bool:
        """Whether heights above the ground are kept that are not the ground itself: their distances count as well."""
        return len(self.surfaces) > 1

    @property
    def standing(self) -> ObstacleField:
        """What stands on the ground or hangs in the air, without the ground itself and heights kept above it."""
        return dataclasses.replace(self, surfaces=())

    @property
    def below_lids(self) -> ObstacleField:
        """Everything but greatest heights above the ground: what a way high above it is to be kept from."""
        return dataclasses.replace(self, surfaces=tuple(one for one in self.surfaces if one.side > 0))

    def span_m(self, places_m: Float[np.ndarray, "*batch 2"], away_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest heights that are so far from every surface, at places of shape (..., 2)."""
        low, high = np.full(places_m.shape[:-1], -np.inf), np.full(places_m.shape[:-1], np.inf)
        for surface in self.surfaces:
            height = surface.free_from_m(places_m, away_m)
            low, high = (np.maximum(low, height), high) if surface.side > 0 else (low, np.minimum(high, height))
        return low, high

    @property
    def is_empty(self) -> bool:
        """Whether there is no obstacle at all."""
        return not any(leaf.size for leaf in jax.tree.leaves(self))

    def distance(self, points_m: AnyArray) -> AnyArray:
        """Signed distance to the nearest obstacle's surface, negative inside; `FAR_M` where there is none.

        Args:
            points_m: Shape (..., 3). Numpy arrays are measured on the host in their own precision; jax arrays under
                jit, vmap and grad.

        Returns:
            Metres, shape (...).
        """
        least: Values = self._to_shapes(points_m)
        minimum = np.minimum if isinstance(points_m, np.ndarray) else jnp.minimum
        for grid in (*self.grids, *self.surfaces):
            least = minimum(least, grid.distance(points_m))
        return least

    def lower_bound(self, points_m: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """The most that is proven of the distance, on the host: exact for shapes, for grids what the nodes prove."""
        least = self._to_shapes(points_m)
        for grid in (*self.grids, *self.surfaces):
            least = np.minimum(least, grid.lower_bound(points_m))
        return least

    def _to_shapes(self, points: Values) -> Values:
        """Exact distance to the nearest of all that is not a grid."""
        x, y, z = points[..., 0], points[..., 1], points[..., 2]
        minimum = np.minimum if isinstance(x, np.ndarray) else jnp.minimum
        return minimum(self.solids.distance(x, y, z), self.prisms.distance(x, y, z))


def _vector(name: str, value: Float[np.ndarray, "axis"], size: int) -> Float[np.ndarray, "axis"]:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise ValueError(f"{name} needs {size} finite numbers, got {value}")
    return vector


def _positive(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be positive and finite, got {value}")
