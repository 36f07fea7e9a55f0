"""Which candidate to fly: the likelihood heuristic, among those that passed the gate.

SVES selects argmax_i exp(−λL(x_i)). The exponential underflows in single precision near λL = 88, so this is the argmin
of L, with everything refused or not finite at +∞.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.plan import Candidate


def select(candidates: Sequence[Candidate]) -> int | None:
    """Index of the most likely candidate that passed the gate; None where none did."""
    costs = np.array([c.cost if c.feasible and np.isfinite(c.cost) else np.inf for c in candidates])
    return int(np.argmin(costs)) if np.isfinite(costs).any() else None
