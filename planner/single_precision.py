"""From the host's double precision to the single precision of what is compiled."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import ArrayLike


def single(value: ArrayLike) -> Float[Array, "..."]:
    """The same numbers in single precision.

    They are converted on the host: JAX would compile a program for each shape that it converts.
    """
    return jnp.asarray(np.asarray(value, dtype=np.float32))
