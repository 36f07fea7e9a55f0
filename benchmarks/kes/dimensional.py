"""Both metrics in any number of axes, by the formulas of `planner.spectral_metric` and `planner.kernel_metric`.

The product's kernel metric takes any number of axes as it is. Its spectral metric takes three: here the same product
of matrices is written for v axes, half of them on either side, and differentiated by JAX.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from planner.density_field import SampleField
from planner.kernel_metric import KernelMetric

Metric = Callable[[jax.Array], jax.Array]
PEAKS, PEAK_STD, KERNEL_STD = 3, 0.12, 0.06


def kernel(axes: int) -> Metric:
    """The product's kernel metric of a path in `axes` axes, for a mixture of normal densities."""
    centers = np.random.default_rng(0).uniform(0.2, 0.8, (PEAKS, axes))
    theta = jnp.full(axes, KERNEL_STD**2)
    field = SampleField(
        jnp.asarray(centers, jnp.float32), jnp.full(PEAKS, 1.0 / PEAKS), theta + PEAK_STD**2, wraps=False
    )
    metric = KernelMetric(
        attraction=field,
        variance=theta,
        counts=jnp.ones(axes),
        constant=jnp.zeros(()),
        covered=jnp.zeros((0, axes)),
        covered_weight=jnp.zeros(0),
        covered_share=jnp.zeros(()),
        wraps=False,
    )
    return lambda path: metric(path, jnp.full(path.shape[0], 1.0 / path.shape[0]))


def separable(axes: int, modes: int) -> Metric:
    """The spectral metric as a product of matrices of per-axis tables."""
    target, weights = _target(axes, modes)

    def metric(path: jax.Array) -> jax.Array:
        tables = [_table(path[:, axis], modes) for axis in range(axes)]
        rows, columns = (functools.reduce(_pairs, half) for half in (tables[: axes // 2], tables[axes // 2 :]))
        mean = (rows @ columns.T / path.shape[0]).reshape(-1)
        return jnp.sum(weights * (mean - target) ** 2)

    return metric


def naive(axes: int, modes: int) -> Metric:
    """The spectral metric as it is printed: for every sample and every mode a product of cosines."""
    target, weights = _target(axes, modes)
    k = np.stack(np.meshgrid(*[np.arange(modes)] * axes, indexing="ij"), -1).reshape(-1, axes)
    norm = np.prod(np.where(k == 0, 1.0, np.sqrt(2.0)), axis=1).astype(np.float32)

    def metric(path: jax.Array) -> jax.Array:
        basis = norm * jnp.prod(jnp.cos(jnp.pi * path[:, None] * k.astype(np.float32)), axis=-1)
        return jnp.sum(weights * (jnp.mean(basis, axis=0) - target) ** 2)

    return metric


@functools.cache
def _target(axes: int, modes: int) -> tuple[np.ndarray, np.ndarray]:
    """φ_k and Λ_k of all modes; their values change no time."""
    k = np.indices((modes,) * axes).reshape(axes, -1)
    weights = (1.0 + np.sqrt(np.sum(k.astype(float) ** 2, axis=0))) ** (-(axes + 1) / 2.0)
    return np.random.default_rng(0).normal(size=weights.shape).astype(np.float32), weights.astype(np.float32)


def _table(position: jax.Array, modes: int) -> jax.Array:
    """cos(πkw)/h_k, shape (mode, time)."""
    k = np.arange(modes)
    return jnp.cos(jnp.pi * k[:, None].astype(np.float32) * position) * np.where(k == 0, 1.0, np.sqrt(2.0))[
        :, None
    ].astype(np.float32)


def _pairs(first: jax.Array, second: jax.Array) -> jax.Array:
    return (first[:, None] * second[None]).reshape(-1, first.shape[-1])
