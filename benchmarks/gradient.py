"""A gradient of the metric: the separable form against autodiff of the product of cosines.

python -m benchmarks.gradient
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.timing import interleaved_ms, machine
from planner.information import uniform
from planner.problem import MetricWeights
from planner.spectral_metric import SpectralMetric
from planner.workspace import Workspace

# Particles, samples, modes: the paper's sizes and the field problem's.
SIZES = (
    (16, 50, (8, 8, 8)),
    (64, 100, (8, 8, 8)),
    (50, 100, (8, 8, 1)),
    (4, 50, (8, 8, 8)),
    (16, 600, (32, 32, 4)),
)
LARGEST_NAIVE = 2e8


def naive_metric(metric: SpectralMetric):
    """E as most public code writes it: every mode's product of cosines at every sample."""
    modes = metric.target.shape
    axes = [axis for axis in range(3) if modes[axis] > 1]
    k = np.stack(np.meshgrid(*[np.arange(modes[axis]) for axis in axes], indexing="ij"), -1).reshape(-1, len(axes))
    h = np.prod(np.where(k == 0, 1.0, np.sqrt(0.5)), axis=-1)

    def value(positions: jax.Array) -> jax.Array:
        basis = jnp.prod(jnp.cos(jnp.pi * k * positions[:, None, axes]), axis=-1) / h
        return jnp.sum(metric.weights.reshape(-1) * (jnp.mean(basis, axis=0) - metric.target.reshape(-1)) ** 2)

    return value


def main() -> None:
    """Print the table."""
    print(machine())
    print(f"{'N':>5} {'T':>5} {'modes':>12} {'separable ms':>13} {'autodiff ms':>12} {'ratio':>6} {'error':>8}")
    box = Workspace(np.zeros(3), np.ones(3))
    for particles, samples, modes in SIZES:
        metric = SpectralMetric.of(uniform(box).coefficients(modes), MetricWeights.LINEAR)
        positions = jax.random.uniform(jax.random.key(0), (particles, samples, 3))
        weight = jnp.full(samples, 1.0 / samples)
        ours = jax.jit(jax.vmap(jax.value_and_grad(lambda x, m=metric, w=weight: m(x, w))))
        contenders = {"separable": lambda f=ours, x=positions: f(x)}
        affordable = particles * samples * np.prod(modes) < LARGEST_NAIVE
        error = float("nan")
        if affordable:
            theirs = jax.jit(jax.vmap(jax.value_and_grad(naive_metric(metric))))
            contenders["autodiff"] = lambda f=theirs, x=positions: f(x)
            expected = theirs(positions)[1]
            error = float(jnp.abs(ours(positions)[1] - expected).max() / jnp.abs(expected).max())
        found = interleaved_ms(contenders, repeats=15, in_a_row=5)
        naive = found.get("autodiff", float("nan"))
        print(
            f"{particles:>5} {samples:>5} {'×'.join(map(str, modes)):>12} {found['separable']:>13.2f} {naive:>12.2f} "
            f"{naive / found['separable']:>6.1f} {error:>8.1e}"
        )


if __name__ == "__main__":
    main()
