"""What is known while flying: the information, the obstacles, and what was covered.

Coverage is remembered as the metric remembers it: the time average of the basis functions over the flown positions,
as telemetry told them, and the time it stands for.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from planner.problem import Covered, Problem
from planner.spectral_metric import mean_basis
from planner.trajectory import Motion
from sim_bridge.state import Vector

_INTERVAL_S = 0.1


def covered_by(
    position_m: Float[np.ndarray, "time 3"], duration_s: float, problem: Problem, modes: tuple[int, int, int]
) -> Covered:
    """What equally long moments at some positions cover."""
    unit = np.clip(problem.workspace.unit_from_enu(position_m), 0.0, 1.0)
    return Covered(mean_basis(unit, np.full(len(unit), 1.0 / len(unit)), modes), duration_s)


def together(first: Covered | None, second: Covered | None) -> Covered | None:
    """Both, as one average over the whole time."""
    if first is None or second is None:
        return first if second is None else second
    total_s = first.duration_s + second.duration_s
    if total_s <= 0.0:
        return None
    share = first.duration_s / total_s
    return Covered(share * first.mean_basis + (1.0 - share) * second.mean_basis, total_s)


class Belief:
    """What is known now.

    Args:
        problem: The mission as it was planned; its `covered` is what earlier flights covered.
        modes: Basis functions per axis.
    """

    def __init__(self, problem: Problem, modes: tuple[int, int, int]) -> None:
        self.problem = problem
        self._modes = modes
        self._covered = problem.covered
        self._positions: list[Vector] = []
        self._flown: list[Vector] = []
        self._last_s: float | None = None

    def fly(self, position_m: Vector, time_s: float) -> None:
        """Count a position of the exploration.

        Args:
            position_m: As telemetry tells it.
            time_s: Flight clock.
        """
        if self._last_s is None or time_s - self._last_s > 10.0 * _INTERVAL_S:
            # The exploration begins, or goes on after an interruption that covered nothing.
            self._last_s = time_s
        while time_s - self._last_s >= _INTERVAL_S:
            self._positions.append(position_m)
            self._last_s += _INTERVAL_S

    def covered(self) -> Covered | None:
        """Everything covered so far; None: nothing."""
        if self._positions:
            flown = covered_by(
                np.asarray(self._positions), len(self._positions) * _INTERVAL_S, self.problem, self._modes
            )
            self._covered = together(self._covered, flown)
            self._flown += self._positions
            self._positions.clear()
        return self._covered

    def flown_m(self) -> Float[np.ndarray, "time 3"]:
        """Every position of the exploration so far."""
        return np.array(self._flown + self._positions, dtype=float).reshape(-1, 3)

    def learn(self, problem: Problem) -> None:
        """Take over information and obstacles of a mission that new data was merged into."""
        self.problem = dataclasses.replace(
            self.problem, information=problem.information, obstacles=problem.obstacles, search=problem.search
        )

    def remaining(
        self, start: Motion, duration_s: float, ahead_m: Float[np.ndarray, "time 3"], ahead_s: float
    ) -> Problem:
        """The problem of what is left.

        Args:
            start: Motion at which the new plan takes over.
            duration_s: Time left from there.
            ahead_m: Positions that will be flown until then.
            ahead_s: Time until then.
        """
        search = self.problem.search
        if search is not None:
            effort = search.effort(
                np.concatenate([self.flown_m(), ahead_m]), self.problem.limits.max_speed_mps * duration_s
            )
            # What was searched is in the effort already: remembering it as covered too would count it twice.
            return dataclasses.replace(
                self.problem, start=start, duration_s=duration_s, information=effort, covered=None
            )
        ahead = covered_by(ahead_m, ahead_s, self.problem, self._modes) if len(ahead_m) and ahead_s > 0.0 else None
        return dataclasses.replace(
            self.problem, start=start, duration_s=duration_s, covered=together(self.covered(), ahead)
        )
