"""Slopes by central differences, to hold derivatives against."""

from collections.abc import Callable

import jax
import numpy as np

STEP = 1e-6


def numeric_gradient(function: Callable[[jax.Array], jax.Array], at: jax.Array) -> np.ndarray:
    """The gradient of a number by every entry of an array, flat; in double precision."""
    shifts = STEP * np.eye(at.size).reshape(at.size, *at.shape)
    values = jax.jit(jax.vmap(function))
    return np.asarray((values(at + shifts) - values(at - shifts)) / (2.0 * STEP))
