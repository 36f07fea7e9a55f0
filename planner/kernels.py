"""Kernels between candidates: who shares whose score, and who repels whom.

φ(x_j) = (1/N) Σ_i [ k(x_i, x_j) ∇log p(x_i|O) + ∇_{x_i} k(x_i, x_j) ] (SVES eq. 12) needs the Gram matrix and the
repulsion Σ_i ∇_{x_i} k(x_i, x_j); each kernel gives both, without an array of particle × particle × knot × axis.

| symbol              | identifier  | unit  | shape             |
|---------------------|-------------|-------|-------------------|
| x_i                 | `particles` | unit  | particle knot axis|
| k(x_i, x_j)         | `gram`      | 1     | particle particle |
| Σ_i ∇_{x_i}k        | `repulsion` | 1/unit| particle knot axis|
| h                   | `bandwidth` | unit² |                   |

Kernels (‖·‖ is over knots and axes unless a time is named):

* RBF: exp(−‖x − x'‖²/h).
* Markov RBF: the mean over pairs of times of exp(−‖x_t − x'_t'‖²/h), the pairs being t' = t and its neighbours
  t' = t ± 1 (SVES eq. 23), or all of them (the complete graph).
* Signature: `planner.signature_kernel`.
* Identity: k(x_i, x_j) = 1 where i = j, else 0: each candidate descends alone.
* Constant: k ≡ 1: all take the mean of the scores and never part; kept to show that collapse.

Departures from SVES:

1. Eq. (23) lost a prime: the second term is k(x_t, x'_t'), or it would not compare two paths.
2. The Markov kernel is a mean over its pairs and not their sum: k(x, x) stays near one, and the step size does not
   depend on the number of knots.
3. h follows the set (`median/log(N + 1)`), counts as a constant in the gradient, and has a floor.
4. A heading that is planned with the path (the last axis, in turns) is compared on a circle whose circumference is the
   length of the box: a quarter turn apart is a quarter of the box apart, and a whole turn is none. Repulsion is taken
   along that circle.
"""

from __future__ import annotations

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.accelerator import ROUNDED
from planner.bandwidth import median_bandwidth
from planner.problem import Kernel
from planner.signature_kernel import signature_terms

SMALLEST_BANDWIDTH_PER_KNOT = 1e-6
"""Floor of h, unit² for each knot: candidates closer than a thousandth of the box count as coinciding."""

BANDWIDTH_DISTANCES = 500

FEW = 8
"""Distances of so many candidates take less time one by one than by a product of matrices."""

Terms = tuple[Float[Array, "particle particle"], Float[Array, "particle knot axis"]]


def kernel_terms(kernel: Kernel, particles: Float[Array, "particle knot axis"], *, wraps: bool = False) -> Terms:
    """Gram matrix and repulsion of a set.

    Args:
        kernel: Which kernel; resolved when the caller is traced.
        particles: Shape (particle, knot, axis), unit cube.
        wraps: Whether the last axis is a heading, in turns.

    Returns:
        `gram`, shape (particle, particle): k(x_i, x_j); `repulsion`, shape of the particles: Σ_i ∇_{x_i} k(x_i, x_j).
    """
    if wraps:
        return _terms_on_circle(kernel, particles)
    count = particles.shape[0]
    match kernel:
        case Kernel.RBF:
            return rbf_terms(particles)
        case Kernel.MARKOV:
            return markov_terms(particles, neighbours=1)
        case Kernel.MARKOV_COMPLETE:
            return markov_complete_terms(particles)
        case Kernel.IDENTITY:
            return jnp.eye(count, dtype=particles.dtype), jnp.zeros_like(particles)
        case Kernel.CONSTANT:
            return jnp.ones((count, count), particles.dtype), jnp.zeros_like(particles)
        case Kernel.SIGNATURE:
            return signature_terms(particles)


def _terms_on_circle(kernel: Kernel, particles: Float[Array, "particle knot axis"]) -> Terms:
    """The terms of candidates whose heading is a place on a circle."""
    angle = 2.0 * jnp.pi * particles[..., -1:]
    east, north = jnp.cos(angle), jnp.sin(angle)
    circle = jnp.concatenate([east, north], axis=-1) / (2.0 * jnp.pi)
    gram, repulsion = kernel_terms(kernel, jnp.concatenate([particles[..., :-1], circle], axis=-1))
    # A turn moves a place on the circle by its circumference, one.
    along = east * repulsion[..., -1:] - north * repulsion[..., -2:-1]
    return gram, jnp.concatenate([repulsion[..., :-2], along], axis=-1)


