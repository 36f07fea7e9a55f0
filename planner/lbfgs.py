"""Limited-memory BFGS with one evaluation a step, made for a batch under vmap.

A line search inside a step would make every candidate of a batch wait for the slowest. Here a step evaluates one trial
point: a candidate whose trial descends enough (Armijo) moves, updates its memory and takes a new direction; the others
shorten their step and try again in the next one. (Nocedal & Wright, Numerical Optimization, alg. 7.4 and 3.1.)
"""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

SUFFICIENT_DECREASE = 1e-4
SHORTEST_STEP = 1e-5
MEMORY = 10

ValueAndGradient = Callable[[Float[Array, "size"]], tuple[Float[Array, ""], Float[Array, "size"]]]


class State(eqx.Module):
    """What the next step needs.

    Attributes:
        position: The accepted point.
        value: Objective there.
        gradient: Gradient there.
        direction: Where the next trial lies, scaled by `step_length`.
        step_length: 1 for a fresh direction, less after refused trials.
        position_changes: s_i, newest last.
        gradient_changes: y_i, newest last.
        curvature: 1/(s_i·y_i), zero where the memory is empty.
        refused: Trials refused so far.
    """

    position: Float[Array, "size"]
    value: Float[Array, ""]
    gradient: Float[Array, "size"]
    direction: Float[Array, "size"]
    step_length: Float[Array, ""]
    position_changes: Float[Array, "memory size"]
    gradient_changes: Float[Array, "memory size"]
    curvature: Float[Array, "memory"]
    refused: Int[Array, ""]


class Info(eqx.Module):
    """What the caller may look at.

    Attributes:
        accepted: Whether the step moved.
        slope: Directional derivative at the accepted point.
    """

    accepted: Bool[Array, ""]
    slope: Float[Array, ""]


def init(position: Float[Array, "size"], first_step: float) -> State:
    """Start at a point, with an empty memory; the first step looks at the point itself.

    Args:
        position: Where to start.
        first_step: Length of the first move, in the units of the position.
    """
    memory = jnp.zeros((MEMORY, position.shape[0]), position.dtype)
    return State(
        position=position,
        value=jnp.full((), jnp.inf, position.dtype),
        gradient=jnp.zeros_like(position),
        # Only its length counts, as the first trial is no move.
        direction=jnp.full_like(position, first_step / position.shape[0] ** 0.5),
        step_length=jnp.zeros((), position.dtype),
        position_changes=memory,
        gradient_changes=memory,
        curvature=jnp.zeros(MEMORY, position.dtype),
        refused=jnp.zeros((), jnp.int32),
    )


def step(objective: ValueAndGradient, state: State) -> tuple[State, Info]:
    """Try one point.

    Args:
        objective: Value and gradient.
        state: Where the iteration stands.
    """
    trial = state.position + state.step_length * state.direction
    value, gradient = objective(trial)
    slope = jnp.dot(state.gradient, state.direction)
    sound = jnp.isfinite(value) & jnp.isfinite(gradient).all()
    accepted = sound & (value <= state.value + SUFFICIENT_DECREASE * state.step_length * slope)

    change, gradient_change = trial - state.position, gradient - state.gradient
    product = jnp.dot(change, gradient_change)
    scale = jnp.linalg.norm(change) * jnp.linalg.norm(gradient_change)
    learns = accepted & (product > 1e-6 * scale)

    def push(rows: Array, row: Array) -> Array:
        return jnp.where(learns, jnp.concatenate([rows[1:], row[None]]), rows)

    changes = push(state.position_changes, jnp.where(sound, change, 0.0))
    gradient_changes = push(state.gradient_changes, jnp.where(sound, gradient_change, 0.0))
    curvature = push(state.curvature, jnp.where(learns, 1.0 / jnp.where(learns, product, 1.0), 0.0))

    exhausted = ~accepted & (state.step_length < SHORTEST_STEP)
    curvature = jnp.where(exhausted, 0.0, curvature)
    current = jnp.where(accepted, gradient, state.gradient)
    fresh = -_two_loop(current, changes, gradient_changes, curvature)
    # An empty memory has no scale of its own: keep the length of the last direction, shortened.
    remembered = jnp.any(curvature > 0.0)
    lost_scale = jnp.linalg.norm(state.direction) * jnp.where(exhausted, 0.01, 1.0)
    steepest = -current * lost_scale / jnp.maximum(jnp.linalg.norm(current), 1e-30)
    fresh = jnp.where(remembered, fresh, steepest)

    # A failed trial shortens by quadratic interpolation, within [0.1, 0.5].
    rise = value - state.value - state.step_length * slope
    ratio = jnp.where(
        sound & (rise > 0.0),
        -slope * state.step_length / (2.0 * jnp.where(rise > 0.0, rise, 1.0)),
        0.1,
    )
    shortened = state.step_length * jnp.clip(ratio, 0.1, 0.5)
    renewed = accepted | exhausted
    new_state = State(
        position=jnp.where(accepted, trial, state.position),
        value=jnp.where(accepted, value, state.value),
        gradient=current,
        direction=jnp.where(renewed, fresh, state.direction),
        step_length=jnp.where(renewed, 1.0, shortened),
        position_changes=changes,
        gradient_changes=gradient_changes,
        curvature=curvature,
        refused=state.refused + jnp.where(accepted, 0, 1),
    )
    return new_state, Info(accepted=accepted, slope=slope)


def _two_loop(
    gradient: Float[Array, "size"],
    changes: Float[Array, "memory size"],
    gradient_changes: Float[Array, "memory size"],
    curvature: Float[Array, "memory"],
) -> Float[Array, "size"]:
    """H·g of the remembered inverse Hessian; empty rows have zero curvature and drop out."""

    def backward(vector: Array, row: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        change, gradient_change, inverse = row
        weight = inverse * jnp.dot(change, vector)
        return vector - weight * gradient_change, weight

    rows = (changes, gradient_changes, curvature)
    vector, weights = jax.lax.scan(backward, gradient, rows, reverse=True, unroll=MEMORY)
    # γ = s·y / y·y of the newest pair scales the identity that the recursion starts from.
    size = curvature[-1] * jnp.dot(gradient_changes[-1], gradient_changes[-1])
    vector = vector * jnp.where(size > 0.0, 1.0 / jnp.where(size > 0.0, size, 1.0), 1.0)

    def forward(vector: Array, row: tuple[tuple[Array, Array, Array], Array]) -> tuple[Array, None]:
        (change, gradient_change, inverse), weight = row
        return vector + change * (weight - inverse * jnp.dot(gradient_change, vector)), None

    vector, _ = jax.lax.scan(forward, vector, (rows, weights), unroll=MEMORY)
    return vector
