"""Random paths: a line with a random sine series on it, folded into the box."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from planner.problem import Problem

POINTS = 400
MOST_WAVES = 40
SPREAD = 0.35


def wander(
    problem: Problem, end_m: Float[np.ndarray, "3"], waves: int, amplitude: Float[np.ndarray, "wave 3"]
) -> Float[np.ndarray, "point 3"]:
    """From the start to an end with waves of random size on the way.

    Args:
        problem: Start and box.
        end_m: Where it ends.
        waves: How many of the series' terms are used: more make it longer.
        amplitude: Standard normal numbers, one a term and axis.
    """
    workspace = problem.workspace
    s = np.linspace(0.0, 1.0, POINTS)[:, None]
    first, last = workspace.unit_from_enu(problem.start.position_m), workspace.unit_from_enu(end_m)
    k = np.arange(1, waves + 1)
    # The variance is shared by all terms, so more waves mean a longer path and not a wider one.
    series = np.sin(np.pi * k * s) @ (amplitude[:waves] * SPREAD / np.sqrt(waves / 2.0))
    unit = first + (last - first) * s + series
    # What leaves the box is mirrored at its walls.
    folded = 1.0 - np.abs((unit % 2.0) - 1.0)
    return workspace.enu_from_unit(folded)
