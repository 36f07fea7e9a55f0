"""Stein variational gradient descent on a set of candidates.

φ(x_j) = (1/N) Σ_i [ k(x_i, x_j) ∇log p(x_i|O) + γ ∇_{x_i} k(x_i, x_j) ], p(x|O) ∝ p(x) exp(−λ L(x)) (SVES eqs. 9–12).

| symbol | identifier          | unit | shape              |
|--------|---------------------|------|--------------------|
| x_i    | `particles`         | unit | particle knot axis |
| ∇log p | `score`             | 1    | particle knot axis |
| γ      | `fading`            | 1    |                    |

Departures from the paper:
1. Repulsion fades (cosine to zero over the first three quarters): kept up, it holds every path away from its optimum,
   and a set of bad paths is no choice.
2. The direction is smoothed over time by (I + αD₂ᵀD₂)⁻¹, a constant matrix kernel: a plain gradient moves single points
   and makes kinks that speed and acceleration limits then undo.
3. Steps have a given length, annealed, with momentum: the metric falls by orders of magnitude on the way and no single
   ε suits both ends. `sves_step` is the paper's own.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from planner.accelerator import ROUNDED
from planner.kernels import kernel_terms
from planner.problem import Kernel

MOMENTUM = 0.8
SMOOTHING = 4.0
REPULSION_SHARE = 0.75
COINCIDING_UNIT = 1e-3
"""Candidates coincide whose knots are less than this apart, by the root of the mean square."""


@dataclasses.dataclass(frozen=True)
class Annealing:
    """How long the steps of a set are: each a share of the one before.

    Attributes:
        steps: How many.
        longest_unit: How far the first moves the knot that it moves farthest.
        shortest_unit: What that has come down to after the last.
    """

    steps: int
    longest_unit: float
    shortest_unit: float

    def progress(self, index: Int[Array, ""]) -> Float[Array, ""]:
        """Share of the steps that are taken before one, 0 … 1."""
        return index / self.steps

    def length_unit(self, index: Int[Array, ""]) -> Float[Array, ""]:
        """How far a step moves the knot that it moves farthest."""
        return self.shortest_unit * (self.longest_unit / self.shortest_unit) ** (1.0 - self.progress(index))


class State(eqx.Module):
    """What the next step needs.

    Attributes:
        particles: Free control points (or controls) of every candidate, unit cube.
        momentum: Running direction.
        index: Steps taken.
    """

    particles: Float[Array, "particle knot axis"]
    momentum: Float[Array, "particle knot axis"]
    index: Int[Array, ""]


def init(particles: Float[Array | np.ndarray, "particle knot axis"]) -> State:
    """Start from a set of candidates, on the device or not yet."""
    # Zeros made on the device would have to be compiled.
    momentum = np.zeros(particles.shape, particles.dtype)
    return State(cast(Array, particles), cast(Array, momentum), cast(Array, np.int32(0)))


def fading(progress: Float[Array, ""]) -> Float[Array, ""]:
    """How much of the repulsion is left, 1 … 0, after a share of the steps."""
    return 0.5 * (1.0 + jnp.cos(jnp.pi * jnp.minimum(progress / REPULSION_SHARE, 1.0)))


@functools.cache
def smoother(knots: int) -> Float[np.ndarray, "knot knot"]:
    """(I + αD₂ᵀD₂)⁻¹ over time."""
    second = np.diff(np.eye(knots), n=2, axis=0)
    return np.linalg.inv(np.eye(knots) + SMOOTHING * second.T @ second).astype(np.float32)


def step(
    state: State,
    score: Float[Array, "particle knot axis"],
    kernel: Kernel,
    smooth: Float[Array, "knot knot"],
    annealing: Annealing,
    *,
    wraps: bool = False,
) -> State:
    """One annealed step of a set, inside the unit cube.

    Args:
        state: The set.
        score: ∇log p of each candidate.
        kernel: How they share scores and repel each other.
        smooth: `smoother` of as many knots.
        annealing: How long this and the other steps are.
        wraps: Whether the last axis is a heading, in turns, which may turn as far as it likes.
    """
    # A score without numbers would spread to the whole set.
    score = jnp.where(jnp.all(jnp.isfinite(score), axis=(1, 2), keepdims=True), score, 0.0)
    gram, away = kernel_terms(kernel, state.particles, wraps=wraps)
    pull = _shared(gram, score)
    # Scores have no common scale (E is divided by its own size), so repulsion is measured against them.
    strength = jnp.linalg.norm(pull) / jnp.maximum(jnp.linalg.norm(away), 1e-12)
    along = pull + fading(annealing.progress(state.index)) * strength * away
    return moved(state, along, smooth, annealing, wraps=wraps)


def moved(
    state: State,
    along: Float[Array, "particle knot axis"],
    smooth: Float[Array, "knot knot"],
    annealing: Annealing,
    *,
    wraps: bool = False,
) -> State:
    """The set one annealed step on, with momentum, inside the unit cube.

    Args:
        state: The set.
        along: Where to; its length does not count.
        smooth: `smoother` of as many knots.
        annealing: How long this and the other steps are.
        wraps: Whether the last axis is a heading, in turns, which may turn as far as it likes.
    """
    momentum = MOMENTUM * state.momentum + jnp.einsum("kl,nld->nkd", smooth, along)
    largest = jnp.max(jnp.abs(momentum), axis=(1, 2), keepdims=True)
    free = state.particles + annealing.length_unit(state.index) * momentum / jnp.maximum(largest, 1e-20)
    inside = jnp.clip(free, 0.0, 1.0)
    if wraps:
        inside = inside.at[..., -1].set(free[..., -1])
    return State(inside, momentum, state.index + 1)


def sves_step(
    particles: Float[Array, "particle knot axis"],
    score: Float[Array, "particle knot axis"],
    kernel: Kernel,
    step_size: float,
    *,
    wraps: bool = False,
) -> Float[Array, "particle knot axis"]:
    """The paper's own step, x ← x + εφ (SVES Alg. 1)."""
    gram, repulsion = kernel_terms(kernel, particles, wraps=wraps)
    phi = (_shared(gram, score) + repulsion) / particles.shape[0]
    return particles + step_size * phi


def _shared(
    gram: Float[Array, "particle particle"], score: Float[Array, "particle knot axis"]
) -> Float[Array, "particle knot axis"]:
    """Σ_i k(x_i, x_j) ∇log p(x_i|O)."""
    return jnp.einsum("ij,ikd->jkd", gram, score, precision=ROUNDED)


def separated(particles: Float[Array, "particle knot axis"], key: Array) -> Float[Array, "particle knot axis"]:
    """The same set with candidates that coincide moved apart: coincident particles never part by themselves."""
    count, knots, _ = particles.shape
    flat = particles.reshape(count, -1)
    gap = jnp.sqrt(jnp.sum((flat[:, None] - flat[None]) ** 2, axis=-1) / knots)
    earlier = jnp.tril(jnp.ones((count, count), bool), k=-1)
    doubled = jnp.any(earlier & (gap < COINCIDING_UNIT), axis=1)

    def moved_apart() -> Float[Array, "particle knot axis"]:
        noise = 10.0 * COINCIDING_UNIT * jax.random.normal(key, particles.shape)
        return jnp.where(doubled[:, None, None], particles + noise, particles)

    # Random numbers take as long as half a step, and few sets need them.
    return jax.lax.cond(jnp.any(doubled), moved_apart, lambda: particles)