def rbf_terms(particles: Float[Array, "particle knot axis"]) -> Terms:
    """RBF with the median heuristic; Σ_i ∇_{x_i}k(x_i, x_j) = −(2/h)(Kᵀx − diag(Kᵀ1)x)."""
    count, knots = particles.shape[:2]
    # Around the mean: the product below would otherwise lose small differences of large positions.
    flat = (particles - jnp.mean(particles, axis=0)).reshape(count, -1)
    if count <= FEW:
        squared = jnp.sum((flat[:, None] - flat[None]) ** 2, axis=-1)
    else:
        norm = jnp.sum(flat**2, axis=1)
        squared = jnp.maximum(norm[:, None] + norm[None, :] - 2.0 * jnp.matmul(flat, flat.T, precision=ROUNDED), 0.0)
        squared = squared * (1.0 - jnp.eye(count, dtype=flat.dtype))
    bandwidth = median_bandwidth(squared, SMALLEST_BANDWIDTH_PER_KNOT * knots)
    gram = jnp.exp(-squared / bandwidth)
    pulled = jnp.matmul(gram.T, flat, precision=ROUNDED)
    repulsion = (-2.0 / bandwidth) * (pulled - jnp.sum(gram, axis=0)[:, None] * flat)
    return gram, repulsion.reshape(particles.shape)


def markov_terms(particles: Float[Array, "particle knot axis"], neighbours: int) -> Terms:
    """Markov RBF over the pairs of times no more than `neighbours` apart (SVES eq. 23)."""
    count, knots, axes = particles.shape
    bandwidth = _bandwidth_over_time(jnp.swapaxes(particles, 0, 1))
    # Times side by side: sums over a last axis of three would be slow.
    along = jnp.moveaxis(particles, 2, 0)
    reach = min(neighbours, knots - 1)
    pairs = sum(knots - abs(offset) for offset in range(-reach, reach + 1))
    gram = jnp.zeros((count, count), particles.dtype)
    repulsion = jnp.zeros((axes, count, knots), particles.dtype)
    for offset in range(reach + 1):
        # Pairs (t, t + offset) of every two particles; read the other way round they are the pairs (t + offset, t).
        last = knots - offset
        apart = along[:, :, None, :last] - along[:, None, :, offset:]
        alike = jnp.exp(-functools.reduce(jnp.add, (part**2 for part in apart)) / bandwidth)
        together = jnp.sum(alike, axis=-1)
        pulled = jnp.stack([alike * part for part in apart])
        gram = gram + together
        repulsion = repulsion.at[:, :, :last].add(jnp.sum(pulled, axis=1))
        if offset:
            gram = gram + together.T
            repulsion = repulsion.at[:, :, offset:].add(-jnp.sum(pulled, axis=2))
    return gram / pairs, jnp.moveaxis((-2.0 / (bandwidth * pairs)) * repulsion, 0, 2)


def markov_complete_terms(particles: Float[Array, "particle knot axis"]) -> Terms:
    """Markov RBF over all pairs of times: alike are paths that visit the same places, in whatever order.

    One pair of particles at a time, since all pairs of particles and times do not fit into memory.
    """
    count, knots, _ = particles.shape
    bandwidth = _bandwidth_over_time(jnp.swapaxes(particles, 0, 1))

    def one_pair(indices: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
        one, other = particles[indices[0]], particles[indices[1]]
        alike = jnp.exp(-_squared_distances(one, other) / bandwidth)
        by_one = alike @ other - jnp.sum(alike, axis=1)[:, None] * one
        by_other = alike.T @ one - jnp.sum(alike, axis=0)[:, None] * other
        return jnp.sum(alike), (by_one, by_other)

    first, second = np.triu_indices(count)
    values, (by_first, by_second) = jax.lax.map(one_pair, (jnp.asarray(first), jnp.asarray(second)))
    gram = jnp.zeros((count, count), particles.dtype).at[first, second].set(values).at[second, first].set(values)
    # The gradient by one particle acts on the other; a particle's own pair is counted once.
    apart = jnp.asarray(first != second, particles.dtype)[:, None, None]
    repulsion = jnp.zeros_like(particles).at[second].add(by_first).at[first].add(apart * by_second)
    return gram / knots**2, (2.0 / (bandwidth * knots**2)) * repulsion


def _bandwidth_over_time(by_time: Float[Array, "knot particle axis"]) -> Float[Array, ""]:
    """The median bandwidth of the distances at equal times, of which a few tell it: sorting all would be slow."""
    knots, count, _ = by_time.shape
    times = min(knots, math.ceil(BANDWIDTH_DISTANCES / max(1, count * (count - 1) // 2)))
    chosen = ((np.arange(times) + 0.5) / times * knots).astype(int)
    some = by_time[chosen]
    return median_bandwidth(_squared_distances(some, some), SMALLEST_BANDWIDTH_PER_KNOT)


def _squared_distances(
    one: Float[Array, "*batch a axis"], other: Float[Array, "*batch b axis"]
) -> Float[Array, "*batch a b"]:
    """‖·‖² of every two points; axis by axis, so that it fuses and nothing cancels."""
    difference = (one[..., :, None, axis] - other[..., None, :, axis] for axis in range(one.shape[-1]))
    return functools.reduce(jnp.add, (along**2 for along in difference))
