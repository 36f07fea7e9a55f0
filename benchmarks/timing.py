"""How the benchmarks time: after a warm-up, contenders in turn, medians."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from unittest import mock

import jax
import numpy as np

from planner import solver


def machine() -> str:
    """One line on where this ran."""
    devices = ", ".join(sorted({device.device_kind for device in jax.devices()}))
    return f"{platform.machine()}, {os.cpu_count()} cores, jax {jax.__version__} on {devices}"


def without_baseline() -> AbstractContextManager[object]:
    """Solves in which no lawnmower is fitted for comparison, which costs as much as all the rest of a small problem."""
    return mock.patch.object(solver, "Lawnmowers", **{"return_value.best.return_value": (float("nan"), None)})


def interleaved_ms(
    contenders: Mapping[str, Callable[[], object]],
    repeats: int,
    of_all: Callable[[list[float]], float] = np.median,
    in_a_row: int = 1,
) -> dict[str, float]:
    """Median milliseconds of each contender, run in turn so that a drifting machine treats all alike.

    Args:
        contenders: Name to a call whose result is a jax value (waited for) or anything else.
        repeats: Counted runs each, after one that is not counted.
        of_all: What to take of the runs instead of the median.
        in_a_row: Calls a turn, of which the mean is taken. Where a call takes less than a millisecond, the first after
            another contender's pays for what that one left in caches and memory.
    """
    times: dict[str, list[float]] = {name: [] for name in contenders}
    for call in contenders.values():
        jax.block_until_ready(call())
    for _ in range(repeats):
        for name, call in contenders.items():
            started = time.perf_counter()
            for _ in range(in_a_row):
                jax.block_until_ready(call())
            times[name].append(1e3 * (time.perf_counter() - started) / in_a_row)
    return {name: float(of_all(values)) for name, values in times.items()}
