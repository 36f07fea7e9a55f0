"""The optimiser's compiled pieces: Stein steps on the set, rounds of multipliers on each candidate.

One jit an entry point; shapes are static, so problems of similar size share them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from planner import augmented_lagrangian, stein
from planner.problem import Kernel
from planner.scene import Scene

STEIN_STEPS = 60
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


def explored(scene: Scene, particles: Particles, kernel: Kernel, seed: int) -> Particles:
    """The set after `STEIN_STEPS` Stein steps, all candidates together under soft penalties.

    Args:
        scene: What the candidates are measured against.
        particles: Their free control points, unit cube.
        kernel: How they repel each other.
        seed: Of the noise that parts candidates which coincide.
    """
    smooth = jnp.asarray(stein.smoother(particles.shape[1]))
    start = jnp.asarray(particles, jnp.float32)
    return np.asarray(_explore(scene, start, smooth, jax.random.key(seed), kernel))


def polished(
    scene: Scene,
    particles: Particles,
    rounds: Sequence[Round],
    after_round: Callable[[float], bool],
) -> tuple[Particles, int]:
    """Each candidate on its own, by rounds of multipliers.

    Args:
        scene: What the candidates are measured against.
        particles: Their free control points, unit cube.
        rounds: How firmly and how long, in order.
        after_round: Told the lowest metric after each round; says whether to go on.

    Returns:
        The candidates and the steps taken.
    """
    state = _begin(scene, jnp.asarray(particles, jnp.float32))
    steps = 0
    for one in rounds:
        state, info = _round(scene, state, jnp.float32(one.penalty), jnp.int32(one.steps))
        steps += one.steps
        metrics = np.asarray(info.ergodic_metric)
        if not after_round(float(metrics[np.isfinite(metrics)].min(initial=np.inf))):
            break
    return np.asarray(state.free), steps


@eqx.filter_jit
def _explore(
    scene: Scene, particles: Float[Array, "particle free axis"], smooth: Array, key: Array, kernel: Kernel
) -> Float[Array, "particle free axis"]:
    reference = jax.vmap(lambda free: augmented_lagrangian.init(scene, free).reference)(particles)

    def score(free: Array, reference: Array) -> Array:
        return -jax.grad(lambda free: augmented_lagrangian.penalised(scene, free, reference, STEIN_PENALTY))(free)

    def body(state: stein.State, _: None) -> tuple[stein.State, None]:
        scores = jax.vmap(score)(state.particles, reference)
        return stein.step(state, scores, kernel, smooth, STEIN_STEPS, wraps=scene.has_headings), None

    state, _ = jax.lax.scan(body, stein.init(stein.separated(particles, key)), None, length=STEIN_STEPS)
    return state.particles


@eqx.filter_jit
def _begin(scene: Scene, particles: Float[Array, "particle free axis"]) -> augmented_lagrangian.State:
    return jax.vmap(lambda free: augmented_lagrangian.init(scene, free))(particles)


@eqx.filter_jit
def _round(
    scene: Scene, state: augmented_lagrangian.State, penalty: Float[Array, ""], inner_steps: Int[Array, ""]
) -> tuple[augmented_lagrangian.State, augmented_lagrangian.Info]:
    return jax.vmap(lambda one: augmented_lagrangian.step(scene, one, penalty, inner_steps))(state)
