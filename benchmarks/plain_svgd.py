"""Plain RBF-SVGD on waypoints: what SVES prints, and no more."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from planner import stein, sves
from planner.problem import Kernel
from planner.spectral_metric import SpectralMetric

PARTICLES, SAMPLES, SVGD_STEPS = 20, 100, 500
STEP_SIZE, SPREAD_UNIT = 0.5, 0.1


def plain_svgd(metric: SpectralMetric, start: jax.Array) -> jax.Array:
    """RBF-SVGD on waypoints as SVES prints it, with the two corrections without which it has no use.

    Smoothness is a mean over time (the sum makes a straight line the optimum), and what is outside the box is pushed
    back (the basis mirrors at the walls).
    """
    samples = start.shape[1]
    weight = jnp.full(samples, 1.0 / samples)

    def loss(points: jax.Array) -> jax.Array:
        outside = jnp.maximum(0.0, jnp.maximum(-points, points - 1.0))
        smooth = jnp.mean(jnp.sum(jnp.diff(points, axis=0) ** 2, axis=-1))
        return metric(points, weight) + sves.SMOOTHNESS_WEIGHT * smooth + jnp.mean(outside**2)

    def body(points: jax.Array, _: None) -> tuple[jax.Array, None]:
        score = -sves.INVERSE_TEMPERATURE * jax.vmap(jax.grad(loss))(points)
        return stein.sves_step(points, score, Kernel.RBF, STEP_SIZE), None

    return jax.lax.scan(body, start, None, length=SVGD_STEPS)[0]


def line_with_noise(box_axes: int, seed: int) -> np.ndarray:
    """SVES's start set: lines across the unit cube, and noise around them. Shape (particle, time, 3)."""
    line = np.linspace(np.full(3, 0.1), np.full(3, 0.9), SAMPLES)
    noise = np.random.default_rng(seed).normal(0.0, SPREAD_UNIT, (PARTICLES, SAMPLES, 3))
    found = np.clip(line + noise, 0.0, 1.0)
    found[:, :, box_axes:] = 0.5
    return found
