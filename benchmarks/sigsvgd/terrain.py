"""Paths over hilly ground, and their descent.

| symbol | identifier   | unit       | shape               |
|--------|--------------|------------|---------------------|
| p_map  | `density()`  | 1/map²     |                     |
| C      | `cost()`     | 1          |                     |
| x      | `particles`  | map        | particle knot 2     |
| y      | `paths_of()` | map        | particle time 2     |

C(y) = w Σ_t p_map(y_t) + 75 (Σ_t ‖y_t − y_{t−1}‖²)^½, on a map of 5 × 5. The norm is over all steps at once, as in the
authors' code: with the sum of the lengths the way would cost 440 and the ground some 4 (w = 1), so that the straight
line would be the answer everywhere.
"""

from __future__ import annotations

import enum
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline
from scipy.stats import qmc

from benchmarks.sigsvgd.transport import Contender, PathOf, direction

EDGE = 5.0
START, TARGET = np.array([0.25, 0.75]), np.array([4.75, 4.5])
HILLS, SPREAD, TERRAIN_WEIGHT = 20, 0.25, 8.0
LENGTH_WEIGHT = 75.0
KNOTS, SAMPLES = 5, 100
PARTICLES, STEPS, RATE = 20, 500, 0.05
SEEN = 16
"""Places of a path that a kernel between paths sees."""
BANDWIDTH = 1.5
"""h of the paper's static kernel exp(−‖·‖²/h), map²."""


class Begin(enum.Enum):
    """Where the free knots are at first."""

    LINE = "near the line (σ = 0.4)"
    ANYWHERE = "anywhere"


def hills(seed: int) -> Float[np.ndarray, "hill 2"]:
    """Their centres, by a scrambled Halton sequence that keeps half a unit from the border."""
    return qmc.scale(qmc.Halton(2, rng=seed).random(HILLS), 0.5, EDGE - 0.5).astype(np.float32)


def start_set(begin: Begin, seed: int) -> Float[np.ndarray, "particle knot 2"]:
    """Free knots."""
    generator, shape = np.random.default_rng(seed), (PARTICLES, KNOTS - 2, 2)
    if begin is Begin.ANYWHERE:
        return generator.uniform(0.5, EDGE - 0.5, shape).astype(np.float32)
    share = np.linspace(0.0, 1.0, KNOTS)[1:-1, None]
    return (START + share * (TARGET - START) + 0.4 * generator.normal(size=shape)).astype(np.float32)


def spline(samples: int) -> tuple[Float[np.ndarray, "time 2"], Float[np.ndarray, "time knot"]]:
    """The natural cubic spline through the knots: what its fixed ends contribute, and the matrix on its free knots."""
    knots, at = np.linspace(0.0, 1.0, KNOTS), np.linspace(0.0, 1.0, samples)
    matrix = np.stack([CubicSpline(knots, one, bc_type="natural")(at) for one in np.eye(KNOTS)], axis=1)
    ends = matrix[:, [0, -1]] @ np.stack([START, TARGET])
    return ends.astype(np.float32), matrix[:, 1:-1].astype(np.float32)


def paths_of(particles: Float[Array, "particle knot 2"]) -> Float[Array, "particle time 2"]:
    """The whole paths."""
    ends, matrix = spline(SAMPLES)
    return jnp.asarray(ends) + jnp.einsum("tk,nka->nta", matrix, particles)


def density(centers: Float[Array, "hill 2"], places: Float[Array, "*batch 2"]) -> Float[Array, "*batch"]:
    """p_map, an equal mixture of normal densities."""
    squared = jnp.sum((places[..., None, :] - centers) ** 2, axis=-1)
    return jnp.mean(jnp.exp(-0.5 * squared / SPREAD**2), axis=-1) / (2.0 * jnp.pi * SPREAD**2)


def cost(centers: Float[Array, "hill 2"], path: Float[Array, "time 2"]) -> Float[Array, ""]:
    """C of one path."""
    steps = jnp.diff(path, axis=0)
    return TERRAIN_WEIGHT * jnp.sum(density(centers, path)) + LENGTH_WEIGHT * jnp.sqrt(jnp.sum(steps**2))


def repulsion_weight(index: Array) -> Array:
    """One until a quarter of the steps, then a cosine to zero at three quarters."""
    return 0.5 * (1.0 + jnp.cos(jnp.pi * jnp.clip(2.0 * index / STEPS - 0.5, 0.0, 1.0)))


def descent(contender: Contender, steps: int = STEPS) -> Callable[[np.ndarray, np.ndarray], tuple[Array, Array]]:
    """From centres and start set to paths and their costs, by Adam along φ, compiled."""
    ends, matrix = spline(SEEN)
    offset, path_of = jnp.asarray(ends / EDGE), PathOf(matrix / EDGE, BANDWIDTH / EDGE**2)
    adam = optax.adam(RATE)

    @jax.jit
    def descended(
        centers: Float[np.ndarray, "hill 2"], start: Float[np.ndarray, "particle knot 2"]
    ) -> tuple[Array, Array]:
        def costs(particles: Array) -> Array:
            return jax.vmap(lambda path: cost(jnp.asarray(centers), path))(paths_of(particles))

        def body(carry: tuple[Array, optax.OptState], index: Array) -> tuple[tuple[Array, optax.OptState], None]:
            particles, memory = carry
            score = -jax.grad(lambda x: jnp.sum(costs(x)))(particles)
            phi = direction(contender, particles, score, repulsion_weight(index), path_of, offset)
            updates, memory = adam.update(-phi, memory)
            return (jnp.asarray(optax.apply_updates(particles, updates)), memory), None

        begin = jnp.asarray(start)
        (particles, _), _ = jax.lax.scan(body, (begin, adam.init(begin)), jnp.arange(steps))
        return paths_of(particles), costs(particles)

    return descended
