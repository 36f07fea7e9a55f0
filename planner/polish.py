"""The optimiser's compiled pieces: Stein steps on the set, rounds of multipliers on each candidate.

One jit an entry point; shapes are static, so problems of similar size share them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from planner import augmented_lagrangian, stein
from planner.priors import Prior
from planner.problem import Kernel
from planner.scene import Scene

STEIN_STEPS = 20
STEIN_STEPS_AT_ONCE = 10
LONGEST_STEIN_STEP_UNIT = 0.06
# The Stein phase may cut corners; the polish makes them good.
STEIN_PENALTY = 0.1

Particles = Float[np.ndarray, "particle free axis"]


@dataclasses.dataclass(frozen=True)
class Round:
    """One round of multipliers.

    Attributes:
        penalty: ρ.
        steps: Evaluations spent on its minimisation.
    """

    penalty: float
    steps: int


def explored(
    scene: Scene, particles: Particles, kernel: Kernel, seed: int, portions: Iterable[int], prior: Prior | None = None
) -> tuple[Particles, int]:
    """The set after Stein steps, all candidates together under soft penalties.

    Args:
        scene: What the candidates are measured against.
        particles: Their free control points, unit cube.
        kernel: How they repel each other.
        seed: Of the noise that parts candidates which coincide.
        portions: How many steps to take, and again when they are done. Annealing ends with the last of `STEIN_STEPS`.
        prior: How likely it is that they get so far from where they begin; None: they get as far as they like.

    Returns:
        The candidates and the steps taken.
    """
    smooth, begins = jnp.asarray(stein.smoother(particles.shape[1])), jnp.asarray(particles, jnp.float32)
    state, reference = _begin_exploring(scene, begins, jax.random.key(seed))
    for steps in portions:
        state = jax.block_until_ready(
            _explore(scene, state, reference, smooth, kernel, begins, prior, jnp.int32(steps))
        )
    return np.asarray(state.particles), int(state.index)


def parted(particles: Particles, seed: int) -> Particles:
    """The set with candidates that coincide moved apart: polished each on its own, they would end alike."""
    return np.asarray(_parted(jnp.asarray(particles, jnp.float32), jax.random.key(seed)))


def polished(
    scene: Scene,
    particles: Particles,
    rounds: Iterable[Round],
    after_round: Callable[[float], None],
) -> tuple[Particles, int]:
    """Each candidate on its own, by rounds of multipliers.

    Args:
        scene: What the candidates are measured against.
        particles: Their free control points, unit cube.
        rounds: How firmly and how long, in order; the next is asked for when the last is done.
        after_round: Told the lowest metric after each round.

    Returns:
        The candidates and the steps taken.
    """
    state = _begin(scene, jnp.asarray(particles, jnp.float32))
    steps = 0
    for one in rounds:
        state, info = _round(scene, state, jnp.float32(one.penalty), jnp.int32(one.steps))
        steps += one.steps
        metrics = np.asarray(info.ergodic_metric)
        after_round(float(metrics[np.isfinite(metrics)].min(initial=np.inf)))
    return np.asarray(state.free), steps


@eqx.filter_jit
def _parted(particles: Float[Array, "particle free axis"], key: Array) -> Float[Array, "particle free axis"]:
    return stein.separated(particles, key)


@eqx.filter_jit
def _begin_exploring(
    scene: Scene, particles: Float[Array, "particle free axis"], key: Array
) -> tuple[stein.State, Float[Array, "particle"]]:
    reference = jax.vmap(lambda free: augmented_lagrangian.reference_of(scene, free))(particles)
    return stein.init(stein.separated(particles, key)), reference


@eqx.filter_jit
def _explore(
    scene: Scene,
    state: stein.State,
    reference: Float[Array, "particle"],
    smooth: Array,
    kernel: Kernel,
    begins: Float[Array, "particle free axis"],
    prior: Prior | None,
    steps: Int[Array, ""],
) -> stein.State:
    def log_posterior(free: Array, reference: Array, begin: Array) -> Array:
        likelihood = -augmented_lagrangian.penalised(scene, free, reference, STEIN_PENALTY)
        return likelihood if prior is None else likelihood + prior.log_density(free - begin)

    def step(_: Int[Array, ""], state: stein.State) -> stein.State:
        scores = jax.vmap(jax.grad(log_posterior))(state.particles, reference, begins)
        return stein.step(state, scores, kernel, smooth, STEIN_STEPS, LONGEST_STEIN_STEP_UNIT, wraps=scene.has_headings)

    return jax.lax.fori_loop(0, steps, step, state)


@eqx.filter_jit
def _begin(scene: Scene, particles: Float[Array, "particle free axis"]) -> augmented_lagrangian.State:
    return jax.vmap(lambda free: augmented_lagrangian.init(scene, free))(particles)


@eqx.filter_jit
def _round(
    scene: Scene, states: augmented_lagrangian.State, penalty: Float[Array, ""], inner_steps: Int[Array, ""]
) -> tuple[augmented_lagrangian.State, augmented_lagrangian.Info]:
    return augmented_lagrangian.step(scene, states, penalty, inner_steps)
