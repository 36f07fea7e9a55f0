"""What else could minimise a round of the polish: Adam, and Gauss–Newton with Levenberg's damping.

Both work in the same frequency coordinates as the product's L-BFGS (`planner.augmented_lagrangian.step`).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from planner import lbfgs
from planner.augmented_lagrangian import Info, State, concluded, cosine_basis, frequency_scale
from planner.scene import Scene
from planner.spectral_metric import SpectralMetric

# The best of 0.001, 0.003, 0.01, 0.03 and 0.1 on the forest, in frequency coordinates.
ADAM_STEP = 0.003
MEAN_DECAY, SQUARE_DECAY = 0.9, 0.99

# A step with all derivatives costs as much as this many with one gradient, roughly.
EVALUATIONS_A_STEP = 15
DAMPING = 1e-2
DAMPING_UP, DAMPING_DOWN = 4.0, 0.3


class AdamState(eqx.Module):
    """Adam, in the place of `lbfgs.State`."""

    position: Float[Array, "size"]
    mean: Float[Array, "size"]
    square: Float[Array, "size"]
    count: Int[Array, ""]
    refused: Int[Array, ""]


def adam_init(position: Float[Array, "size"], _first_step: float) -> AdamState:
    """In the place of `lbfgs.init`."""
    none, zero = jnp.zeros_like(position), jnp.zeros((), jnp.int32)
    return AdamState(position, none, none, zero, zero)


def adam_step(objective: lbfgs.ValueAndGradient, state: AdamState) -> tuple[AdamState, None]:
    """In the place of `lbfgs.step`."""
    _, gradient = objective(state.position)
    count = state.count + 1
    mean = MEAN_DECAY * state.mean + (1.0 - MEAN_DECAY) * gradient
    square = SQUARE_DECAY * state.square + (1.0 - SQUARE_DECAY) * gradient**2
    root = jnp.sqrt(square / (1.0 - SQUARE_DECAY**count)) + 1e-12
    moved = state.position - ADAM_STEP * (mean / (1.0 - MEAN_DECAY**count)) / root
    return AdamState(moved, mean, square, count, state.refused), None


def gauss_newton_step(
    scene: Scene, states: State, penalty: Float[Array, ""], inner_steps: Int[Array, ""]
) -> tuple[State, Info]:
    """In the place of `augmented_lagrangian.step`: the round's objective is a sum of squares, and so linearised."""
    return jax.vmap(lambda state: _gauss_newton(scene, state, penalty, inner_steps))(states)


def _gauss_newton(
    scene: Scene, state: State, penalty: Float[Array, ""], inner_steps: Int[Array, ""]
) -> tuple[State, Info]:
    shape = state.free.shape
    cosines, scale = jnp.asarray(cosine_basis(shape[0])), frequency_scale(scene, shape[0], penalty)
    assert isinstance(scene.metric, SpectralMetric)
    metric = scene.metric

    def free_of(flat: Array) -> Array:
        return state.free + cosines @ (scale * flat.reshape(shape))

    def roots(flat: Array) -> Array:
        control = scene.control_points(free_of(flat))
        positions = scene.positions(control)
        time_weight = jnp.full(positions.shape[0], 1.0 / positions.shape[0])
        apart = jnp.sqrt(metric.weights / state.reference) * metric.residual(positions, time_weight)
        pushed = jnp.maximum(0.0, state.multipliers + penalty * scene.constraints(control, positions))
        effort = jnp.sqrt(scene.effort(control) + 1e-12)
        return jnp.concatenate([apart.reshape(-1), effort[None], pushed / jnp.sqrt(2.0 * penalty)])

    def body(_: Int[Array, ""], held: tuple[Array, Array]) -> tuple[Array, Array]:
        flat, damping = held
        value = roots(flat)
        slope = jax.jacfwd(roots)(flat)
        curvature = slope.T @ slope
        curvature = curvature + damping * jnp.trace(curvature) / flat.size * jnp.eye(flat.size)
        trial = flat - jnp.linalg.solve(curvature, slope.T @ value)
        better = jnp.sum(roots(trial) ** 2) < jnp.sum(value**2)
        return jnp.where(better, trial, flat), damping * jnp.where(better, DAMPING_DOWN, DAMPING_UP)

    steps = jnp.maximum(1, inner_steps // EVALUATIONS_A_STEP)
    start = jnp.zeros(state.free.size, state.free.dtype)
    flat, _ = jax.lax.fori_loop(0, steps, body, (start, jnp.float32(DAMPING)))
    return concluded(scene, state, free_of(flat), penalty, jnp.ones(()))
