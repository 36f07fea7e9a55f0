"""Obstacles of any shape as one grid of signed distances: voxels, points, meshes, terrain.

The nodes hold distances that are exact (voxels, points) or proven not to be too great (meshes, terrain). Between nodes
two readings are offered: `distance`, a continuous interpolant for the optimiser, and `lower_bound`, the sharpest that
the nodes prove, for the gate. Neither is ever above the true distance, and the first is never above the second.

| symbol | identifier    | unit | meaning                                                              |
|--------|---------------|------|----------------------------------------------------------------------|
| d_c    | `values_m`    | m    | signed distance at node c, negative inside                           |
| a      | `half_diagonal_m` | m | half of a cell's diagonal: a trilinear blend is no more than a too high |

Why: d is 1-Lipschitz, so d(x) ≥ d_c − ‖x − c‖ for every node; a blend with weights w_c is at most Σ w_c ‖x − c‖ ≤ a
above the best of these. Outside the region R, with q the nearest point of R: where R holds all that is solid,
d(x)² ≥ ‖x − q‖² + d(q)², as the way from q into R makes no acute angle with the way from q to x; the ground goes on
beyond R, and there only d(x) ≥ d(q) − ‖x − q‖ is known.
"""

from __future__ import annotations

import dataclasses
import types

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy.ndimage import distance_transform_edt, label
from scipy.spatial import KDTree

from planner.polygon import AnyArray, Values, safe_sqrt
from planner.polyline import at_places
from planner.workspace import Workspace

