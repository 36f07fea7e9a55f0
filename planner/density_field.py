"""A density and its gradient at any point: what a metric that needs p(x) itself asks for.

| symbol | identifier      | unit       | shape      |
|--------|-----------------|------------|------------|
| p      | `field(points)` | 1/unit^axes| time       |
| g_v    | `kernel_sum`    | 1/unit^axes| time       |
| v      | `variance`      | unit², rad²| axis       |

Places are in the unit cube; a heading, where there is one, is the last axis, in radians, and wraps around.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.accelerator import with_exact_products
from planner.single_precision import single
from planner.trajectory import BLEND

ROWS_AT_ONCE = 128
# Beyond the box the field goes on a little, so that a path that strays outside is still drawn back.
MARGIN_UNIT = 0.125
FEWEST_NODES = 24
MOST_NODES = 160
BLURRED_NODES = (42, 84, 120, MOST_NODES)
"""A density that is blurred has one of these numbers of nodes along all axes that count, whatever its widths: where
information changes in flight, what was compiled serves on."""

ValueAndSlope = tuple[Float[Array, "time"], Float[Array, "time axis"]]


class SampleField(eqx.Module):
    """A mixture of equal normal densities around weighted samples: cost linear in the number of axes.

    Attributes:
        centers: Shape (sample, axis).
        weight: Shape (sample,), sums to one.
        variance: Shape (axis,).
        wraps: Whether the last axis is a heading.
    """

    centers: Float[Array, "sample axis"]
    weight: Float[Array, "sample"]
    variance: Float[Array, "axis"]
    wraps: bool = eqx.field(static=True)

    def __call__(self, points: Float[Array, "time axis"]) -> ValueAndSlope:
        """Density and gradient at points."""
        return kernel_sum(points, self.centers, self.weight, self.variance, self.wraps)


class GridField(eqx.Module):
    """A density on a regular grid, interpolated by cubic splines: its gradient is continuous.

    Attributes:
        coefficients: Spline coefficients at the nodes.
        low: Place of the first node, unit cube.
        spacing: Distance of the nodes.
    """

    coefficients: Float[Array, "n0 n1 n2"]
    low: Float[Array, "3"]
    spacing: Float[Array, "3"]

    def __call__(self, points: Float[Array, "time 3"]) -> ValueAndSlope:
        """Density and gradient at points; constant outside the nodes."""
        index, value, slope = self._near(points)
        window = self.coefficients[index[0][:, :, None, None], index[1][:, None, :, None], index[2][:, None, None, :]]
        along = jnp.einsum("tabc,tc->tab", window, value[2])
        density = jnp.einsum("tab,ta,tb->t", along, value[0], value[1])
        gradient = jnp.stack(
            [
                jnp.einsum("tab,ta,tb->t", along, slope[0], value[1]),
                jnp.einsum("tab,ta,tb->t", along, value[0], slope[1]),
                jnp.einsum("tabc,ta,tb,tc->t", window, value[0], value[1], slope[2]),
            ],
            axis=-1,
        )
        return density, gradient

    def basis(self, point: Float[Array, "3"]) -> Float[Array, "n0 n1 n2"]:
        """The spline of each node at a point: the coefficients times these are the density there."""
        index, value, _ = self._near(point[None])
        tables = [
            jnp.zeros(count, point.dtype).at[index[axis][0]].add(value[axis][0])
            for axis, count in enumerate(self.coefficients.shape)
        ]
        return jnp.einsum("a,b,c->abc", *tables)

    def spread(
        self, mean_basis: Float[Array, "n0 n1 n2"], variance: Float[Array, "3"], counts: Float[Array, "3"]
    ) -> GridField:
        """The density of points of which only the mean of `basis` is known, each a normal density of this variance.

        Exact but for what splines of these nodes lose of the normal density: a thousandth where nodes are half its
        width apart.

        Args:
            mean_basis: Σ_m w_m `basis`(x_m).
            variance: Of the normal density.
            counts: 1 for the axes that matter, else 0.
        """
        spread = mean_basis
        for axis, nodes in enumerate(mean_basis.shape):
            away = counts[axis] * self.spacing[axis] * (np.arange(nodes)[:, None] - np.arange(nodes))
            normal = jnp.exp(-0.5 * away**2 / variance[axis]) / jnp.sqrt(2.0 * jnp.pi * variance[axis])
            through = np.linalg.inv(_splines_at_nodes(nodes)).astype(np.float32)
            spread = jnp.moveaxis(jnp.tensordot(through @ normal @ through.T, spread, axes=(1, axis)), 0, axis)
        return GridField(spread, self.low, self.spacing)

    def _near(self, points: Float[Array, "time 3"]) -> tuple[list[Array], list[Array], list[Array]]:
        """Of each axis the four nodes around each point, and their splines and the splines' slopes there."""
        index, value, slope = [], [], []
        for axis, nodes in enumerate(self.coefficients.shape):
            place = jnp.clip((points[:, axis] - self.low[axis]) / self.spacing[axis], 1.0, nodes - 2.001)
            first = jnp.floor(place)
            part = place - first
            ones = jnp.ones_like(part)
            value.append(jnp.stack([ones, part, part**2, part**3], axis=1) @ BLEND.astype(points.dtype))
            rates = jnp.stack([jnp.zeros_like(part), ones, 2.0 * part, 3.0 * part**2], axis=1)
            slope.append(rates @ BLEND.astype(points.dtype) / self.spacing[axis])
            index.append(first.astype(jnp.int32)[:, None] + np.arange(-1, 3))
        return index, value, slope


