"""Reading the vehicle's parameters: those that must be known, and those that are as from the factory if not told."""

from __future__ import annotations

import math
from collections.abc import Callable

from mission.flying import left_alone

Parameter = Callable[[str], float | None]
"""Reads one of the vehicle's parameters; None: it has none of that name, or did not answer."""


class Needed:
    """Parameters that must be known.

    Args:
        parameter: Reads one.
    """

    def __init__(self, parameter: Parameter) -> None:
        self._parameter = parameter
        self.unknown: list[str] = []

    def __call__(self, name: str) -> float | None:
        """One of them; None: it was not told, which is kept in `unknown`."""
        value = self._parameter(name)
        if value is None or not math.isfinite(value):
            self.unknown.append(
                f"{name} was not told: it decides what the vehicle does alone; check the link, try again"
            )
            return None
        return value

    def unsafe(self, *actions: left_alone.Action) -> list[str]:
        """What must not be chosen of what must be known."""
        return [problem for action in actions if (problem := action.problem(self(action.name)))]


class Usual:
    """Parameters of which a guess is better than nothing.

    Args:
        parameter: Reads one.
    """

    def __init__(self, parameter: Parameter) -> None:
        self._parameter = parameter

    def __call__(self, name: str, usual: float) -> float:
        """What the vehicle tells, or what is usual where it tells nothing that makes sense."""
        value = self._parameter(name)
        return usual if value is None or not math.isfinite(value) or value < 0.0 else float(value)

    def positive(self, name: str, usual: float) -> float:
        """The same where zero means nothing, as of a speed."""
        return self(name, usual) or usual
