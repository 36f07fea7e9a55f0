"""Stein Variational Ergodic Search as printed (SVES Alg. 1), for comparison.

x ← x + ε φ(x) with p(x|O) ∝ exp(−λL(x)), L = E + penalties, soft throughout and no polish. What had to differ from the
paper to get any plan at all (see docs/mathematics.md):

1. The obstacle term is max(0, r + margin − d): as printed it attracts.
2. Penalties and smoothness are means over time: with sums λ = 10, ε = 0.5 diverges and the optimum is a straight line.
3. The prior only draws the start set, unless it is asked for: as a gradient term it pins every path to its line.
"""

from __future__ import annotations

from collections.abc import Iterable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner import stein
from planner.polish import Particles
from planner.priors import Prior
from planner.problem import Kernel
from planner.scene import Scene

INVERSE_TEMPERATURE = 10.0
STEP_SIZE = 0.5
PENALTY_WEIGHT = 1.0
SMOOTHNESS_WEIGHT = 15.0
CHUNKS = 10
STEPS_PER_CHUNK = 50


def loss(scene: Scene, free: Float[Array, "free axis"]) -> Float[Array, ""]:
    """L = E + 15·mean‖Δx‖² + mean of the squared broken constraints, in the unit cube."""
    control = scene.control_points(free)
    positions = scene.positions(control)
    broken = jnp.maximum(0.0, scene.constraints(control, positions))
    steps = jnp.diff(control, axis=0)
    return (
        scene.ergodic_metric(positions)
        + SMOOTHNESS_WEIGHT * jnp.mean(jnp.sum(steps**2, axis=-1))
        + PENALTY_WEIGHT * jnp.mean(broken**2)
    )


def descended(
    scene: Scene, seeds: Particles, kernel: Kernel, chunks: Iterable[None], prior: Prior | None = None
) -> tuple[Particles, int]:
    """The set after `STEPS_PER_CHUNK` steps for each chunk; the next is asked for when the last is done.

    Args:
        scene: What the candidates are measured against.
        seeds: Their free control points, unit cube.
        kernel: How they repel each other.
        chunks: As many as there is time for.
        prior: How likely it is that they get so far from their seeds; None: as far as they like.

    Returns:
        The candidates' free control points and the steps taken.
    """
    particles = begins = jnp.asarray(seeds, jnp.float32)
    steps = 0
    for _ in chunks:
        particles = jax.block_until_ready(_chunk(scene, particles, kernel, begins, prior))
        steps += STEPS_PER_CHUNK
    return np.asarray(particles), steps


@eqx.filter_jit
def _chunk(
    scene: Scene,
    particles: Float[Array, "particle free axis"],
    kernel: Kernel,
    begins: Float[Array, "particle free axis"],
    prior: Prior | None,
) -> Float[Array, "particle free axis"]:
    def log_posterior(free: Array, begin: Array) -> Array:
        likelihood = -INVERSE_TEMPERATURE * loss(scene, free)
        return likelihood if prior is None else likelihood + prior.log_density(free - begin)

    def body(particles: Array, _: None) -> tuple[Array, None]:
        score = jax.vmap(jax.grad(log_posterior))(particles, begins)
        return stein.sves_step(particles, score, kernel, STEP_SIZE, wraps=scene.has_headings), None

    particles, _ = jax.lax.scan(body, particles, None, length=STEPS_PER_CHUNK)
    return particles
