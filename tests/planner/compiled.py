"""Metrics as one compiled program each: called as they are, each of their hundred operations is compiled by itself."""

import equinox as eqx
import jax
from jaxtyping import Array, Float


@eqx.filter_jit
def value_of(
    metric: eqx.Module, points: Float[Array, "time axis"], time_weight: Float[Array, "time"]
) -> Float[Array, ""]:
    """E of one path."""
    return metric(points, time_weight)


@eqx.filter_jit
def value_and_slope_of(
    metric: eqx.Module, points: Float[Array, "time axis"], time_weight: Float[Array, "time"]
) -> tuple[Float[Array, ""], Float[Array, "time axis"]]:
    """E of one path, and its gradient in the positions."""
    return jax.value_and_grad(lambda x: metric(x, time_weight))(points)
