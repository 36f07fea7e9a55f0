"""How wide the kernel of the kernel metric is: KES eq. (30).

Samples of p are themselves an ergodic "path", so the right kernel leaves them where they are:

θ* = argmin_θ Σ_i ‖∂/∂x_i ( −(2/N) Σ p(x_i) + (1/N²) ΣΣ g_θ(x_i, x_j) )‖²,    x_i ~ p.

The search is over log10 θ, each axis its own, from −3. With too narrow a kernel no sample feels another, with too wide
a one none feels a difference: both leave samples of a uniform density in peace, so the search is held between half the
distance of neighbouring samples and a tenth of the box, about the finest half wave of eight cosines.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

START_LOG10 = -3.0
NEIGHBOUR_SHARE = 0.5
WIDEST_UNIT = 0.1
WIDEST_RAD = 0.5


def select_variance(
    samples: Float[np.ndarray, "sample axis"],
    density_slope: Float[np.ndarray, "sample axis"],
    *,
    wraps: bool,
    weight: Float[np.ndarray, "sample"] | None = None,
) -> Float[np.ndarray, "axis"]:
    """θ of each axis.

    Args:
        samples: Drawn from p (or weighted so that they stand for it), unit cube (and radians).
        density_slope: ∇p at the samples.
        wraps: Whether the last axis is a heading.
        weight: Share of each sample; None: equal.
    """
    from scipy.optimize import minimize

    count, axes = samples.shape
    share = np.full(count, 1.0 / count) if weight is None else weight / weight.sum()
    difference = samples[:, None] - samples[None]
    if wraps:
        difference[..., -1] = np.mod(difference[..., -1] + np.pi, 2.0 * np.pi) - np.pi
    widest = np.full(axes, WIDEST_UNIT)
    if wraps:
        widest[-1] = WIDEST_RAD
    # Axes of different units are compared as shares of their widest kernel.
    gap = np.sqrt(np.sum((difference / widest) ** 2, axis=-1)) + np.where(np.eye(count) > 0.0, np.inf, 0.0)
    nearest = np.median(gap.min(axis=1)) if count > 1 else 1.0
    high = 2.0 * np.log10(widest)
    low = np.minimum(high + 2.0 * np.log10(np.clip(NEIGHBOUR_SHARE * nearest, 1e-2, 0.5)), high)

    squared, weighted = np.moveaxis(difference**2, -1, 0), np.moveaxis(difference * share[:, None], -1, 0)

    def unrest(log10_variance: Float[np.ndarray, "axis"]) -> float:
        variance = 10.0**log10_variance
        kernel = np.exp(-0.5 * np.tensordot(1.0 / variance, squared, axes=1)) / np.sqrt(np.prod(2.0 * np.pi * variance))
        push = -np.einsum("ij,aij->ia", kernel, weighted) / variance
        return float(share**2 @ np.sum((push - density_slope) ** 2, axis=-1))

    start = np.clip(np.full(axes, START_LOG10), low, high)
    scale = max(unrest(start), 1e-30)
    found = minimize(
        lambda theta: unrest(theta) / scale,
        start,
        method="L-BFGS-B",
        bounds=list(zip(low, high, strict=True)),
    )
    return 10.0 ** np.clip(found.x, low, high)


def silverman_variance(
    samples: Float[np.ndarray, "sample axis"], weight: Float[np.ndarray, "sample"], *, wraps: bool
) -> Float[np.ndarray, "axis"]:
    """The variance of a kernel density estimate by Silverman's rule, each axis its own."""
    axes = samples.shape[1]
    effective = 1.0 / np.sum(weight**2)
    spread = np.sum(weight[:, None] * (samples - weight @ samples) ** 2, axis=0)
    if wraps:
        length = np.clip(abs(np.sum(weight * np.exp(1j * samples[:, -1]))), 1e-9, 1.0 - 1e-12)
        spread[-1] = min(-2.0 * np.log(length), WIDEST_RAD**2)
    factor = (4.0 / ((axes + 2.0) * effective)) ** (2.0 / (axes + 4.0))
    return np.maximum(spread * factor, 1e-5)
