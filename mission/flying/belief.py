"""What is known while flying: the information, the obstacles, and where the vehicle has been.

Coverage is remembered as the metric remembers it: the time average of the basis functions over the flown positions,
as telemetry told them, and the time it stands for; for a metric without a basis the places themselves, and the poses
where headings are explored. A search instead works out what was not seen yet, from places alone.
"""

from __future__ import annotations

import dataclasses
import math
import threading
from typing import Any

import numpy as np
from jaxtyping import Float

from planner.polyline import length_of
from planner.problem import Covered, Problem
from planner.spectral_metric import mean_basis
from sim_bridge.state import Vector

INTERVAL_S = 0.1
"""Time that each remembered position stands for."""


class Belief:
    """What is known now.

    Args:
        problem: The mission as it was planned; its `covered` is what earlier flights covered.
        flown_m: Positions of the exploration in earlier flights, one each `INTERVAL_S`.
        flown_yaw_rad: Headings there; None: not known.
    """

    def __init__(
        self,
        problem: Problem,
        flown_m: Float[np.ndarray, "time 3"] | None = None,
        flown_yaw_rad: Float[np.ndarray, "time"] | None = None,
    ) -> None:
        self.problem = problem
        self._changing = threading.Lock()
        self._flown: list[Vector] = [] if flown_m is None else [tuple(place) for place in flown_m.tolist()]
        self._yaw_rad = [math.nan] * len(self._flown) if flown_yaw_rad is None else flown_yaw_rad.tolist()
        self._last_s: float | None = None

    def change(self, **changes: Any) -> None:
        """Know something else about the problem from now on: what others change meanwhile is kept.

        Args:
            changes: Attributes of `Problem` with their new values.
        """
        with self._changing:
            self.problem = dataclasses.replace(self.problem, **changes)

    def fly(self, position_m: Vector, time_s: float, yaw_rad: float = math.nan) -> None:
        """Count a position of the exploration.

        Args:
            position_m: As telemetry tells it.
            time_s: Flight clock.
            yaw_rad: Heading, as telemetry tells it; NaN: not known.
        """
        if self._last_s is None or time_s - self._last_s > 10.0 * INTERVAL_S:
            # The exploration begins, or goes on after an interruption that covered nothing.
            self._last_s = time_s
        while time_s - self._last_s >= INTERVAL_S:
            self._flown.append(position_m)
            self._yaw_rad.append(yaw_rad)
            self._last_s += INTERVAL_S

    def flown_m(self) -> Float[np.ndarray, "time 3"]:
        """Every position of the exploration so far, one each `INTERVAL_S`."""
        return np.array(self._flown, dtype=float).reshape(-1, 3)

    def flown_yaw_rad(self) -> Float[np.ndarray, "time"]:
        """The heading at each of those positions; NaN where it is not known."""
        return np.array(self._yaw_rad, dtype=float)


def with_length_left(problem: Problem, flown_m: Float[np.ndarray, "time 3"]) -> Problem | None:
    """The problem with as much of its length as was not flown; None: nothing of it is left.

    Args:
        problem: What is left but for its `max_length_m`, which is that of the whole exploration.
        flown_m: Every position that was flown, and those on the way to where it starts.
    """
    left_m = problem.max_length_m - length_of(np.concatenate([flown_m, problem.start.position_m[None]]))
    return dataclasses.replace(problem, max_length_m=left_m) if left_m > 0.0 else None


def covered_by(
    position_m: Float[np.ndarray, "time 3"],
    duration_s: float,
    problem: Problem,
    modes: tuple[int, int, int],
    yaw_rad: Float[np.ndarray, "time"] | None = None,
) -> Covered:
    """What equally long moments at some positions cover; of poses those whose heading is known."""
    unit = np.clip(problem.workspace.unit_from_enu(position_m), 0.0, 1.0)
    poses = None if yaw_rad is None else np.column_stack([unit, yaw_rad])[np.isfinite(yaw_rad)]
    return Covered(mean_basis(unit, np.full(len(unit), 1.0 / len(unit)), modes), duration_s, poses, unit)


def together(first: Covered | None, second: Covered | None) -> Covered | None:
    """Both, as one average over the whole time."""
    if first is None or second is None:
        return first if second is None else second
    total_s = first.duration_s + second.duration_s
    if total_s <= 0.0:
        return None
    share = first.duration_s / total_s
    mean = share * first.mean_basis + (1.0 - share) * second.mean_basis
    # Each place and each pose stands for `INTERVAL_S` in both.
    poses, places = _joined(first.poses, second.poses), _joined(first.places, second.places)
    return Covered(mean, total_s, poses, places)


def _joined(first: np.ndarray | None, second: np.ndarray | None) -> np.ndarray | None:
    return None if first is None or second is None else np.concatenate([first, second])


def after(
    problem: Problem,
    flown_m: Float[np.ndarray, "time 3"],
    modes: tuple[int, int, int],
    yaw_rad: Float[np.ndarray, "time"] | None = None,
) -> Problem:
    """The problem once some positions have been flown; takes a while, so not in the flight's loop.

    Args:
        problem: What is left: its start and duration; its information and memory are from before.
        flown_m: Positions flown since, one each `INTERVAL_S`.
        modes: Basis functions per axis.
        yaw_rad: Headings there, which a metric of poses remembers; None: not known.
    """
    if not len(flown_m):
        return problem
    if problem.search is not None:
        left = problem.search.after(flown_m)
        # What was searched is in the effort already: remembering it as covered too would count it twice.
        return dataclasses.replace(problem, information=left.effort(problem.reach_m), search=left, covered=None)
    covered = covered_by(flown_m, len(flown_m) * INTERVAL_S, problem, modes, yaw_rad)
    return dataclasses.replace(problem, covered=together(problem.covered, covered))
