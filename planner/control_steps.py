"""Steps of a given length on candidates that are sequences of controls.

Through a vehicle's dynamics nobody knows how much each control bends the score, so steps have a given length, annealed,
with momentum, and the direction is smoothed over time by (I + αD₂ᵀD₂)⁻¹, a constant matrix kernel: a plain gradient
moves single controls.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner import stein
from planner.kernels import kernel_terms
from planner.problem import Kernel

MOMENTUM = 0.8
SMOOTHING = 4.0

REPULSION = 0.3
"""Of the most repelled candidate, against a score of one."""

# Of the cube of controls, in one step: a receding horizon has few steps before each control, and starts from an answer.
LONGEST_STEP = 0.2
SHORTEST_STEP = 0.002


def smoother(controls: int) -> Float[np.ndarray, "time time"]:
    """(I + αD₂ᵀD₂)⁻¹ over time."""
    second = np.diff(np.eye(controls), n=2, axis=0)
    return np.linalg.inv(np.eye(controls) + SMOOTHING * second.T @ second).astype(np.float32)


def stein_step(
    state: stein.State,
    score: Float[Array, "particle time control"],
    kernel: Kernel,
    smooth: Float[Array, "time time"],
    steps: int,
) -> stein.State:
    """One step of `steps` along the paper's φ, repulsion as strong as the scores at first, and fading."""
    fading = stein.fading(state.index / steps)
    # Scores have no common scale, so repulsion is measured against them.
    pull = stein.direction(kernel, state.particles, score, 0.0)
    away = stein.direction(kernel, state.particles, jnp.zeros_like(score), 1.0)
    strength = jnp.linalg.norm(pull) / jnp.maximum(jnp.linalg.norm(away), 1e-12)
    return _moved(state, pull + fading * strength * away, smooth, steps)


def own_score_step(
    state: stein.State,
    score: Float[Array, "particle time control"],
    kernel: Kernel,
    smooth: Float[Array, "time time"],
    steps: int,
) -> stein.State:
    """One step of `steps` along own scores at unit length, and repulsion that fades."""
    fading = stein.fading(state.index / steps)
    _, repulsion = kernel_terms(kernel, state.particles)
    pull = score / jnp.maximum(_norms(score), 1e-20)
    away = repulsion / jnp.maximum(jnp.max(_norms(repulsion)), 1e-12)
    return _moved(state, pull + REPULSION * fading * away, smooth, steps)


def _moved(
    state: stein.State, along: Float[Array, "particle time control"], smooth: Float[Array, "time time"], steps: int
) -> stein.State:
    momentum = MOMENTUM * state.momentum + jnp.einsum("kl,nld->nkd", smooth, along)
    length = SHORTEST_STEP * (LONGEST_STEP / SHORTEST_STEP) ** (1.0 - state.index / steps)
    largest = jnp.max(jnp.abs(momentum), axis=(1, 2), keepdims=True)
    moved = state.particles + length * momentum / jnp.maximum(largest, 1e-20)
    return stein.State(jnp.clip(moved, 0.0, 1.0), momentum, state.index + 1)


def _norms(vectors: Float[Array, "particle time control"]) -> Float[Array, "particle 1 1"]:
    return jnp.sqrt(jnp.sum(vectors**2, axis=(1, 2), keepdims=True))