MOST_NODES = 1_500_000
MOST_REFINEMENT = 4
# Triangles are cut until none reaches further from its middle than this share of a cell.
TRIANGLE_SHARE = 0.25
AIR_CELLS = 2
# Cells come in multiples of this, so that grids of similar size run compiled code.
CELLS_AT_ONCE = 8


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class DistanceGrid:
    """Signed distances at the nodes of a regular grid over a region.

    Attributes:
        low_m: The first node, shape (3,).
        cell_m: Distances between nodes along each axis, shape (3,).
        values_m: Shape (nx, ny, nz), two or more along each axis.
        holds_all: Whether nothing is solid beyond the region.
    """

    low_m: Float[np.ndarray | Array, "3"]
    cell_m: Float[np.ndarray | Array, "3"]
    values_m: Float[np.ndarray | Array, "nx ny nz"]
    holds_all: bool = dataclasses.field(default=True, metadata={"static": True})

    def distance(self, points_m: AnyArray) -> AnyArray:
        """A continuous distance that is nowhere above the true one, for points of shape (..., 3).

        Derivatives are finite everywhere; its slope is at most √3 where the nodes' blend is steepest.
        """
        if isinstance(points_m, np.ndarray):
            return self._interpolated(np, points_m)
        return self._interpolated(jnp, points_m)

    def lower_bound(self, points_m: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """The most that the nodes around each point prove of its distance, on the host."""
        place, beyond = self._place(np, points_m)
        index, share = _cell_of(np, place, self.values_m.shape)
        best = np.full(points_m.shape[:-1], -np.inf)
        for corner in np.ndindex(2, 2, 2):
            away = np.linalg.norm((share - np.array(corner)) * self.cell_m, axis=-1)
            best = np.maximum(best, self.values_m[tuple(np.moveaxis(index + np.array(corner), -1, 0))] - away)
        return self._outside(np, best, beyond)

    @property
    def half_diagonal_m(self) -> Values:
        """What a blend of a cell's nodes can be too high by."""
        return 0.5 * (self.cell_m**2).sum() ** 0.5

    def _place(self, xp: types.ModuleType, points: Values) -> tuple[Values, Values]:
        """Coordinates in cells of the nearest point of the region, and the squared distance to it."""
        last = np.array(self.values_m.shape) - 1
        inside = xp.clip(points, self.low_m, self.low_m + self.cell_m * last)
        return (inside - self.low_m) / self.cell_m, ((points - inside) ** 2).sum(axis=-1)

    def _interpolated(self, xp: types.ModuleType, points: Values) -> Values:
        place, beyond = self._place(xp, points)
        index, share = _cell_of(xp, place, self.values_m.shape)
        flat = xp.asarray(self.values_m).reshape(-1)
        _, ny, nz = self.values_m.shape
        base = (index[..., 0] * ny + index[..., 1]) * nz + index[..., 2]
        blend = 0.0
        for i, j, k in np.ndindex(2, 2, 2):
            weight = (
                (share[..., 0] if i else 1.0 - share[..., 0])
                * (share[..., 1] if j else 1.0 - share[..., 1])
                * (share[..., 2] if k else 1.0 - share[..., 2])
            )
            blend = blend + weight * flat[base + (i * ny + j) * nz + k]
        return self._outside(xp, blend - self.half_diagonal_m, beyond)

    def _outside(self, xp: types.ModuleType, inner: Values, beyond: Values) -> Values:
        """What follows beyond the region from the distance at its nearest point: the hypotenuse, or what is left."""
        if self.holds_all:
            outside = safe_sqrt(xp, beyond + xp.maximum(inner, 0.0) ** 2)
        else:
            outside = inner - safe_sqrt(xp, beyond)
        return xp.where(beyond > 0.0, outside, inner)


def from_voxels(
    occupied: Bool[np.ndarray, "nx ny nz"],
    low_m: Float[np.ndarray, "3"],
    cell_m: float | Float[np.ndarray, "3"],
    region: Workspace,
) -> DistanceGrid:
    """The exact signed distance to a set of cells.

    From a node of the cells' own lattice the nearest point of a cell is a node again, so the distance between nodes is
    the distance to the solid. Small grids are refined, which halves what interpolation must give away.

    Args:
        occupied: Which cells are solid; axes east, north, up.
        low_m: Lower corner of the first cell.
        cell_m: Edge lengths of a cell.
        region: Where distances are wanted; what of it is far from the cells, in a large one, gets rough ones.

    Raises:
        ValueError: No solid cell, or a cell without extent.
    """
    solid = np.asarray(occupied) != 0
    edge = np.broadcast_to(np.asarray(cell_m, dtype=float), (3,))
    if solid.ndim != 3 or not solid.any():
        raise ValueError(f"voxels need a three-dimensional array with solid cells, got shape {solid.shape}")
    if not (np.isfinite(edge).all() and (edge > 0.0).all()):
        raise ValueError(f"the cells of a grid need positive edges, got {edge.tolist()}")
    low = np.asarray(low_m, dtype=float)
    before = np.maximum(np.ceil((low - region.box_min_m) / edge), 1.0)
    after = np.maximum(np.ceil((region.box_max_m - low) / edge) - solid.shape, 1.0)
    share = 1.0
    while share > 0.01 and (
        _node_count(_rounded(solid.shape + np.ceil(share * before) + np.ceil(share * after))) > MOST_NODES
    ):
        share *= 0.9
    # At least one cell of air all around: the region holds the solid, and its border is outside.
    first = np.ceil(share * before).astype(int)
    last = _rounded(solid.shape + first + np.ceil(share * after)) - first - solid.shape
    padded = np.pad(solid, list(zip(first, last, strict=True)))
    refinement = 1
    while refinement < MOST_REFINEMENT and _node_count((refinement + 1) * np.array(padded.shape)) <= MOST_NODES:
        refinement += 1
    fine = np.kron(padded, np.ones((refinement,) * 3, dtype=bool)) if refinement > 1 else padded
    low = low - edge * first
    edge = edge / refinement
    outside = np.asarray(distance_transform_edt(~_nodes_of(fine), sampling=edge))
    # A node in a solid without air beside it lies as deep as the nearest node of air.
    inside = np.asarray(distance_transform_edt(~_nodes_of(~fine), sampling=edge))
    return DistanceGrid(low, edge, outside - inside)


def from_points(
    points_m: Float[np.ndarray, "point 3"], radius_m: float, region: Workspace, cell_m: float
) -> DistanceGrid:
    """Balls around points: the distance to the nearest point less the radius.

    Args:
        points_m: The points.
        radius_m: Of each ball.
        region: Where distances are wanted; it is widened to hold all balls.
        cell_m: Edge length of a cell; larger where that would be too many cells.

    Raises:
        ValueError: No point, or numbers that are not finite.
    """
    points = np.asarray(points_m, dtype=float)
    if points.ndim != 2 or points.shape[1:] != (3,) or len(points) == 0 or not np.isfinite(points).all():
        raise ValueError(f"a point cloud needs finite points of shape (point, 3), got {points.shape}")
    low, edge, nodes = _nodes_over(region, points.min(axis=0) - radius_m, points.max(axis=0) + radius_m, cell_m)
    distance, _ = KDTree(points).query(nodes.reshape(-1, 3))
    return DistanceGrid(low, edge, np.asarray(distance).reshape(nodes.shape[:-1]) - radius_m)


def from_mesh(
    vertices_m: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"], region: Workspace, cell_m: float
) -> DistanceGrid:
    """A closed surface of triangles; needs the `mesh` extra.

    Distances are those to the middles of small pieces of the surface, less how far the pieces reach. Outside is what
    can be reached from the border by steps that are too short to cross the surface; where that cannot be told (within
    about a cell of it), the node counts as inside.

    Args:
        vertices_m: Corners of the triangles.
        faces: Their indices.
        region: Where distances are wanted; it is widened to hold the surface.
        cell_m: Edge length of a cell; larger where that would be too many cells.

    Raises:
        ValueError: No triangle, or numbers that are not finite.
    """
    from trimesh.remesh import subdivide_to_size

    vertices, triangles = np.asarray(vertices_m, dtype=float), np.asarray(faces)
    if len(triangles) == 0 or not np.isfinite(vertices).all():
        raise ValueError("a mesh needs triangles with finite corners")
    low, edge, nodes = _nodes_over(region, vertices.min(axis=0), vertices.max(axis=0), cell_m)
    size = TRIANGLE_SHARE * float(edge.min()) * np.sqrt(3.0)
    pieces, indices = subdivide_to_size(vertices, triangles, max_edge=size, max_iter=30)[:2]
    corners = np.asarray(pieces)[np.asarray(indices)]
    middles = corners.mean(axis=1)
    reach = float(np.linalg.norm(corners - middles[:, None], axis=2).max())
    away = np.asarray(KDTree(middles).query(nodes.reshape(-1, 3))[0]).reshape(nodes.shape[:-1])
    proven = away - reach
    # Between two neighbours that are further from the surface than half a step there is none of it.
    regions = np.zeros(proven.shape, dtype=np.int32)
    label(proven > 0.5 * edge.max(), output=regions)
    border = np.ones(regions.shape, dtype=bool)
    border[1:-1, 1:-1, 1:-1] = False
    outside = np.isin(regions, np.setdiff1d(regions[border], 0))
    sure = outside.copy()
    for axis, shift in ((axis, shift) for axis in range(3) for shift in (1, -1)):
        # A node within its neighbour's distance is on the neighbour's side.
        free = np.roll(outside & (proven > edge[axis]), shift, axis=axis)
        free[(slice(None),) * axis + ((0 if shift == 1 else -1),)] = False
        sure |= free
    return DistanceGrid(low, edge, np.where(sure, proven, -away))


def from_heights(
    heights_m: Float[np.ndarray, "hx hy"],
    low_m: Float[np.ndarray, "2"],
    post_m: float,
    region: Workspace,
    cell_m: float,
    reach_m: float,
) -> DistanceGrid:
    """The ground: solid below heights that are known at posts and bilinear between them.

    What is solid is known in the region and as far around it as is said, and no node claims more than its distance to
    where it is not.

    Args:
        heights_m: Axes east, north.
        low_m: Where the first post stands.
        post_m: Distance between posts.
        region: Where distances are wanted; beyond the posts the outermost heights go on.
        cell_m: Edge length of a cell; larger where that would be too many cells.
        reach_m: How far beyond the region's sides the ground counts.

    Raises:
        ValueError: Heights that are not finite.
    """
    heights = np.asarray(heights_m, dtype=float)
    if heights.ndim != 2 or not np.isfinite(heights).all():
        raise ValueError(f"terrain needs finite heights along two axes, got shape {heights.shape}")
    around = np.array([reach_m, reach_m, 0.0])
    low, high = region.box_min_m - around, region.box_max_m + around
    size = _fitting_cell(high - low, cell_m)
    counts = np.maximum(np.ceil((high - low) / size).astype(int), 1)
    # On the lines of columns and posts together the surface is known at every corner of its pieces.
    surface, starts = heights, []
    for axis in (0, 1):
        lines = low[axis] + size * np.arange(counts[axis] + 1)
        posts = np.asarray(low_m, dtype=float)[axis] + post_m * np.arange(heights.shape[axis])
        both = np.unique(np.concatenate([lines, posts[(posts > lines[0]) & (posts < lines[-1])]]))
        place = np.clip((both - posts[0]) / post_m, 0.0, heights.shape[axis] - 1.0)
        surface = np.moveaxis(at_places(np.moveaxis(surface, axis, 0), place), 0, axis)
        starts.append(np.searchsorted(both, lines))
    # A column is as high as the highest ground in it.
    column = surface
    for axis, start in enumerate(starts):
        within = np.maximum.reduceat(column, start[:-1], axis=axis)
        column = np.maximum(within, np.take(column, start[1:], axis=axis))
    # Solid goes down past everything, so that no way leads under the ground.
    bottom = min(float(column.min()), float(low[2])) - 2.0 * size
    layers = int(np.ceil((high[2] - bottom) / size))
    floors = bottom + size * np.arange(layers)
    low[2] = bottom
    grid = from_voxels(column[:, :, None] > floors, low, size, Workspace(low, high))
    values = np.asarray(grid.values_m)
    for axis in range(3):
        node = grid.low_m[axis] + grid.cell_m[axis] * np.arange(values.shape[axis])
        # Above there is only air.
        wall = node - low[axis] if axis == 2 else np.minimum(node - low[axis], high[axis] - node)
        values = np.minimum(values, np.expand_dims(wall, [other for other in range(3) if other != axis]))
    return DistanceGrid(grid.low_m, grid.cell_m, values, holds_all=False)


def _cell_of(xp: types.ModuleType, place: Values, shape: tuple[int, ...]) -> tuple[Values, Values]:
    """Index of the cell, and where in it, 0 … 1 along each axis."""
    index = xp.clip(xp.floor(place), 0, np.array(shape) - 2).astype(int)
    return index, place - index


def _nodes_of(cells: Bool[np.ndarray, "nx ny nz"]) -> Bool[np.ndarray, "mx my mz"]:
    """Nodes that touch a cell of the set."""
    nodes = np.zeros(tuple(size + 1 for size in cells.shape), dtype=bool)
    for corner in np.ndindex(2, 2, 2):
        nodes[tuple(slice(c, c + size) for c, size in zip(corner, cells.shape, strict=True))] |= cells
    return nodes


def _rounded(cells: Float[np.ndarray, "3"]) -> Int[np.ndarray, "3"]:
    """So many cells, or a few more."""
    return (np.ceil(np.asarray(cells) / CELLS_AT_ONCE) * CELLS_AT_ONCE).astype(int)


def _node_count(cells: Float[np.ndarray, "3"]) -> float:
    return float(np.prod(np.asarray(cells) + 1.0))


def _fitting_cell(lengths_m: Float[np.ndarray, "3"], cell_m: float) -> float:
    """The cell wanted, or one large enough for the most nodes."""
    if not (np.isfinite(cell_m) and cell_m > 0.0):
        raise ValueError(f"the cells of a grid need positive edges, got {cell_m}")
    edge = cell_m
    while _node_count(_rounded(np.ceil(lengths_m / edge) + 2.0 * AIR_CELLS)) > MOST_NODES:
        edge *= 1.05
    return edge


def _nodes_over(
    region: Workspace, solid_low_m: Float[np.ndarray, "3"], solid_high_m: Float[np.ndarray, "3"], cell_m: float
) -> tuple[np.ndarray, np.ndarray, Float[np.ndarray, "nx ny nz 3"]]:
    """First node, edges and nodes of a grid over a region and what is solid, wider than both by cells of air."""
    low = np.minimum(region.box_min_m, solid_low_m)
    high = np.maximum(region.box_max_m, solid_high_m)
    edge = np.full(3, _fitting_cell(high - low, cell_m))
    counts = _rounded(np.ceil((high - low) / edge) + 2.0 * AIR_CELLS) + 1
    low = low - AIR_CELLS * edge
    axes = [low[axis] + edge[axis] * np.arange(counts[axis]) for axis in range(3)]
    return low, edge, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
