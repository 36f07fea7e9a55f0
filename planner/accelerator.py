"""What is written in one way for a processor and in another for a GPU.

A processor's time goes into arithmetic, and its compiler fuses loops even where that ends vector code or computes them
again for every reader. A GPU's goes into the number of kernels that are launched one after the other, whatever is in
them: a step of a small set is as fast there as it has few of them.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import jax

BODIES_A_KERNEL = 8
"""So many bodies are looked at in one kernel of a GPU: more take minutes to compile."""
ROUNDED = jax.lax.Precision.DEFAULT
"""Of a product of matrices whose factors a GPU may round: with weights between candidates eleven bits are plenty, and
among a thousand of them the products are most of a step."""

Values = TypeVar("Values")
Arguments = ParamSpec("Arguments")
Found = TypeVar("Found")


def on_a_processor() -> bool:
    """Whether what is traced now runs on the host's cores."""
    return jax.default_backend() == "cpu"


def cores() -> int:
    """How many of the host's cores this process may use; one where the work is done by a GPU."""
    if not on_a_processor():
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def unfused(values: Values) -> Values:
    """The same values, on a processor made before anything that takes them."""
    return jax.lax.optimization_barrier(values) if on_a_processor() else values


def with_exact_products(function: Callable[Arguments, Found]) -> Callable[Arguments, Found]:
    """The same function with products of matrices in single precision, for what is compiled whole.

    A GPU would round what it multiplies to eleven bits, which is as much as a polished path still differs from its
    target.
    """

    @functools.wraps(function)
    def traced(*arguments: Arguments.args, **named: Arguments.kwargs) -> Found:
        with jax.default_matmul_precision("highest"):
            return function(*arguments, **named)

    return traced
