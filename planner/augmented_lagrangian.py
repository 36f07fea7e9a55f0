"""Each candidate on its own, under hard constraints, by multipliers.

minimise E(z)/E_ref + effort(z) subject to g(z) ≤ 0, as a sequence of unconstrained problems
E/E_ref + effort + Σ_i [max(0, μ_i + ρ g_i)² − μ_i²]/(2ρ), after each of which μ_i ← max(0, μ_i + ρ g_i)
(Nocedal & Wright, alg. 17.4, with the inequality form of Rockafellar).

The acceleration limit makes this stiff: it is a second difference, so its curvature grows with the fourth power of the
number of knots (and that of a limit on jerk with the sixth). Each round therefore works in coordinates y with
z = z₀ + C·(s ∘ y), C the cosine basis over time and s the inverse root of the curvature that the limits on speed,
acceleration and jerk give each frequency: a constant matrix kernel, by which the metric reached with the same number of
steps is two to five times lower (benchmarks/README.md).

E falls by orders of magnitude on the way. E_ref follows it, so the balance with the constraints stays the same in every
round, and the multipliers are rescaled with it.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.fft
from jaxtyping import Array, Float, Int

from planner import lbfgs
from planner.scene import Scene

# Curvature of E/E_ref over all knots, and the share of the limits taken to be active: the balance in s.
METRIC_CURVATURE = 100.0
ACTIVE_SHARE = 0.1
SMALLEST_METRIC = 1e-7
LARGEST_RESCALE = 3.0
FIRST_STEP_UNIT = 0.05


class State(eqx.Module):
    """One candidate between rounds.

    Attributes:
        free: Its free control points, unit cube.
        multipliers: μ_i.
        reference: E_ref.
    """

    free: Float[Array, "free axis"]
    multipliers: Float[Array, "constraint"]
    reference: Float[Array, ""]


class Info(eqx.Module):
    """How a round ended.

    Attributes:
        ergodic_metric: E.
        worst_constraint: Largest g_i; above zero a constraint is broken.
        accepted_share: Share of the steps that moved.
    """

    ergodic_metric: Float[Array, ""]
    worst_constraint: Float[Array, ""]
    accepted_share: Float[Array, ""]


def init(scene: Scene, free: Float[Array, "free axis"]) -> State:
    """Start from a candidate's free control points."""
    control = scene.control_points(free)
    positions = scene.positions(control)
    count = jax.eval_shape(scene.constraints, control, positions).shape[0]
    return State(free, jnp.zeros(count, free.dtype), reference_of(scene, free))


def reference_of(scene: Scene, free: Float[Array, "free axis"]) -> Float[Array, ""]:
    """E_ref to begin with."""
    return jnp.maximum(scene.ergodic_metric(scene.positions(scene.control_points(free))), SMALLEST_METRIC)


def penalised(
    scene: Scene, free: Float[Array, "free axis"], reference: Float[Array, ""], penalty: float
) -> Float[Array, ""]:
    """The objective with soft penalties alone (no multipliers): what the Stein phase descends."""
    control = scene.control_points(free)
    positions = scene.positions(control)
    broken = jnp.maximum(0.0, scene.constraints(control, positions))
    return scene.ergodic_metric(positions) / reference + scene.effort(control) + 0.5 * penalty * jnp.sum(broken**2)


