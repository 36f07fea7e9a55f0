"""The optimiser's compiled pieces: Stein steps on the set, rounds of multipliers on each candidate, on all cores.

One jit an entry point; shapes are static, so problems of similar size share them.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import TypeVar

import jax
import numpy as np
from jaxtyping import Array, Float, Int
from scipy.spatial.distance import pdist

from planner import augmented_lagrangian, stein
from planner.accelerator import cores, with_exact_products
from planner.priors import Prior
from planner.problem import Kernel
from planner.scene import Scene

# Short last steps would move nothing that the polish does not move better.
ANNEALING = stein.Annealing(5, 0.2, 0.01)
# The Stein phase may cut corners; the polish makes them good.
STEIN_PENALTY = 0.1
FEWEST_KNOTS_A_PART = 40
"""Rounds of fewer, over all candidates of a part, take less time than it takes threads to meet."""

Particles = Float[np.ndarray, "particle free axis"]
Taken = TypeVar("Taken")
Given = TypeVar("Given")


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
        portions: How many steps to take, and again when they are done; `ANNEALING.steps` in all.
        prior: How likely it is that they get so far from where they begin; None: they get as far as they like.

    Returns:
        The candidates and the steps taken.
    """
    smooth = stein.smoother(particles.shape[1])
    state = stein.init(parted(particles, seed))
    begins = state.particles
    for steps in portions:
        state = jax.block_until_ready(_explore(scene, state, begins, smooth, kernel, prior, np.int32(steps)))
    return np.asarray(state.particles), int(state.index)


def parted(particles: Particles, seed: int) -> Particles:
    """The set with candidates that coincide moved apart: polished each on its own, they would end alike."""
    particles = np.asarray(particles, np.float32)
    count, knots, _ = particles.shape
    apart_unit = pdist(particles.reshape(count, -1)) / np.sqrt(knots)
    # Few sets need it, and what they need has to be compiled.
    if apart_unit.min(initial=np.inf) >= stein.COINCIDING_UNIT:
        return particles
    return np.asarray(_separated(particles, np.int32(seed)))


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
    parts = _for_each_core(np.asarray(particles, np.float32))
    steps = 0
    with ThreadPoolExecutor(len(parts)) as threads:
        states = _each(threads, lambda part: _begin(scene, part), parts)
        for one in rounds:
            penalty, moves = np.float32(one.penalty), np.int32(one.steps)
            ended = _each(threads, lambda part, p=penalty, m=moves: _round(scene, part, p, m), states)
            states = [state for state, _ in ended]
            steps += one.steps
            metrics = np.concatenate([info.ergodic_metric for _, info in ended])
            after_round(float(metrics[np.isfinite(metrics)].min(initial=np.inf)))
    return np.concatenate([state.free for state in states])[: len(particles)], steps


def _for_each_core(particles: Particles) -> list[Particles]:
    """The set in parts of one size, and so of one compilation: what is missing is filled up from the beginning."""
    number, knots, _ = particles.shape
    count = max(1, min(number, cores(), number * knots // FEWEST_KNOTS_A_PART))
    width = -(-number // count)
    return np.split(particles[np.resize(np.arange(number), count * width)], count)


def _each(threads: Executor, work: Callable[[Given], Taken], parts: Sequence[Given]) -> list[Taken]:
    """What comes of every part, all at once: the first in this thread, the others in one each.

    Candidates have nothing to do with each other here, and of loops as short as theirs XLA by itself gives a second
    core little to do. No work may call LAPACK: it waits in a thread of XLA's for others of the same few, and parts that
    do so at once wait for ever.
    """
    others = [threads.submit(lambda part: jax.block_until_ready(work(part)), part) for part in parts[1:]]
    return [jax.block_until_ready(work(parts[0])), *(other.result() for other in others)]


@jax.jit
def _separated(
    particles: Float[Array, "particle free axis"], seed: Int[Array, ""]
) -> Float[Array, "particle free axis"]:
    return stein.separated(particles, jax.random.key(seed))


@functools.partial(jax.jit, static_argnames="kernel")
@with_exact_products
def _explore(
    scene: Scene,
    state: stein.State,
    begins: Float[Array, "particle free axis"],
    smooth: Float[Array, "free free"],
    kernel: Kernel,
    prior: Prior | None,
    steps: Int[Array, ""],
) -> stein.State:
    references = jax.vmap(lambda free: augmented_lagrangian.reference_of(scene, free))(begins)

    def log_posterior(free: Array, reference: Array, begin: Array) -> Array:
        likelihood = -augmented_lagrangian.penalised(scene, free, reference, STEIN_PENALTY)
        return likelihood if prior is None else likelihood + prior.log_density(free - begin)

    def step(_: Int[Array, ""], state: stein.State) -> stein.State:
        scores = jax.vmap(jax.grad(log_posterior))(state.particles, references, begins)
        return stein.step(state, scores, kernel, smooth, ANNEALING, wraps=scene.has_headings)

    return jax.lax.fori_loop(0, steps, step, state)


@jax.jit
@with_exact_products
def _begin(scene: Scene, particles: Float[Array, "particle free axis"]) -> augmented_lagrangian.State:
    return jax.vmap(lambda free: augmented_lagrangian.init(scene, free))(particles)


@jax.jit
@with_exact_products
def _round(
    scene: Scene, states: augmented_lagrangian.State, penalty: Float[Array, ""], inner_steps: Int[Array, ""]
) -> tuple[augmented_lagrangian.State, augmented_lagrangian.Info]:
    return augmented_lagrangian.step(scene, states, penalty, inner_steps)
