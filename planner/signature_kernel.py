"""The signature kernel between paths (Salvi et al., 2021; SigSVGD).

k(x, y) = ⟨S(x), S(y)⟩ of the signatures S of two paths, lifted by a static kernel κ, solves the Goursat problem

    ∂²k/∂s∂t = ∂²κ(x_s, y_t)/∂s∂t · k,    k(0, ·) = k(·, 0) = 1,

without ever forming S. It compares paths as ordered curves: the same route at another pace is the same path.

| symbol | identifier        | unit  | shape             |
|--------|-------------------|-------|-------------------|
| x, y   | `one`, `other`    | unit  | knot axis         |
| Δ      | `increments()`    | 1     | segment segment   |
| κ      | `scale`·exp(−‖·‖²/`bandwidth`), or the inner product |||
| n      | `dyadic_order`    | 1     |                   |
| d²     | `squared`         | 1     | particle particle |
| h      | `width`           | 1     |                   |

How it is solved:

1. Second-order scheme over anti-diagonals, each segment cut into 2ⁿ parts. Differentiated by autodiff: the adjoint PDE
   of a well-known library is far off on rough paths.
2. Raw values grow like the exponential of the lengths, so candidates are compared by k̂ = k/√(k_xx k_yy), and κ is
   scaled until a typical k(x, x) is `SELF_VALUE`: much above it all paths look different, much below all look alike.
3. On rough paths the Gram matrix of the discretised kernel can turn indefinite and the cost is quadratic in the knots:
   candidates are averaged over `MOST_KNOTS` windows first.
4. Departure from SigSVGD: between candidates the kernel is exp(−d²/h), d² = 2 − 2k̂ the squared distance of their
   normalised signatures and h the median's (`planner.bandwidth`). Smooth paths between the same two ends have k̂ of 0.9
   and more; with k̂ itself all would take the mean of the scores and none would reach its own optimum, and the repulsion
   would be weak.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.bandwidth import median_bandwidth

MOST_KNOTS = 32
DYADIC_ORDER = 1
SELF_VALUE = 9.0
LIFTED_LENGTHS = (1.0, 64.0)
SCALING_PATHS = 4
BISECTIONS = 8
SMALLEST_BANDWIDTH_UNIT2 = 1e-6
PAIRS_AT_ONCE = 64
SMALLEST_WIDTH = 1e-4
"""Floor of h: what single precision leaves of d² between paths that coincide is some hundredths of it."""


def increments(
    one: Float[Array, "a axis"],
    other: Float[Array, "b axis"],
    bandwidth: float | Float[Array, ""] | None,
) -> Float[Array, "a-1 b-1"]:
    """Δ: the mixed second difference of the static kernel over every two segments.

    Args:
        one: A path's knots.
        other: Another's.
        bandwidth: h of exp(−‖x − y‖²/h); None: the inner product.
    """
    if bandwidth is None:
        return jnp.diff(one, axis=0) @ jnp.diff(other, axis=0).T
    squared = jnp.sum((one[:, None] - other[None]) ** 2, axis=-1)
    return jnp.diff(jnp.diff(jnp.exp(-squared / bandwidth), axis=0), axis=1)


def goursat(delta: Float[Array, "a b"], dyadic_order: int) -> Float[Array, ""]:
    """The kernel at the end of both paths, from Δ of their segments.

    Args:
        delta: Shape (a, b).
        dyadic_order: n; each cell is cut into 2ⁿ × 2ⁿ. The error falls by four with each, once small.
    """
    parts = 2**dyadic_order
    rows, columns = delta.shape[0] * parts, delta.shape[1] * parts
    # Node (i, s − i) of diagonal s closes the cell (i − 1, s − i − 1).
    node = np.arange(1, rows + 1)[None, :]
    column = np.arange(2, rows + columns + 1)[:, None] - node - 1
    inside = (column >= 0) & (column < columns)
    cell = delta[(node - 1) // parts, np.clip(column, 0, columns - 1) // parts] / parts**2
    cell = jnp.where(inside, cell, 0.0)

    def diagonal(carry: tuple[Array, Array], row: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        before_last, last = carry
        change, is_inside = row
        square = change**2 / 12.0
        beside = (last[1:] + last[:-1]) * (1.0 + 0.5 * change + square)
        value = jnp.where(is_inside, beside - before_last[:-1] * (1.0 - square), 1.0)
        return (last, jnp.concatenate([jnp.ones(1, delta.dtype), value])), None

    ones = jnp.ones(rows + 1, delta.dtype)
    (_, last), _ = jax.lax.scan(diagonal, (ones, ones), (cell, jnp.asarray(inside)))
    return last[-1]


def signature_kernel(
    one: Float[Array, "a axis"],
    other: Float[Array, "b axis"],
    *,
    bandwidth: float | Float[Array, ""] | None = None,
    scale: float | Float[Array, ""] = 1.0,
    dyadic_order: int = DYADIC_ORDER,
) -> Float[Array, ""]:
    """k(x, y) of two piecewise linear paths, not normalised.

    Args:
        one: Shape (a, axis), two knots or more.
        other: Shape (b, axis), two knots or more.
        bandwidth: h of the static kernel exp(−‖x − y‖²/h); None: the inner product.
        scale: Factor of the static kernel.
        dyadic_order: Refinement of the grid.

    Raises:
        ValueError: A path of fewer than two knots.
    """
    if min(one.shape[0], other.shape[0]) < 2:
        raise ValueError(f"a path needs two knots or more, got {one.shape[0]} and {other.shape[0]}")
    return goursat(scale * increments(one, other, bandwidth), dyadic_order)


def signature_terms(
    particles: Float[Array, "particle knot axis"],
) -> tuple[Float[Array, "particle particle"], Float[Array, "particle knot axis"]]:
    """Gram matrix and repulsion Σ_i ∇_{x_i} exp(−d²(x_i, x_j)/h), d the distance of normalised signatures.

    Args:
        particles: Shape (particle, knot, axis), two knots or more, unit cube.

    Returns:
        As `planner.kernels.kernel_terms`; bandwidths and scale follow the set and count as constants.
    """
    count = particles.shape[0]
    windows = window_means(particles.shape[1], MOST_KNOTS)
    paths = jnp.einsum("wk,nka->nwa", windows, particles)
    bandwidth, scale = static_kernel_of(paths)

    def raw(one: Array, other: Array) -> Array:
        return signature_kernel(one, other, bandwidth=bandwidth, scale=scale)

    def pair(indices: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
        return jax.value_and_grad(raw, argnums=(0, 1))(paths[indices[0]], paths[indices[1]])

    first, second = np.triu_indices(count)
    at_once = min(PAIRS_AT_ONCE, len(first))
    values, (by_first, by_second) = jax.lax.map(pair, (jnp.asarray(first), jnp.asarray(second)), batch_size=at_once)
    plain = jnp.zeros((count, count), particles.dtype).at[first, second].set(values).at[second, first].set(values)
    # by_one[i, j] = ∇_{x_i} k(x_i, x_j), the second argument held.
    by_one = jnp.zeros((count, count, *paths.shape[1:]), particles.dtype)
    by_one = by_one.at[first, second].set(by_first).at[second, first].set(by_second)
    own = jnp.diagonal(plain)
    weight = 1.0 / jnp.sqrt(own[:, None] * own[None, :])
    normalised = plain * weight
    # A path is no way from itself, and is not repelled by itself: rounding would have it otherwise.
    others = 1.0 - jnp.eye(count, dtype=particles.dtype)
    squared = jnp.maximum(2.0 - 2.0 * normalised, 0.0) * others
    width = median_bandwidth(squared, SMALLEST_WIDTH)
    gram = jnp.exp(-squared / width)
    by_normalised = others * gram * (2.0 / width)
    # Both arguments of k_xx move with x, hence twice by_one[i, i], which the half of the square root undoes.
    by_norm = by_one[np.arange(count), np.arange(count)] / own[:, None, None]
    by_raw = jnp.einsum("ij,ijwa->jwa", by_normalised * weight, by_one)
    repulsion = by_raw - jnp.einsum("ij,iwa->jwa", by_normalised * normalised, by_norm)
    return gram, jnp.einsum("wk,nwa->nka", windows, repulsion)


def static_kernel_of(
    paths: Float[Array, "particle knot axis"],
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Bandwidth and scale of the static kernel for a set of paths, without gradients.

    The bandwidth is twice the median squared distance of the set's points from their mean; the scale brings the median
    k(x, x) of a few paths to `SELF_VALUE`, by bisection over the length in the lift.
    """
    fixed = jax.lax.stop_gradient(paths)
    points = fixed.reshape(-1, fixed.shape[-1])
    spread = jnp.median(jnp.sum((points - jnp.mean(points, axis=0)) ** 2, axis=-1))
    bandwidth = jnp.maximum(2.0 * spread, SMALLEST_BANDWIDTH_UNIT2)
    step = jnp.sum(jnp.diff(fixed, axis=1) ** 2, axis=-1)
    lengths = jnp.sum(jnp.sqrt(-2.0 * jnp.expm1(-step / bandwidth)), axis=1)
    length = jnp.maximum(jnp.median(lengths), 1e-6)
    chosen = np.unique(np.linspace(0, paths.shape[0] - 1, SCALING_PATHS).astype(int))
    delta = jax.vmap(lambda path: increments(path, path, bandwidth))(fixed[chosen])

    def halve(_: int, bounds: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = bounds
        middle = jnp.sqrt(low * high)
        value = jnp.median(jax.vmap(lambda cells: goursat((middle / length) ** 2 * cells, 0))(delta))
        # What overflowed (also to not-a-number) is too long.
        short = value < SELF_VALUE
        return jnp.where(short, middle, low), jnp.where(short, high, middle)

    low, high = (jnp.asarray(bound, paths.dtype) for bound in LIFTED_LENGTHS)
    low, high = jax.lax.fori_loop(0, BISECTIONS, halve, (low, high))
    return bandwidth, low * high / length**2


def window_means(knots: int, most: int) -> Float[np.ndarray, "window knot"]:
    """Rows that average equal windows of the knots; the identity where there are no more than `most`."""
    windows = min(knots, most)
    edge = np.linspace(0.0, knots, windows + 1)
    index = np.arange(knots)
    shared = np.minimum(edge[1:, None], index + 1.0) - np.maximum(edge[:-1, None], index)
    return (np.maximum(shared, 0.0) * windows / knots).astype(np.float32)
