"""What to stay away from, as signed distances in metres: negative inside, with finite derivatives everywhere.

Shapes are exact; voxels, points and meshes are grids of distances (`planner.distance_grid`), terrain and the heights
kept above it are surfaces (`planner.height_field`).

One formula a kind serves both the proof (numpy, double precision) and the optimiser (jax, single precision, inside jit,
vmap and grad). Over many obstacles the nearest is found without derivatives and measured again with them: the
derivative of the minimum, for a tenth of the work of differentiating through it.

Arrays are padded to a few sizes with obstacles at `FAR_M`, so that a mission of similar size runs compiled code.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Iterable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.distance_grid import DistanceGrid
from planner.height_field import HeightField
from planner.polygon import FAR_M, AnyArray, Prisms, Values, checked_polygon, extruded, padded_count, safe_sqrt

FEWEST_OF_A_KIND = 4
# On the host, points are taken in portions whose intermediate arrays stay in the cache.
HOST_ELEMENTS = 1 << 20


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


class Spheres(eqx.Module):
    """Balls as arrays."""

    center_m: Float[np.ndarray | Array, "obstacle 3"]
    radius_m: Float[np.ndarray | Array, "obstacle"]

    @classmethod
    def of(cls, spheres: Sequence[Sphere]) -> Spheres:
        """Padded arrays."""
        return cls(_padded([s.center_m for s in spheres], (3,)), _padded([s.radius_m for s in spheres], (), 1.0))

    def signed(self, xp: types.ModuleType, x: Values, y: Values, z: Values) -> Values:
        """‖p − c‖ − r."""
        c = self.center_m
        return safe_sqrt(xp, (x - c[..., 0]) ** 2 + (y - c[..., 1]) ** 2 + (z - c[..., 2]) ** 2) - self.radius_m


class Cylinders(eqx.Module):
    """Upright cylinders as arrays."""

    center_m: Float[np.ndarray | Array, "obstacle 2"]
    radius_m: Float[np.ndarray | Array, "obstacle"]
    floor_m: Float[np.ndarray | Array, "obstacle"]
    ceiling_m: Float[np.ndarray | Array, "obstacle"]

    @classmethod
    def of(cls, cylinders: Sequence[Cylinder]) -> Cylinders:
        """Padded arrays."""
        return cls(
            _padded([c.center_m for c in cylinders], (2,)),
            _padded([c.radius_m for c in cylinders], (), 1.0),
            _padded([c.floor_m for c in cylinders], (), 0.0),
            _padded([c.ceiling_m for c in cylinders], (), 1.0),
        )

    def signed(self, xp: types.ModuleType, x: Values, y: Values, z: Values) -> Values:
        """Circle and slab, extruded."""
        c = self.center_m
        horizontal = safe_sqrt(xp, (x - c[..., 0]) ** 2 + (y - c[..., 1]) ** 2) - self.radius_m
        return extruded(xp, horizontal, xp.maximum(self.floor_m - z, z - self.ceiling_m))


class Boxes(eqx.Module):
    """Boxes along the axes as arrays."""

    center_m: Float[np.ndarray | Array, "obstacle 3"]
    half_m: Float[np.ndarray | Array, "obstacle 3"]

    @classmethod
    def of(cls, boxes: Sequence[Box]) -> Boxes:
        """Padded arrays."""
        return cls(
            _padded([(b.max_m + b.min_m) / 2.0 for b in boxes], (3,)),
            _padded([(b.max_m - b.min_m) / 2.0 for b in boxes], (3,), 1.0),
        )

    def signed(self, xp: types.ModuleType, x: Values, y: Values, z: Values) -> Values:
        """‖max(q, 0)‖ + min(max q, 0) with q = |p − c| − half."""
        c, half = self.center_m, self.half_m
        qx, qy, qz = (xp.abs(part - c[..., axis]) - half[..., axis] for axis, part in enumerate((x, y, z)))
        beyond = xp.maximum(qx, 0.0) ** 2 + xp.maximum(qy, 0.0) ** 2 + xp.maximum(qz, 0.0) ** 2
        return safe_sqrt(xp, beyond) + xp.minimum(xp.maximum(qx, xp.maximum(qy, qz)), 0.0)


Kind = Spheres | Cylinders | Boxes


class ObstacleField(eqx.Module):
    """All obstacles of a mission as one signed distance.

    Attributes:
        spheres: Balls.
        cylinders: Upright cylinders.
        boxes: Boxes along the axes.
        prisms: Upright prisms.
        grids: Anything else.
        surfaces: The ground, and the band of heights above it that paths keep.
    """

    spheres: Spheres
    cylinders: Cylinders
    boxes: Boxes
    prisms: Prisms
    grids: tuple[DistanceGrid, ...]
    surfaces: tuple[HeightField, ...] = ()

    @classmethod
    def of(cls, obstacles: Iterable[Obstacle]) -> ObstacleField:
        """The field of a list of obstacles; an empty list is allowed."""
        listed = list(obstacles)
        prisms = [o for o in listed if isinstance(o, Prism)]
        return cls(
            Spheres.of([o for o in listed if isinstance(o, Sphere)]),
            Cylinders.of([o for o in listed if isinstance(o, Cylinder)]),
            Boxes.of([o for o in listed if isinstance(o, Box)]),
            Prisms.of([p.polygon_m for p in prisms], [p.floor_m for p in prisms], [p.ceiling_m for p in prisms]),
            tuple(o for o in listed if isinstance(o, DistanceGrid)),
            tuple(o for o in listed if isinstance(o, HeightField)),
        )

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
        if not isinstance(points, np.ndarray):
            return self._nearest(points[..., 0], points[..., 1], points[..., 2])
        flat = points.reshape(-1, 3)
        shapes = (self.spheres, self.cylinders, self.boxes, self.prisms)
        per_point = max((leaf.size for leaf in jax.tree.leaves(shapes)), default=1)
        portions = np.array_split(flat, max(1, -(-len(flat) * per_point // HOST_ELEMENTS)))
        found = [self._nearest(part[:, 0], part[:, 1], part[:, 2]) for part in portions]
        return np.concatenate(found).reshape(points.shape[:-1])

    def _nearest(self, x: Values, y: Values, z: Values) -> Values:
        least = self.prisms.distance(x, y, z)
        minimum = np.minimum if isinstance(x, np.ndarray) else jnp.minimum
        for kind in (self.spheres, self.cylinders, self.boxes):
            if kind.center_m.shape[0] > 0:
                least = minimum(least, _least_of_kind(kind, x, y, z))
        return least


def _least_of_kind(kind: Kind, x: Values, y: Values, z: Values) -> Values:
    """Signed distance to the nearest obstacle of one kind."""
    if isinstance(x, np.ndarray):
        spread: Kind = jax.tree.map(lambda leaf: leaf[:, None], kind)
        return spread.signed(np, x[None], y[None], z[None]).min(axis=0)

    still = jax.lax.stop_gradient((x, y, z))

    def body(carry: tuple[Array, Array], one: tuple[Kind, Array]) -> tuple[tuple[Array, Array], None]:
        least, nearest = carry
        distance = one[0].signed(jnp, *still)
        return (jnp.minimum(least, distance), jnp.where(distance < least, one[1], nearest)), None

    count = kind.center_m.shape[0]
    begin = (jnp.full_like(x, jnp.inf), jnp.zeros(x.shape, jnp.int32))
    (_, nearest), _ = jax.lax.scan(body, begin, (kind, jnp.arange(count, dtype=jnp.int32)))
    chosen: Kind = jax.tree.map(lambda leaf: jnp.asarray(leaf)[nearest], kind)
    return chosen.signed(jnp, x, y, z)


def _padded(rows: Sequence[np.ndarray] | Sequence[float], shape: tuple[int, ...], absent: float = FAR_M) -> np.ndarray:
    """Rows as one array, padded to one of few sizes (none stays none)."""
    count = len(rows)
    total = 0 if count == 0 else padded_count(count, FEWEST_OF_A_KIND)
    array = np.full((total, *shape), absent)
    if count:
        array[:count] = np.asarray(rows, dtype=float)
    return array


def _vector(name: str, value: Float[np.ndarray, "axis"], size: int) -> Float[np.ndarray, "axis"]:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise ValueError(f"{name} needs {size} finite numbers, got {value}")
    return vector


def _positive(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be positive and finite, got {value}")
