"""Stein variational gradient descent on a set of candidates.

φ(x_j) = (1/N) Σ_i [ k(x_i, x_j) ∇log p(x_i|O) + γ ∇_{x_i} k(x_i, x_j) ], p(x|O) ∝ p(x) exp(−λ L(x)) (SVES eqs. 9–12).

| symbol | identifier          | unit | shape              |
|--------|---------------------|------|--------------------|
| x_i    | `particles`         | unit | particle knot axis |
| ∇log p | `score`             | 1    | particle knot axis |
| λL     | `loss`              | 1    | particle           |
| γ      | `repulsion_weight`  | 1    |                    |

Departures from the paper:
1. The kernel fades to the identity, as a cosine over the first three quarters of the steps. Kept up, repulsion holds
   every path away from its optimum, and so does the mean of scores: a set of bad paths is no choice.
2. Steps are taken in the polish's own coordinates (`planner.frequency_coordinates`), a constant matrix kernel by which
   all frequencies of a path curve alike. In them a step has the length that curvature gives it, or that by which a
   candidate's own loss would be gone, L/‖∇L‖² (Polyak, Introduction to Optimization, 1987, sec. 5.3.2), whichever is
   less: there is no ε to find. `sves_step` is the paper's own.
3. Scores are averaged with weights k(x_i, x_j)/Σ_i k(x_i, x_j) and not summed over N, so that the length of a step does
   not depend on how many candidates are near.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from planner.frequency_coordinates import FrequencyCoordinates
from planner.kernels import kernel_terms
from planner.problem import Kernel

MOMENTUM = 0.7
LONGEST_STEP = 0.3
"""In the coordinates, as a multiple of the gradient: more limits may be active than the coordinates reckon with."""
LONGEST_MOVE_UNIT = 0.1
FADED_SHARE = 0.75


class State(eqx.Module):
    """What the next step needs.

    Attributes:
        particles: Free control points (or controls) of every candidate, unit cube.
        momentum: The last move.
        index: Steps taken.
    """

    particles: Float[Array, "particle knot axis"]
    momentum: Float[Array, "particle knot axis"]
    index: Int[Array, ""]


def init(particles: Float[Array, "particle knot axis"]) -> State:
    """Start from a set of candidates."""
    return State(particles, jnp.zeros_like(particles), jnp.zeros((), jnp.int32))


def direction(
    kernel: Kernel,
    particles: Float[Array, "particle knot axis"],
    score: Float[Array, "particle knot axis"],
    repulsion_weight: float | Float[Array, ""],
    *,
    wraps: bool = False,
) -> Float[Array, "particle knot axis"]:
    """The Stein direction φ of every particle; `wraps`: whether the last axis is a heading, in turns."""
    gram, repulsion = kernel_terms(kernel, particles, wraps=wraps)
    attraction = jnp.einsum("ij,ikd->jkd", gram, score)
    return (attraction + repulsion_weight * repulsion) / particles.shape[0]


def fading(progress: float | Float[Array, ""]) -> Float[Array, ""]:
    """How much of the kernel is left, 1 … 0, after a share of the steps."""
    return 0.5 * (1.0 + jnp.cos(jnp.pi * jnp.minimum(progress / FADED_SHARE, 1.0)))


def step(
    state: State,
    score: Float[Array, "particle knot axis"],
    loss: Float[Array, "particle"],
    kernel: Kernel,
    coordinates: FrequencyCoordinates,
    steps: int,
    *,
    wraps: bool = False,
) -> State:
    """One step of `steps`, inside the unit cube.

    Args:
        state: The set.
        score: ∇log p of every candidate.
        loss: λL of every candidate, at least zero.
        kernel: How they share scores and repel each other.
        coordinates: In which steps are taken.
        steps: After how many the kernel has faded.
        wraps: Whether the last axis is a heading, in turns, which may turn as far as it likes.
    """
    left = fading(state.index / steps)
    gram, repulsion = kernel_terms(kernel, state.particles, wraps=wraps)
    shared = jnp.einsum("ij,ikd->jkd", gram / jnp.sum(gram, axis=0), score)
    own, mixed, away = (coordinates.gradient(one) for one in (score, shared, repulsion))
    pull = own + left * (mixed - own)
    # Scores have no common scale (E is divided by its own size), so repulsion is measured against them.
    strength = jnp.linalg.norm(pull) / jnp.maximum(jnp.linalg.norm(away), 1e-12)
    length = jnp.minimum(LONGEST_STEP, loss / jnp.maximum(jnp.sum(own**2, axis=(1, 2)), 1e-20))
    along = coordinates.move(pull + left * strength * away)
    move = MOMENTUM * state.momentum + length[:, None, None] * along
    largest = jnp.max(jnp.abs(move), axis=(1, 2), keepdims=True)
    move = move * jnp.minimum(1.0, LONGEST_MOVE_UNIT / jnp.maximum(largest, 1e-20))
    moved = state.particles + move
    inside = jnp.clip(moved, 0.0, 1.0)
    if wraps:
        inside = inside.at[..., -1].set(moved[..., -1])
    return State(inside, move, state.index + 1)


def sves_step(
    particles: Float[Array, "particle knot axis"],
    score: Float[Array, "particle knot axis"],
    kernel: Kernel,
    step_size: float,
    *,
    wraps: bool = False,
) -> Float[Array, "particle knot axis"]:
    """The paper's own step, x ← x + εφ (SVES Alg. 1)."""
    return particles + step_size * direction(kernel, particles, score, 1.0, wraps=wraps)


def separated(
    particles: Float[Array, "particle knot axis"], key: Array, distance_unit: float = 1e-3
) -> Float[Array, "particle knot axis"]:
    """The same set with candidates that coincide moved apart: coincident particles never part by themselves."""
    count = particles.shape[0]
    gap = jnp.sqrt(jnp.mean(jnp.sum((particles[:, None] - particles[None]) ** 2, axis=-1), axis=-1))
    earlier = jnp.tril(jnp.ones((count, count), bool), k=-1)
    doubled = jnp.any(earlier & (gap < distance_unit), axis=1)
    noise = 10.0 * distance_unit * jax.random.normal(key, particles.shape)
    return jnp.where(doubled[:, None, None], particles + noise, particles)
