"""Each candidate on its own, under hard constraints, by multipliers.

minimise E(z)/E_ref + effort(z) subject to g(z) ≤ 0, as a sequence of unconstrained problems
E/E_ref + effort + Σ_i [max(0, μ_i + ρ g_i)² − μ_i²]/(2ρ), after each of which μ_i ← max(0, μ_i + ρ g_i)
(Nocedal & Wright, alg. 17.4, with the inequality form of Rockafellar).

Each round works in `planner.frequency_coordinates`, as the acceleration limit makes this stiff.

E falls by orders of magnitude on the way. E_ref follows it, so the balance with the constraints stays the same in every
round, and the multipliers are rescaled with it.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from planner import lbfgs
from planner.frequency_coordinates import FrequencyCoordinates
from planner.scene import Scene

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
    coordinates = FrequencyCoordinates.of(scene, shape[0], penalty)

    def free_of(state: State, flat: Float[Array, "size"]) -> Float[Array, "free axis"]:
        return state.free + coordinates.move(flat.reshape(shape))

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
