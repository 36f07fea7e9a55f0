"""The spectral ergodic metric in its separable form.

E = Σ_k Λ_k (c_k − φ_k)² (SVES eqs. 1–3), with the cosine basis F_k(w) = Π_i cos(πk_i w_i)/h_{k_i} on the unit cube. The
basis is a product, so c is a matrix product of per-axis cosine tables and the gradient is two more with sine tables:
some twenty times less work than differentiating the product of cosines.

| symbol | identifier       | unit | shape          |
|--------|------------------|------|----------------|
| Λ_k    | `weights`        | 1    | k0 k1 k2       |
| φ_k    | `target`         | 1    | k0 k1 k2       |
| c_k    | `mean_basis()`   | 1    | k0 k1 k2       |
| w_t    | `time_weight`    | 1    | time, sums to 1|

Departures from the paper:
1. An axis with one mode is left out: it adds neither to the basis nor to the dimension v in Λ, so a flat map in a box
   with altitude is measured as the two-dimensional problem that it is.
2. What was flown before enters c as a time-weighted mean (memory), so a replan continues a coverage and does not
   repeat it.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from planner.problem import Covered, MetricWeights


class SpectralMetric(eqx.Module):
    """E of a path in the unit cube, against a target, with memory.

    Attributes:
        weights: Λ_k, shape (k0, k1, k2).
        target: φ_k, shape (k0, k1, k2).
        covered_mean: Mean basis of what was flown before, shape (k0, k1, k2).
        covered_share: Its share of the whole time, in [0, 1).
    """

    weights: Float[Array, "k0 k1 k2"]
    target: Float[Array, "k0 k1 k2"]
    covered_mean: Float[Array, "k0 k1 k2"]
    covered_share: Float[Array, ""]

    @classmethod
    def of(
        cls,
        target: Float[np.ndarray, "k0 k1 k2"],
        weights: MetricWeights,
        covered: Covered | None = None,
        duration_s: float = 1.0,
    ) -> SpectralMetric:
        """The metric for a target's coefficients.

        Args:
            target: φ_k of the information (`DensityGrid.coefficients`).
            weights: Convention of Λ.
            covered: What was flown before.
            duration_s: Time of the path that will be measured; only its ratio to the covered time matters.
        """
        share = 0.0 if covered is None else covered.duration_s / (covered.duration_s + duration_s)
        mean = np.zeros(target.shape) if covered is None else covered.mean_basis
        return cls(
            jnp.asarray(mode_weights(target.shape, weights), jnp.float32),
            jnp.asarray(target, jnp.float32),
            jnp.asarray(mean, jnp.float32),
            jnp.asarray(share, jnp.float32),
        )

    def __call__(self, position_unit: Float[Array, "time 3"], time_weight: Float[Array, "time"]) -> Float[Array, ""]:
        """E of one path, differentiable in the positions.

        Args:
            position_unit: Samples in the unit cube.
            time_weight: Share of the path's time that each sample stands for; sums to one.
        """
        return _ergodic_metric(self, position_unit, time_weight)


def mode_weights(modes: tuple[int, ...], convention: MetricWeights) -> Float[np.ndarray, "k0 k1 k2"]:
    """Λ_k for every mode.

    LINEAR is SVES as printed, (1 + ‖k‖)^{−(v+1)/2}; SQUARED is Mathew & Mezić, (1 + ‖k‖²)^{−(v+1)/2}. v counts the axes
    with more than one mode.
    """
    k = np.stack(np.meshgrid(*[np.arange(count) for count in modes], indexing="ij"), axis=-1)
    norm_squared = (k.astype(float) ** 2).sum(-1)
    exponent = -(sum(count > 1 for count in modes) + 1) / 2.0
    match convention:
        case MetricWeights.LINEAR:
            return (1.0 + np.sqrt(norm_squared)) ** exponent
        case MetricWeights.SQUARED:
            return (1.0 + norm_squared) ** exponent


def mean_basis(
    position_unit: Float[np.ndarray, "time 3"],
    time_weight: Float[np.ndarray, "time"],
    modes: tuple[int, int, int],
) -> Float[np.ndarray, "k0 k1 k2"]:
    """c_k of a path on the host, in double precision: what a flight remembers as covered."""
    k = [np.arange(count) for count in modes]
    tables = [
        np.cos(np.pi * position_unit[:, axis, None] * k[axis]) * np.where(k[axis] == 0, 1.0, np.sqrt(2.0))
        for axis in range(3)
    ]
    return np.einsum("t,ta,tb,tc->abc", time_weight, *tables, optimize=True)


def _tables(position: Float[Array, "time"], modes: int) -> tuple[Float[Array, "time k"], Float[Array, "time k"]]:
    """cos(πkw)/h_k and its derivative for one axis.

    One cosine and one sine a sample; the other modes follow by angle addition, doubling the table each round, which is
    several times faster than a call of cos for each and keeps the rounding error at log2(k) products.
    """
    angle = jnp.pi * position[:, None]
    cosine = jnp.concatenate([jnp.ones_like(angle), jnp.cos(angle)], axis=1)
    sine = jnp.concatenate([jnp.zeros_like(angle), jnp.sin(angle)], axis=1)
    while cosine.shape[1] < modes:
        cos_last, sin_last = cosine[:, -1:], sine[:, -1:]
        more_cosine = cosine[:, 1:] * cos_last - sine[:, 1:] * sin_last
        more_sine = sine[:, 1:] * cos_last + cosine[:, 1:] * sin_last
        cosine = jnp.concatenate([cosine, more_cosine], axis=1)
        sine = jnp.concatenate([sine, more_sine], axis=1)
    k = np.arange(modes)
    scale = np.where(k == 0, 1.0, np.sqrt(2.0)).astype(position.dtype)
    return cosine[:, :modes] * scale, sine[:, :modes] * (-np.pi * k * scale).astype(position.dtype)


def _residual(
    metric: SpectralMetric,
    cosines: tuple[Float[Array, "time k"], ...],
    time_weight: Float[Array, "time"],
) -> Float[Array, "k0 k1 k2"]:
    """C − φ, with memory in c."""
    first, second, third = cosines
    pair = (second[:, :, None] * third[:, None, :]).reshape(first.shape[0], -1)
    path_mean = ((first * time_weight[:, None]).T @ pair).reshape(metric.target.shape)
    share = metric.covered_share
    return share * metric.covered_mean + (1.0 - share) * path_mean - metric.target


@jax.custom_vjp
def _ergodic_metric(
    metric: SpectralMetric, position_unit: Float[Array, "time 3"], time_weight: Float[Array, "time"]
) -> Float[Array, ""]:
    cosines = tuple(_tables(position_unit[:, axis], metric.target.shape[axis])[0] for axis in range(3))
    residual = _residual(metric, cosines, time_weight)
    return jnp.sum(metric.weights * residual**2)


def _forward(metric, position_unit, time_weight):  # noqa: ANN001 (custom_vjp's own signature)
    tables = [_tables(position_unit[:, axis], metric.target.shape[axis]) for axis in range(3)]
    (cos0, sin0), (cos1, sin1), (cos2, sin2) = tables
    residual = _residual(metric, (cos0, cos1, cos2), time_weight)
    weighted = metric.weights * residual
    modes = metric.target.shape
    flat = weighted.reshape(modes[0], -1)
    along = (cos0 @ flat).reshape(-1, modes[1], modes[2])
    across = (sin0 @ flat).reshape(-1, modes[1], modes[2])
    third_cos = jnp.einsum("tbc,tc->tb", along, cos2)
    gradient = jnp.stack(
        [
            jnp.einsum("tbc,tb,tc->t", across, cos1, cos2),
            jnp.einsum("tb,tb->t", third_cos, sin1),
            jnp.einsum("tbc,tb,tc->t", along, cos1, sin2),
        ],
        axis=-1,
    )
    factor = 2.0 * (1.0 - metric.covered_share)
    return jnp.sum(weighted * residual), (factor * gradient * time_weight[:, None], metric, time_weight)


def _backward(saved, cotangent):  # noqa: ANN001 (custom_vjp's own signature)
    gradient, metric, time_weight = saved
    # Only positions are optimised: target, weights and times are data.
    return jax.tree.map(jnp.zeros_like, metric), cotangent * gradient, jnp.zeros_like(time_weight)


_ergodic_metric.defvjp(_forward, _backward)
