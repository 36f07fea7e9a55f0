"""The Stein direction of candidates, whose kernel compares the paths that they lead to.

| symbol | identifier  | unit      | shape               |
|--------|-------------|-----------|---------------------|
| x_i    | `particles` | as wanted | particle knot axis  |
| M      | `to_path`   | unit/x    | time knot           |
| ∇log p | `score`     | 1/x       | particle knot axis  |
| γ      | `weight`    | 1         |                     |

Paths are linear in their parameters (spline through knots, place after controls): y = y₀ + Mx, and gradients come back
by Mᵀ whichever path they belong to.
"""

from __future__ import annotations

import dataclasses
import enum

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.kernels import kernel_terms
from planner.problem import Kernel
from planner.signature_kernel import signature_kernel


class Contender(enum.Enum):
    """Who shares whose score, and who repels whom.

    `OWN` repels by the product's signature kernel and shares nothing, as `planner.control` does.
    """

    PRINTED = "signature, as printed"
    SIGNATURE = "signature, product"
    OWN = "signature, own scores"
    RBF = "RBF on the parameters"
    MARKOV = "Markov RBF on the path"
    IDENTITY = "independent"


KERNELS = {
    Contender.SIGNATURE: Kernel.SIGNATURE,
    Contender.OWN: Kernel.SIGNATURE,
    Contender.RBF: Kernel.RBF,
    Contender.MARKOV: Kernel.MARKOV,
    Contender.IDENTITY: Kernel.IDENTITY,
}


@dataclasses.dataclass(frozen=True)
class PathOf:
    """How parameters become the path that a kernel sees, in the unit square.

    Attributes:
        to_path: M, shape (time, knot).
        bandwidth: h of the static kernel as printed, unit².
    """

    to_path: Float[np.ndarray | Array, "time knot"]
    bandwidth: float


def direction(
    contender: Contender,
    particles: Float[Array, "particle knot axis"],
    score: Float[Array, "particle knot axis"],
    weight: Float[Array, ""] | float,
    path_of: PathOf,
    offset: Float[Array, "time axis"],
) -> Float[Array, "particle knot axis"]:
    """φ of every candidate.

    Args:
        contender: The kernel, and whether it compares paths or their parameters.
        particles: Knots or controls.
        score: ∇log p of each.
        weight: Of the repulsion.
        path_of: How they become paths.
        offset: y₀, unit square.
    """
    if contender in (Contender.RBF, Contender.IDENTITY):
        gram, repulsion = kernel_terms(KERNELS[contender], particles)
    else:
        matrix = jnp.asarray(path_of.to_path, particles.dtype)
        paths = offset + jnp.einsum("tk,nka->nta", matrix, particles)
        if contender is Contender.PRINTED:
            gram, by_path = printed_terms(paths, path_of.bandwidth)
        else:
            gram, by_path = kernel_terms(KERNELS[contender], paths)
        repulsion = jnp.einsum("tk,nta->nka", matrix, by_path)
    if contender is Contender.OWN:
        gram = jnp.eye(particles.shape[0], dtype=particles.dtype)
    return (jnp.einsum("ij,ikd->jkd", gram, score) + weight * repulsion) / particles.shape[0]


def printed_terms(
    paths: Float[Array, "particle time axis"], bandwidth: float
) -> tuple[Float[Array, "particle particle"], Float[Array, "particle time axis"]]:
    """Gram matrix and repulsion of the paper's kernel: k itself, with a static kernel of fixed bandwidth."""

    def pair(indices: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
        def kernel(one: Array, other: Array) -> Array:
            return signature_kernel(one, other, bandwidth=bandwidth)

        return jax.value_and_grad(kernel, argnums=(0, 1))(paths[indices[0]], paths[indices[1]])

    count = paths.shape[0]
    first, second = np.triu_indices(count)
    values, (by_first, by_second) = jax.lax.map(pair, (jnp.asarray(first), jnp.asarray(second)), batch_size=64)
    gram = jnp.zeros((count, count), paths.dtype).at[first, second].set(values).at[second, first].set(values)
    apart = jnp.asarray(first != second, paths.dtype)[:, None, None]
    return gram, jnp.zeros_like(paths).at[second].add(by_first).at[first].add(apart * by_second)
