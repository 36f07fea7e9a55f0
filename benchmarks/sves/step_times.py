"""How long one Stein step of the paper's recipe takes."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from benchmarks.timing import interleaved_ms
from planner import stein
from planner.accelerator import with_exact_products
from planner.information import uniform
from planner.problem import Kernel, MetricWeights
from planner.spectral_metric import SpectralMetric
from planner.workspace import Workspace

INVERSE_TEMPERATURE = 10.0
STEP_SIZE = 0.5


def step_ms(
    box: Workspace, candidates: int, time: int, modes: tuple[int, int, int], repeats: int, together: int = 1
) -> float:
    """Median milliseconds of a step: gradient of E, RBF kernel, update.

    Args:
        box: Any; only its information is used.
        candidates: N.
        time: T.
        modes: Basis functions per axis.
        repeats: Runs counted.
        together: Steps in one call, so that the call itself does not count.
    """
    metric = SpectralMetric.of(uniform(box, (16, 16, 16)).coefficients(modes), MetricWeights.LINEAR)
    weight = jnp.full(time, 1.0 / time)
    gradient = jax.vmap(jax.grad(lambda path: metric(path, weight)))

    @jax.jit
    @with_exact_products
    def steps(particles: jax.Array) -> jax.Array:
        def body(x: jax.Array, _: None) -> tuple[jax.Array, None]:
            return stein.sves_step(x, -INVERSE_TEMPERATURE * gradient(x), Kernel.RBF, STEP_SIZE), None

        moved, _ = jax.lax.scan(body, particles, None, length=together)
        return moved

    start = jax.random.uniform(jax.random.key(0), (candidates, time, 3))
    return interleaved_ms({"step": lambda: steps(start)}, repeats)["step"] / together
