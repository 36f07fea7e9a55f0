"""How wide a kernel between candidates is: after the set itself."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

MOST_PAIRS = 4096
"""So many pairs tell the median to a hundredth of its rank; to sort all of a large set takes most of a step."""


def median_bandwidth(
    squared_distance: Float[jax.Array, "*batch particle particle"], floor: float
) -> Float[jax.Array, ""]:
    """Median over the pairs of ‖x_i − x_j‖²/log(N + 1), at least `floor`, without a gradient.

    Of a large set it is that of `MOST_PAIRS` pairs, evenly chosen. With it the N − 1 others of a typical candidate
    weigh as much in Σ_j k(x_i, x_j) as the candidate itself.

    Args:
        squared_distance: ‖x_i − x_j‖², shape (…, particle, particle).
        floor: Least bandwidth, in the same unit.
    """
    count = squared_distance.shape[-1]
    if count == 1:
        return jnp.asarray(floor, squared_distance.dtype)
    first, second = np.triu_indices(count, k=1)
    if first.size > MOST_PAIRS:
        some = np.linspace(0, first.size - 1, MOST_PAIRS).astype(int)
        first, second = first[some], second[some]
    median = _median(jax.lax.stop_gradient(squared_distance)[..., first, second].reshape(-1))
    return jnp.maximum(median / np.log(count + 1.0), floor).astype(squared_distance.dtype)


def _median(positive: Float[jax.Array, "number"]) -> Float[jax.Array, ""]:
    """The median of numbers that are not negative.

    They are in the order of their bits, and integers are sorted in an eighth of the time that floats take.
    """
    whole = jnp.int64 if positive.dtype == jnp.float64 else jnp.int32
    in_order = jax.lax.sort(jax.lax.bitcast_convert_type(positive, whole), is_stable=False)
    last = positive.size - 1
    middle = in_order[np.array([last // 2, (last + 1) // 2])]
    return jnp.mean(jax.lax.bitcast_convert_type(middle, positive.dtype))
