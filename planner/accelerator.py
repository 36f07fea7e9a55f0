"""What is written in one way for a processor and in another for a GPU.

A processor's time goes into arithmetic, and its compiler fuses loops even where that ends vector code or computes them
again for every reader. A GPU's goes into the number of kernels that are launched one after the other, whatever is in
them: a step of a small set is as fast there as it has few of them.
"""

from __future__ import annotations

from typing import TypeVar

import jax

BODIES_A_KERNEL = 8
"""So many bodies are looked at in one kernel of a GPU."""

Values = TypeVar("Values")


def on_a_processor() -> bool:
    """Whether what is traced now runs on the host's cores."""
    return jax.default_backend() == "cpu"


def unfused(values: Values) -> Values:
    """The same values, on a processor made before anything that takes them."""
    return jax.lax.optimization_barrier(values) if on_a_processor() else values
