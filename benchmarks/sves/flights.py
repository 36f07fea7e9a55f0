"""Closed loops of `planner.control` for the figures that fly."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from planner import control
from planner.control import ControlInfo, ControlTask
from planner.information import DensityGrid
from planner.problem import MetricWeights
from planner.spectral_metric import mean_basis, mode_weights
from planner.workspace import Workspace


@dataclasses.dataclass(frozen=True)
class Flight:
    """What was flown.

    Attributes:
        positions_m: Shape (moment, 3).
        infos: Of every control step.
    """

    positions_m: np.ndarray
    infos: list[ControlInfo]

    @property
    def safe_share(self) -> float:
        """Share of the steps whose selected horizon was wholly clear."""
        return float(np.mean([bool(info.safe) for info in self.infos]))


def fly(
    task_at: Callable[[int], ControlTask],
    start: list[float],
    steps: int,
    candidates: int,
    horizon: int,
    seed: int,
    remembers: bool = True,
) -> Flight:
    """Fly a receding horizon.

    Args:
        task_at: The task at each step.
        start: The vehicle's first state.
        steps: How many controls are applied.
        candidates: N.
        horizon: Controls of each candidate.
        seed: Of the random numbers.
        remembers: Whether what was covered is kept.
    """
    key = jax.random.key(seed)
    state = control.init(task_at(0), key, candidates, horizon)
    vehicle = jnp.asarray(start, jnp.float32)
    positions, infos = [np.asarray(vehicle)[:3]], []
    for index in range(steps):
        task = task_at(index)
        state, info = control.step(task, state, vehicle, jax.random.fold_in(key, index))
        if not remembers:
            state = dataclasses.replace(
                state, basis_sum=jnp.zeros_like(state.basis_sum), moments=jnp.ones((), jnp.int32)
            )
        vehicle = task.dynamics.step(vehicle, info.control, task.control_s)
        positions.append(np.asarray(vehicle)[:3])
        infos.append(info)
    return Flight(np.array(positions), infos)


def ergodic_metric(
    positions_m: np.ndarray, information: DensityGrid, modes: tuple[int, int, int], box: Workspace
) -> float:
    """E (linear weights) of equally long moments."""
    mean = mean_basis(box.unit_from_enu(positions_m), np.full(len(positions_m), 1.0 / len(positions_m)), modes)
    weights = mode_weights(modes, MetricWeights.LINEAR)
    return float(np.sum(weights * (mean - information.coefficients(modes)) ** 2))
