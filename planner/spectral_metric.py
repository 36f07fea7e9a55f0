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

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.special import factorial

from planner.accelerator import on_a_processor, unfused
from planner.problem import Covered, MetricWeights
from planner.single_precision import single

MOST_WRITTEN_OUT = 64
"""So many products of two modes at most are written out: more take longer than a product of matrices."""

_TERMS = np.arange(7)
# sin(πv)/v and cos(πv) in powers of v².
_SINE_SERIES = ((-1.0) ** _TERMS * np.pi ** (2 * _TERMS + 1) / factorial(2 * _TERMS + 1)).astype(np.float32)
_COSINE_SERIES = ((-1.0) ** _TERMS * np.pi ** (2 * _TERMS) / factorial(2 * _TERMS)).astype(np.float32)


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
            single(mode_weights(target.shape, weights)),
            single(target),
            single(mean),
            single(share),
        )

    def __call__(self, position_unit: Float[Array, "time 3"], time_weight: Float[Array, "time"]) -> Float[Array, ""]:
        """E of one path, differentiable in the positions.

        Args:
            position_unit: Samples in the unit cube.
            time_weight: Share of the path's time that each sample stands for; sums to one.
        """
        return _ergodic_metric(self, position_unit, time_weight)

    def basis(self, position_unit: Float[Array, "3"]) -> Float[Array, "k0 k1 k2"]:
        """F_k at one place: what a moment there adds to the memory."""
        tables = [
            jnp.cos(jnp.pi * position_unit[axis] * np.arange(count))
            * np.where(np.arange(count) == 0, 1.0, np.sqrt(2.0))
            for axis, count in enumerate(self.target.shape)
        ]
        return jnp.einsum("a,b,c->abc", *tables).astype(position_unit.dtype)

    def with_covered(self, mean_basis: Float[Array, "k0 k1 k2"], share: Float[Array, ""]) -> SpectralMetric:
        """The same metric with another memory.

        Args:
            mean_basis: Mean of `basis` over what was flown.
            share: Share of that in the whole time, in [0, 1).
        """
        return dataclasses.replace(self, covered_mean=mean_basis, covered_share=share)

    def residual(
        self, position_unit: Float[Array, "time 3"], time_weight: Float[Array, "time"]
    ) -> Float[Array, "k0 k1 k2"]:
        """c_k − φ_k of one path, with memory in c: E is the sum of its squares by Λ_k.

        Args:
            position_unit: Samples in the unit cube.
            time_weight: Share of the path's time that each sample stands for; sums to one.
        """
        modes = self.target.shape
        return _residual(self, tuple(_tables(position_unit[:, axis], modes[axis])[0] for axis in range(3)), time_weight)


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
    pairs = (tables[1][:, :, None] * tables[2][:, None]).reshape(len(position_unit), -1)
    return ((tables[0] * time_weight[:, None]).T @ pairs).reshape(modes)


def _tables(position: Float[Array, "time"], modes: int) -> tuple[Float[Array, "k time"], Float[Array, "k time"]]:
    """cos(πkw)/h_k and its derivative for one axis.

    On a processor there is one cosine and one sine a sample; the other modes follow by angle addition, doubling the
    table each round. The barriers keep the compiler from fusing the rounds, which would compute each of them again for
    every mode: with them the tables cost a third. On a GPU all modes are one kernel.
    """
    if modes == 1:
        return jnp.ones_like(position[None]), jnp.zeros_like(position[None])
    if on_a_processor():
        cosine, sine = unfused(_half_turns(position[None]))
        while cosine.shape[0] < modes - 1:
            cos_last, sin_last = cosine[-1:], sine[-1:]
            cosine, sine = unfused(
                (
                    jnp.concatenate([cosine, cosine * cos_last - sine * sin_last]),
                    jnp.concatenate([sine, sine * cos_last + cosine * sin_last]),
                )
            )
    else:
        cosine, sine = _half_turns(jnp.arange(1, modes, dtype=position.dtype)[:, None] * position)
    slope = (-np.pi * np.sqrt(2.0) * np.arange(1, modes)).astype(position.dtype)[:, None]
    return (
        jnp.concatenate([jnp.ones_like(position[None]), cosine[: modes - 1] * np.float32(np.sqrt(2.0))]),
        jnp.concatenate([jnp.zeros_like(position[None]), sine[: modes - 1] * slope]),
    )


