"""Stein Variational Ergodic Search as printed (SVES Alg. 1), for comparison.

x ← x + ε φ(x) with p(x|O) ∝ exp(−λL(x)), L = E + penalties, soft throughout and no polish. What had to differ from the
paper to get any plan at all (see docs/mathematics.md):

1. The obstacle term is max(0, r + margin − d): as printed it attracts.
2. Penalties and smoothness are means over time: with sums λ = 10, ε = 0.5 diverges and the optimum is a straight line.
3. The prior only draws the start set, unless it is asked for: as a gradient term it pins every path to its line.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from planner import stein
from planner.accelerator import with_exact_products
from planner.polish import Particles
from planner.priors import Prior
from planner.problem import Kernel
from planner.scene import Scene
from planner.single_precision import single

INVERSE_TEMPERATURE = 10.0
STEP_SIZE = 0.5
PENALTY_WEIGHT = 1.0
SMOOTHNESS_WEIGHT = 15.0
STEPS = 500
STEPS_AT_ONCE = 50


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
    scene: Scene, seeds: Particles, kernel: Kernel, portions: Iterable[int], prior: Prior | None = None
) -> tuple[Particles, int]:
    """The set after so many steps as are asked for.

    Args:
        scene: What the candidates are measured against.
        seeds: Their free control points, unit cube.
        kernel: How they repel each other.
        portions: How many steps to take, and again when they are done.
        prior: How likely it is that they get so far from their seeds; None: as far as they like.

    Returns:
        The candidates' free control points and the steps taken.
    """
    particles = begins = single(seeds)
    taken = 0
    for steps in portions:
        particles = jax.block_until_ready(_descended(scene, particles, kernel, begins, prior, jnp.int32(steps)))
        taken += steps
    return np.asarray(particles), taken


@functools.partial(jax.jit, static_argnames="kernel")
@with_exact_products
def _descended(
    scene: Scene,
    particles: Float[Array, "particle free axis"],
    kernel: Kernel,
    begins: Float[Array, "particle free axis"],
    prior: Prior | None,
    steps: Int[Array, ""],
) -> Float[Array, "particle free axis"]:
    def log_posterior(free: Array, begin: Array) -> Array:
        likelihood = -INVERSE_TEMPERATURE * loss(scene, free)
        return likelihood if prior is None else likelihood + prior.log_density(free - begin)

    def step(_: Int[Array, ""], particles: Array) -> Array:
        score = jax.vmap(jax.grad(log_posterior))(particles, begins)
        return stein.sves_step(particles, score, kernel, STEP_SIZE, wraps=scene.has_headings)

    return jax.lax.fori_loop(0, steps, step, particles)
