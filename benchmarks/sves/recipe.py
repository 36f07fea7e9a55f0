"""The paper's optimiser on waypoints, with each of its ambiguous or mistaken parts as a switch.

x ← x + ε φ(x), p(x|O) ∝ p(x)^w exp(−λL(x)), L = E + 15·smoothness + obstacle and border terms (SVES Alg. 1).
Candidates are all their waypoints in the unit square (a third coordinate rests at the middle in two dimensions).
"""

from __future__ import annotations

import dataclasses
import enum
import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from planner import stein
from planner.accelerator import with_exact_products
from planner.problem import Kernel
from planner.spectral_metric import SpectralMetric


class ObstacleTerm(enum.Enum):
    """The penalty of a circle (sphere) of centre c and radius r."""

    PRINTED = "max(0, |x − c| − r)"
    CORRECTED = "max(0, r + margin − |x − c|)"


@dataclasses.dataclass(frozen=True)
class Recipe:
    """The paper's settings.

    Attributes:
        kernel: Between candidates.
        inverse_temperature: λ.
        step_size: ε.
        steps: How many.
        smoothness_is_sum: 15·Σ‖Δx‖² as printed, or 15·mean.
        obstacle_term: As printed, or as it must be.
        prior_weight: 1: the prior's gradient takes part as printed; 0: it only draws the start set.
    """

    kernel: Kernel = Kernel.RBF
    inverse_temperature: float = 10.0
    step_size: float = 0.5
    steps: int = 500
    smoothness_is_sum: bool = False
    obstacle_term: ObstacleTerm = ObstacleTerm.CORRECTED
    prior_weight: float = 0.0


SMOOTHNESS = 15.0
PRIOR_VARIANCE = 0.01
MARGIN = 0.02
BORDER = 10.0
OBSTACLE = 10.0
LOGGED = 50

PRINTED = Recipe(smoothness_is_sum=True, obstacle_term=ObstacleTerm.PRINTED, prior_weight=1.0)


@dataclasses.dataclass(frozen=True)
class World:
    """What is explored.

    Attributes:
        metric: E over the unit cube.
        centers: Of the circles (spheres), shape (obstacle, 3).
        radii: Shape (obstacle,).
        line: Straight line from start to end, shape (time, 3): the prior's middle.
        moves: 1 for the coordinates that are optimised, shape (3,).
    """

    metric: Callable[[jax.Array, jax.Array], jax.Array]
    centers: np.ndarray
    radii: np.ndarray
    line: np.ndarray
    moves: np.ndarray


@dataclasses.dataclass(frozen=True)
class Run:
    """A set on its way.

    Attributes:
        step: Steps at which the set was kept, shape (kept,).
        particles: Shape (kept, particle, time, 3).
        metric: E of each, shape (kept, particle).
    """

    step: np.ndarray
    particles: np.ndarray
    metric: np.ndarray

    @property
    def last(self) -> np.ndarray:
        """The set at the end."""
        return self.particles[-1]


def world(
    metric: SpectralMetric,
    start: tuple[float, ...],
    end: tuple[float, ...],
    time: int,
    centers: np.ndarray | None = None,
    radii: np.ndarray | None = None,
) -> World:
    """A world in the unit square or cube, after the length of `start`."""
    dimensions = len(start)
    share = np.linspace(0.0, 1.0, time)[:, None]
    line = np.full((time, 3), 0.5)
    line[:, :dimensions] = (1.0 - share) * np.array(start) + share * np.array(end)
    found = np.zeros((0, dimensions)) if centers is None else np.asarray(centers, dtype=float)
    padded = np.full((len(found), 3), 0.5)
    padded[:, :dimensions] = found
    return World(
        metric, padded, np.zeros(0) if radii is None else np.asarray(radii), line, (np.arange(3) < dimensions) * 1.0
    )


