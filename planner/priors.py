"""What sequences (of controls, of knots) are likely before anything is known of their use.

log p of e = sequence − reference, up to a constant. Hyper-priors are integrated out in closed form, so a candidate is
scored against all values of the hyper-parameter at once and none has to be carried along.

| symbol  | identifier                    | unit            | shape     |
|---------|-------------------------------|-----------------|-----------|
| e       | `sequence` − `reference`      | of the sequence | time axis |
| σ, τ, s | `std`, `offset_std`, `step_std`| of the sequence|           |
| α, β    | `shape`, `rate`               | 1, unit²        |           |
| n       | time × axis                   |                 |           |

SVES draws its start set from N(interpolation, 0.01) and also scores by it, which pins every path to its line: draw from
a prior always, score by it where you mean it.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = float | Float[Array, ""]
Reference = float | Float[Array, "time axis"]


class GaussianPrior(eqx.Module):
    """Every element on its own: e ~ N(0, σ²).

    Attributes:
        std: σ.
        reference: Middle of the distribution: a sequence, or one number for all elements.
    """

    std: Scalar
    reference: Reference = 0.0

    def log_density(self, sequence: Float[Array, "time axis"]) -> Float[Array, ""]:
        """−½ Σ e²/σ²."""
        return -0.5 * jnp.sum(((sequence - self.reference) / self.std) ** 2)

    def sample(self, key: Array, shape: tuple[int, int]) -> Float[Array, "time axis"]:
        """One sequence."""
        return self.reference + self.std * jax.random.normal(key, shape)


class OffsetPrior(eqx.Module):
    """A hyper-prior on the mean: e = θ + noise, θ ~ N(0, τ²) common to all times of an axis, noise ~ N(0, σ²).

    Steady turns and climbs cost little, jitter costs.

    Attributes:
        std: σ.
        offset_std: τ.
        reference: As in `GaussianPrior`.
    """

    std: Scalar
    offset_std: Scalar
    reference: Reference = 0.0

    def log_density(self, sequence: Float[Array, "time axis"]) -> Float[Array, ""]:
        """With θ integrated out: −½ eᵀ(σ²I + τ²11ᵀ)⁻¹e on each axis (Sherman–Morrison)."""
        off = sequence - self.reference
        noise, shared = self.std**2, self.offset_std**2
        weight = shared / (noise + off.shape[0] * shared)
        return -0.5 / noise * (jnp.sum(off**2) - weight * jnp.sum(jnp.sum(off, axis=0) ** 2))

    def sample(self, key: Array, shape: tuple[int, int]) -> Float[Array, "time axis"]:
        """One sequence."""
        for_offset, for_noise = jax.random.split(key)
        offset = self.offset_std * jax.random.normal(for_offset, shape[1:])
        return self.reference + offset + self.std * jax.random.normal(for_noise, shape)


class ScalePrior(eqx.Module):
    """A hyper-prior on the variance: e ~ N(0, v), v ~ inverse gamma(α, β) common to the sequence.

    The data decide how far from the reference is far; large departures cost their logarithm only.

    Attributes:
        shape: α.
        rate: β.
        reference: As in `GaussianPrior`.
    """

    shape: Scalar
    rate: Scalar
    reference: Reference = 0.0

    def log_density(self, sequence: Float[Array, "time axis"]) -> Float[Array, ""]:
        """With v integrated out: −(α + n/2) log(β + ½ Σ e²)."""
        off = sequence - self.reference
        return -(self.shape + 0.5 * off.size) * jnp.log(self.rate + 0.5 * jnp.sum(off**2))

    def sample(self, key: Array, shape: tuple[int, int]) -> Float[Array, "time axis"]:
        """One sequence."""
        for_scale, for_noise = jax.random.split(key)
        variance = self.rate / jax.random.gamma(for_scale, self.shape)
        return self.reference + jnp.sqrt(variance) * jax.random.normal(for_noise, shape)


class WalkPrior(eqx.Module):
    """Neighbours in time are alike: e_0 ~ N(0, σ²), e_{t+1} − e_t ~ N(0, s²).

    Attributes:
        std: σ, of the first element.
        step_std: s.
        reference: As in `GaussianPrior`.
    """

    std: Scalar
    step_std: Scalar
    reference: Reference = 0.0

    def log_density(self, sequence: Float[Array, "time axis"]) -> Float[Array, ""]:
        """−½ (Σ e_0²/σ² + Σ (e_{t+1} − e_t)²/s²)."""
        off = sequence - self.reference
        return -0.5 * (jnp.sum((off[0] / self.std) ** 2) + jnp.sum((jnp.diff(off, axis=0) / self.step_std) ** 2))

    def sample(self, key: Array, shape: tuple[int, int]) -> Float[Array, "time axis"]:
        """One sequence."""
        noise = jax.random.normal(key, shape)
        scale = jnp.full((shape[0], 1), self.step_std).at[0].set(self.std)
        return self.reference + jnp.cumsum(scale * noise, axis=0)


Prior = GaussianPrior | OffsetPrior | ScalePrior | WalkPrior