class EveryHeading(eqx.Module):
    """Poses whose place has a density and whose heading is any, each as likely: p(x, ψ) = p(x)/2π.

    Blurred by the kernel it stays what it is along the heading, so that nothing has to be sampled.

    Attributes:
        places: The density of places.
    """

    places: GridField

    def __call__(self, points: Float[Array, "time 4"]) -> ValueAndSlope:
        """Density and gradient at poses."""
        density, slope = self.places(points[:, :3])
        turn = jnp.zeros_like(slope[:, :1])
        return density / (2.0 * jnp.pi), jnp.concatenate([slope, turn], axis=1) / (2.0 * jnp.pi)


@eqx.filter_jit
@with_exact_products
def density_at(field: SampleField | GridField | EveryHeading, points: Float[Array, "time axis"]) -> ValueAndSlope:
    """A density and its gradient at points, as one compiled program: for whoever makes a metric of it."""
    return field(points)


def grid_field(
    mass: Float[np.ndarray, "nx ny nz"],
    variance: Float[np.ndarray, "3"] | None = None,
    counts: tuple[bool, bool, bool] = (True, True, True),
) -> GridField:
    """The density of a grid of cells per unit of the unit cube, as it is or blurred by a normal density.

    Args:
        mass: Of each cell of a grid that fills the cube, of either sign; outside there is none.
        variance: v of the normal density it is convolved with, exactly; None: each node takes the mean density of the
            piece of space around it.
        counts: Which axes matter; along the others the density is the same everywhere.
    """
    from scipy.ndimage import spline_filter

    if variance is None:
        spread = [np.ceil((1.0 + 2.0 * MARGIN_UNIT) / (1.0 / cells)) for cells in mass.shape]
        wanted = [int(np.clip(nodes, FEWEST_NODES, MOST_NODES)) for nodes in spread]
    else:
        finest = 0.5 * float(np.sqrt(variance[np.array(counts)].min()))
        blurred = next((count for count in BLURRED_NODES if count * finest >= 1.0 + 2.0 * MARGIN_UNIT), MOST_NODES)
        wanted = [blurred if matters else FEWEST_NODES for matters in counts]
    per_axis, low, spacing = [], [], []
    for axis, (cells, nodes) in enumerate(zip(mass.shape, wanted, strict=True)):
        place = np.linspace(-MARGIN_UNIT, 1.0 + MARGIN_UNIT, nodes)
        step = place[1] - place[0]
        if counts[axis]:
            edges = np.linspace(0.0, 1.0, cells + 1)
            blur = None if variance is None else float(variance[axis])
            per_axis.append(_mean_over_cells(place, edges, step, blur))
        else:
            per_axis.append(np.ones((nodes, cells)))
        low.append(place[0])
        spacing.append(step)
    density = np.einsum("xyz,ax,by,cz->abc", mass, *per_axis, optimize=True)
    coefficients = spline_filter(density, order=3, mode="mirror")
    return GridField(single(coefficients), single(low), single(spacing))