def _half_turns(w: Float[Array, "..."]) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """cos(πw) and sin(πw) to single precision, a third of the time of the general functions.

    Those are made for arguments of any size. Here w is folded into one period, and about its quarter both are short
    Taylor series (|v| ≤ ½: the first term left out is below 2e-8).
    """
    folded = w - 2.0 * jnp.round(0.5 * w)
    v = 0.5 - jnp.abs(folded)
    square = v * v
    sine = jnp.full_like(w, _SINE_SERIES[-1])
    cosine = jnp.full_like(w, _COSINE_SERIES[-1])
    for odd, even in zip(_SINE_SERIES[-2::-1], _COSINE_SERIES[-2::-1], strict=True):
        sine, cosine = sine * square + odd, cosine * square + even
    return v * sine, jnp.sign(folded) * cosine


def _residual(
    metric: SpectralMetric,
    cosines: tuple[Float[Array, "k time"], ...],
    time_weight: Float[Array, "time"],
) -> Float[Array, "k0 k1 k2"]:
    first, second, third = cosines
    path_mean = ((first * time_weight) @ _pairs(second, third).T).reshape(metric.target.shape)
    share = metric.covered_share
    return share * metric.covered_mean + (1.0 - share) * path_mean - metric.target


def _pairs(second: Float[Array, "k1 time"], third: Float[Array, "k2 time"]) -> Float[Array, "k12 time"]:
    """Products of every mode of two axes."""
    return (second[:, None] * third[None]).reshape(-1, second.shape[-1])


@jax.custom_vjp
def _ergodic_metric(
    metric: SpectralMetric, position_unit: Float[Array, "time 3"], time_weight: Float[Array, "time"]
) -> Float[Array, ""]:
    return jnp.sum(metric.weights * metric.residual(position_unit, time_weight) ** 2)


def _forward(metric, position_unit, time_weight):  # noqa: ANN001 (custom_vjp's own signature)
    tables = [_tables(position_unit[:, axis], metric.target.shape[axis]) for axis in range(3)]
    residual = _residual(metric, tuple(cosine for cosine, _ in tables), time_weight)
    weighted = metric.weights * residual
    factor = 2.0 * (1.0 - metric.covered_share) * time_weight
    # Written axis by axis and turned afterwards: as one loop the stacking would keep the sums from being vectorised.
    gradient = unfused(jnp.stack([factor * slope for slope in _slopes(weighted, tables)]))
    return jnp.sum(weighted * residual), (gradient.T, metric, time_weight)


def _slopes(
    weighted: Float[Array, "k0 k1 k2"], tables: Sequence[tuple[Float[Array, "k time"], Float[Array, "k time"]]]
) -> list[Float[Array, "time"]]:
    """Σ_k a_k ∂F_k/∂w along each axis: products of matrices over one axis, then sums over the others."""
    (cos0, sin0), (cos1, sin1), (cos2, sin2) = tables
    modes0, modes1, modes2 = weighted.shape
    if modes2 == 1:
        plane = weighted[..., 0]
        first = _sum_of_products(sin0, _product(plane, cos1))
        return [first, _sum_of_products(cos0, _product(plane, sin1)), jnp.zeros_like(first)]
    flat = weighted.reshape(modes0, -1).T
    by_sine = (flat @ sin0).reshape(modes1, modes2, -1)
    by_cosine = (flat @ cos0).reshape(modes1, modes2, -1)
    along0, along1, along2 = unfused(
        tuple(
            _sum_of_products([rows[:, mode] for mode in range(modes2)], table)
            for rows, table in ((by_sine, cos2), (by_cosine, cos2), (by_cosine, sin2))
        )
    )
    return [_sum_of_products(along0, cos1), _sum_of_products(along1, sin1), _sum_of_products(along2, cos1)]


def _product(coefficients: Float[Array, "k l"], table: Float[Array, "l time"]) -> Array | list[Array]:
    """Rows of the product of matrices; written out where they are few, so that what follows is fused with it."""
    if coefficients.size > MOST_WRITTEN_OUT:
        return coefficients @ table
    return [_sum_of_products(row, table) for row in coefficients]


def _sum_of_products(a: Array | list[Array], b: Array | list[Array]) -> Float[Array, "time"]:
    """Σ_k a_k b_k, written out: a reduction is not fused with what follows, and takes up to twice as long."""
    return sum((a[k] * b[k] for k in range(1, len(b))), a[0] * b[0])


def _backward(saved, cotangent):  # noqa: ANN001 (custom_vjp's own signature)
    gradient, metric, time_weight = saved
    # Only positions are optimised: target, weights and times are data.
    return jax.tree.map(jnp.zeros_like, metric), cotangent * gradient, jnp.zeros_like(time_weight)


_ergodic_metric.defvjp(_forward, _backward)
