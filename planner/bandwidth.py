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
    median = jnp.median(jax.lax.stop_gradient(squared_distance)[..., first, second])
    return jnp.maximum(median / np.log(count + 1.0), floor).astype(squared_distance.dtype)
