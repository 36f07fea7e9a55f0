"""How an autopilot lands: fast from high up, slowly near the ground."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Descent:
    """A landing.

    Attributes:
        fast_mps: Speed from high up.
        slow_mps: Speed near the ground. By default Copter's (`LAND_SPEED`); PX4's is 0.7 (`MPC_LAND_SPEED`).
        slow_below_m: Height from which on it is slow; 10 m with both.
    """

    fast_mps: float
    slow_mps: float = 0.5
    slow_below_m: float = 10.0

    def to_ground_s(self, height_m: float) -> float:
        """Time to the ground.

        Args:
            height_m: Above the ground; below zero counts as on it.
        """
        slow_m = min(max(height_m, 0.0), self.slow_below_m)
        return max(height_m - slow_m, 0.0) / self.fast_mps + slow_m / min(self.slow_mps, self.fast_mps)