def density_at_centers(
    mass: Float[np.ndarray, "nx ny nz"],
    variance: Float[np.ndarray, "3"] | None = None,
    counts: tuple[bool, bool, bool] = (True, True, True),
) -> Float[np.ndarray, "nx ny nz"]:
    """What `grid_field` interpolates, at the centres of the cells."""
    per_axis = []
    for axis, cells in enumerate(mass.shape):
        edges = np.linspace(0.0, 1.0, cells + 1)
        place = 0.5 * (edges[1:] + edges[:-1])
        blur = None if variance is None else float(variance[axis])
        per_axis.append(_mean_over_cells(place, edges, 1.0 / cells, blur) if counts[axis] else np.ones((cells, cells)))
    return np.einsum("xyz,ax,by,cz->abc", mass, *per_axis, optimize=True)


def kernel_sum(
    points: Float[Array, "time axis"],
    centers: Float[Array, "sample axis"],
    weight: Float[Array, "sample"],
    variance: Float[Array, "axis"],
    wraps: bool,
) -> ValueAndSlope:
    """Σ_m w_m g(x, y_m) and its gradient in x, g the normal density of variance v (wrapped on a heading).

    Some rows at a time: points × samples never lie in memory at once.
    """
    axes = points.shape[1] - wraps
    straight, spread = centers[:, :axes], variance[:axes]
    norm = jnp.prod(2.0 * jnp.pi * variance) ** -0.5
    # Moments of the weights: one product of matrices gives the density and what its gradient needs.
    moments = norm * weight[:, None] * jnp.concatenate([jnp.ones_like(straight[:, :1]), straight], axis=1)
    scaled = straight * spread**-0.5

    def row(point: Float[Array, "axis"]) -> tuple[Array, Array]:
        place = point[:axes]
        here = place * spread**-0.5
        # Axis by axis: an array whose last dimension is three is slow to run through.
        squared = sum((here[axis] - scaled[:, axis]) ** 2 for axis in range(axes))
        if not wraps:
            total = jnp.exp(-0.5 * squared) @ moments
            return total[0], (total[1:] - total[0] * place) / spread
        near, share, falls = _around(point[-1] - centers[:, -1], variance[-1])
        # One exponential for the place and the nearer image together.
        density = jnp.exp(-0.5 * (squared + near**2 / variance[-1])) * (1.0 + share)
        total = density @ moments
        gradient = (total[1:] - total[0] * place) / spread
        turn = -jnp.dot(density * falls, moments[:, 0]) / variance[-1]
        return total[0], jnp.concatenate([gradient, turn[None]])

    return jax.lax.map(row, points, batch_size=min(ROWS_AT_ONCE, points.shape[0]))


def _around(angle: Float[Array, "sample"], variance: Float[Array, ""]) -> tuple[Array, Array, Array]:
    """The wrapped normal density, as the nearer image and what the farther one adds: exact up to 1 rad².

    Returns:
        The angle to the nearer image; the density of the farther one as a share of the nearer one's; the angle by which
        both together fall, −v·∂log g.
    """
    near = angle - 2.0 * jnp.pi * jnp.round(angle / (2.0 * jnp.pi))
    share = jnp.exp(-2.0 * jnp.pi * (jnp.pi - jnp.abs(near)) / variance)
    return near, share, near - 2.0 * jnp.pi * jnp.sign(near) * share / (1.0 + share)


def _splines_at_nodes(nodes: int) -> Float[np.ndarray, "node spline"]:
    """What each node's spline is at each node; beyond the ends it is mirrored, as in `grid_field`."""
    at = (4.0 * np.eye(nodes) + np.eye(nodes, k=1) + np.eye(nodes, k=-1)) / 6.0
    at[0, 1] = at[-1, -2] = 2.0 / 6.0
    return at


def _mean_over_cells(
    place: Float[np.ndarray, "node"], edges: Float[np.ndarray, "edge"], step: float, variance: float | None
) -> Float[np.ndarray, "node cell"]:
    """What a unit mass spread over each cell gives as density at each node."""
    if variance is None:
        low, high = place[:, None] - 0.5 * step, place[:, None] + 0.5 * step
        shared = np.minimum(high, edges[None, 1:]) - np.maximum(low, edges[None, :-1])
        return np.maximum(shared, 0.0) / (step * np.diff(edges))
    from scipy.special import ndtr

    return -np.diff(ndtr((place[:, None] - edges[None, :]) / np.sqrt(variance)), axis=1) / np.diff(edges)
