"""What the autopilot believes about its place, as far as it differs from the truth.

The estimate wanders slowly around the truth, may be dragged away by a glitch, may jump, and drifts once GPS is gone
until it is no longer called valid. The vehicle is flown on the estimate: where that is wrong, so is the flight.
"""

from __future__ import annotations

import math
import random

from sim_bridge.state import Vector

# Slow, smooth, bounded and never repeating for hours: a sum of incommensurable sines on each axis.
_PERIODS_S = (31.0, 53.0, 89.0)
_VERTICAL_SHARE = 0.4
_DRIFT_MPS = 0.4
_RECOVERY_S = 2.0


class Estimator:
    """Offset of the estimated from the true position.

    Args:
        wander_m: Largest horizontal wandering of the estimate.
        dead_reckoning_s: How long the position stays valid without GPS.
        seed: Of the wandering and the drift.
    """

    def __init__(self, wander_m: float, dead_reckoning_s: float, seed: int = 0) -> None:
        chance = random.Random(seed)
        self._waves = [[(period_s, chance.uniform(0.0, 2.0 * math.pi)) for period_s in _PERIODS_S] for _ in range(3)]
        share = wander_m / (math.sqrt(2.0) * len(_PERIODS_S))
        self._amplitudes_m = (share, share, _VERTICAL_SHARE * share)
        heading = chance.uniform(0.0, 2.0 * math.pi)
        self._drift_ned_mps = (_DRIFT_MPS * math.cos(heading), _DRIFT_MPS * math.sin(heading), 0.0)
        self._dead_reckoning_s = dead_reckoning_s
        self._moved_m = (0.0, 0.0, 0.0)
        self._jumped_m = (0.0, 0.0, 0.0)
        self._lost_s: float | None = None
        self._regained_s = -math.inf
        self.offset_ned_m: Vector = (0.0, 0.0, 0.0)
        self.gps_glitch_ned_m: Vector = (0.0, 0.0, 0.0)
        """What a lying GPS adds; the estimate follows it within seconds."""
        self.resets = 0
        """How often the estimate jumped on purpose (a counter that some messages carry)."""

    @property
    def has_gps(self) -> bool:
        """Whether GPS gives positions."""
        return self._lost_s is None

    def lose_gps(self, now_s: float) -> None:
        """GPS gives no positions from now on."""
        if self._lost_s is None:
            self._lost_s = now_s

    def regain_gps(self, now_s: float) -> None:
        """GPS gives positions again: the estimate is set to them."""
        if self._lost_s is not None:
            if not self.valid(now_s):
                self._regained_s = now_s
            self._lost_s = None
            self._moved_m = self._settled_m
            self.resets += 1

    def jump(self, by_ned_m: Vector) -> None:
        """The estimate is suddenly elsewhere, and stays there."""
        self._moved_m = _sum(self._moved_m, by_ned_m)
        self._jumped_m = _sum(self._jumped_m, by_ned_m)
        self.resets += 1

    def valid(self, now_s: float) -> bool:
        """Whether the autopilot trusts its position."""
        if self._lost_s is not None:
            return now_s - self._lost_s <= self._dead_reckoning_s
        return now_s - self._regained_s >= _RECOVERY_S

    def advance(self, now_s: float, dt_s: float) -> None:
        """Let the estimate move on."""
        if self._lost_s is not None:
            self._moved_m = _sum(self._moved_m, self._drift_ned_mps, dt_s)
        elif self._moved_m != self._settled_m:
            share = min(1.0, dt_s / _RECOVERY_S)
            x, y, z = self._moved_m
            sx, sy, sz = self._settled_m
            self._moved_m = (x + share * (sx - x), y + share * (sy - y), z + share * (sz - z))
        self.offset_ned_m = _sum(self._wander(now_s), self._moved_m)

    @property
    def _settled_m(self) -> Vector:
        """Where GPS, as it is, takes the estimate in the end."""
        return _sum(self.gps_glitch_ned_m, self._jumped_m)

    def _wander(self, now_s: float) -> Vector:
        x, y, z = (
            amplitude_m * sum(math.sin(2.0 * math.pi * now_s / period_s + phase) for period_s, phase in row)
            for amplitude_m, row in zip(self._amplitudes_m, self._waves, strict=True)
        )
        return x, y, z


def _sum(a: Vector, b: Vector, scale: float = 1.0) -> Vector:
    return a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]