def step(scene: Scene, states: State, penalty: Float[Array, ""], inner_steps: Int[Array, ""]) -> tuple[State, Info]:
    """One round of every candidate, each on its own: minimise, then update the multipliers.

    Args:
        scene: What the candidates are measured against.
        states: The candidates, along a first axis.
        penalty: ρ of this round.
        inner_steps: Moves tried in the round's minimisation.
    """
    shape = states.free.shape[1:]
    cosines = jnp.asarray(cosine_basis(shape[0]))
    scale = frequency_scale(scene, shape[0], penalty)

    def free_of(state: State, flat: Float[Array, "size"]) -> Float[Array, "free axis"]:
        return state.free + cosines @ (scale * flat.reshape(shape))

    def tried(state: State, inner: lbfgs.State) -> lbfgs.State:
        def objective(flat: Float[Array, "size"]) -> Float[Array, ""]:
            control = scene.control_points(free_of(state, flat))
            positions = scene.positions(control)
            pushed = jnp.maximum(0.0, state.multipliers + penalty * scene.constraints(control, positions))
            return (
                scene.ergodic_metric(positions) / state.reference
                + scene.effort(control)
                + jnp.sum(pushed**2 - state.multipliers**2) / (2.0 * penalty)
            )

        return lbfgs.step(jax.value_and_grad(objective), inner)[0]

    def ended(state: State, inner: lbfgs.State) -> tuple[State, Info]:
        return concluded(scene, state, free_of(state, inner.position), penalty, 1.0 - inner.refused / inner_steps)

    begins = jax.vmap(lambda free: lbfgs.init(jnp.zeros_like(free).reshape(-1), FIRST_STEP_UNIT))(states.free)
    # Around the batch and not in it, as that would be traced three times over. The first turn looks at the start.
    inner = jax.lax.fori_loop(0, inner_steps + 1, lambda _, inner: jax.vmap(tried)(states, inner), begins)
    return jax.vmap(ended)(states, inner)


def concluded(
    scene: Scene,
    state: State,
    free: Float[Array, "free axis"],
    penalty: Float[Array, ""],
    accepted_share: Float[Array, ""],
) -> tuple[State, Info]:
    """The end of a round: multipliers and E_ref follow what its minimisation came to.

    Args:
        scene: What the candidate is measured against.
        state: The candidate before the round.
        free: Its free control points after it.
        penalty: ρ of the round.
        accepted_share: Share of the steps that moved.
    """
    control = scene.control_points(free)
    positions = scene.positions(control)
    broken = scene.constraints(control, positions)
    metric = scene.ergodic_metric(positions)
    reference = jnp.clip(
        jnp.maximum(metric, SMALLEST_METRIC),
        state.reference / LARGEST_RESCALE,
        state.reference * LARGEST_RESCALE,
    )
    multipliers = jnp.maximum(0.0, state.multipliers + penalty * broken) * (state.reference / reference)
    return State(free, multipliers, reference), Info(metric, jnp.max(broken), accepted_share)


def cosine_basis(count: int) -> Float[np.ndarray, "free frequency"]:
    """The orthonormal cosine basis over time (DCT-II), a column a frequency."""
    return np.asarray(scipy.fft.idct(np.eye(count), norm="ortho", axis=0), np.float32)


def frequency_scale(scene: Scene, count: int, penalty: Float[Array, ""]) -> Float[Array, "frequency axis"]:
    """s: how far a unit of each coordinate moves the path, by frequency and axis."""
    difference = 2.0 * np.sin(0.5 * np.pi * np.arange(count) / count)[:, None]
    slowest = jnp.minimum(scene.max_speed_mps, jnp.minimum(scene.max_climb_mps, scene.max_descent_mps))
    speed = jnp.stack([scene.max_speed_mps, scene.max_speed_mps, slowest])
    first = 2.0 * difference * scene.lengths_m / (speed * scene.knot_interval_s)
    across = jnp.minimum(scene.max_acceleration_mps2, scene.max_turn_rate_radps * scene.max_speed_mps)
    second = 2.0 * difference**2 * scene.lengths_m / (across * scene.knot_interval_s**2)
    third = 2.0 * difference**3 * scene.lengths_m / (scene.max_jerk_mps3 * scene.knot_interval_s**3)
    limited = first**2 + second**2 + third**2
    if scene.has_headings:
        # Of a heading only the rate is limited.
        turned = 2.0 * difference / (scene.max_yaw_rate_turns_per_s * scene.knot_interval_s)
        limited = jnp.concatenate([limited, turned**2], axis=1)
    return (METRIC_CURVATURE / count + penalty * ACTIVE_SHARE * limited) ** -0.5