def start_set(place: World, particles: int, seed: int) -> np.ndarray:
    """Drawn from the paper's prior N(interpolation, 0.01)."""
    noise = np.random.default_rng(seed).normal(size=(particles, *place.line.shape)) * np.sqrt(PRIOR_VARIANCE)
    drawn = place.line + noise * place.moves
    drawn[:, 0] = place.line[0]
    return drawn.astype(np.float32)


def loss(recipe: Recipe, place: World, path: jax.Array) -> jax.Array:
    """L of one path."""
    time = path.shape[0]
    energy = place.metric(path, jnp.full(time, 1.0 / time))
    squared = jnp.sum(jnp.diff(path, axis=0) ** 2, axis=-1)
    smoothness = SMOOTHNESS * (jnp.sum(squared) if recipe.smoothness_is_sum else jnp.mean(squared))
    border = BORDER * jnp.mean(jnp.sum(jnp.maximum(0.0, -path) ** 2 + jnp.maximum(0.0, path - 1.0) ** 2, axis=-1))
    total = energy + smoothness + border
    if len(place.radii) == 0:
        return total
    offset = path[:, None] - jnp.asarray(place.centers, jnp.float32)
    # The root has no gradient at a centre.
    distance = jnp.sqrt(jnp.sum(offset**2, axis=-1) + 1e-12)
    radii = jnp.asarray(place.radii, jnp.float32)
    match recipe.obstacle_term:
        case ObstacleTerm.PRINTED:
            broken = jnp.maximum(0.0, distance - radii)
        case ObstacleTerm.CORRECTED:
            broken = jnp.maximum(0.0, radii + MARGIN - distance)
    return total + OBSTACLE * jnp.mean(jnp.sum(broken**2, axis=-1))


def run(recipe: Recipe, place: World, start: np.ndarray) -> Run:
    """All steps, keeping the set now and then."""
    chunks = max(1, recipe.steps // LOGGED)
    particles = jnp.asarray(start)
    step = steps_of(recipe, place, recipe.steps // chunks)
    energy = jax.jit(jax.vmap(lambda path: place.metric(path, jnp.full(path.shape[0], 1.0 / path.shape[0]))))
    kept, figures = [np.asarray(particles)], [np.asarray(energy(particles))]
    for _ in range(chunks):
        particles = step(particles)
        kept.append(np.asarray(particles))
        figures.append(np.asarray(energy(particles)))
    marks = np.arange(chunks + 1) * (recipe.steps // chunks)
    return Run(marks, np.stack(kept), np.stack(figures))


def steps_of(recipe: Recipe, place: World, count: int):
    """`count` compiled steps of a set."""
    gradient = jax.vmap(jax.grad(functools.partial(loss, recipe, place)))
    line = jnp.asarray(place.line, jnp.float32)
    free = jnp.asarray((np.arange(len(place.line)) > 0)[:, None] * place.moves, jnp.float32)

    @jax.jit
    @with_exact_products
    def steps(particles: jax.Array) -> jax.Array:
        def body(x: jax.Array, _: None) -> tuple[jax.Array, None]:
            score = -recipe.inverse_temperature * gradient(x) - recipe.prior_weight * (x - line) / PRIOR_VARIANCE
            moved = stein.sves_step(x, score, recipe.kernel, recipe.step_size)
            return x + free * (moved - x), None

        moved, _ = jax.lax.scan(body, particles, None, length=count)
        return moved

    return steps


def deepest(place: World, particles: np.ndarray) -> float:
    """How far the worst waypoint of a set lies inside a circle (sphere); negative where all are clear."""
    if len(place.radii) == 0:
        return -np.inf
    distance = np.linalg.norm(particles[:, :, None] - place.centers, axis=-1)
    return float((place.radii - distance).max())


def length(paths: np.ndarray) -> np.ndarray:
    """Length of each path, shape (particle,)."""
    return np.linalg.norm(np.diff(paths, axis=-2), axis=-1).sum(axis=-1)
