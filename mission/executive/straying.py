"""How far a vehicle strays from its path at its present pace: what it has shown lately, not what it does right now."""

from __future__ import annotations

from collections import deque

_LASTS_S = 0.5
"""A jump of the estimate passes, lag stays: only what was kept up for so long counts."""
_REMEMBERED_S = 20.0
_GAP_S = 0.4
"""Between observations that far apart the vehicle may have been anywhere."""


class Straying:
    """Remembers distances from the path for a while, and none that belongs to another pace."""

    def __init__(self) -> None:
        self._lately: deque[tuple[float, float]] = deque()
        self._kept_up: deque[tuple[float, float]] = deque()
        self._from_s = float("-inf")

    def begin(self, from_s: float) -> None:
        """Forget everything, and begin anew at a moment of the flight clock."""
        self._lately.clear()
        self._kept_up.clear()
        self._from_s = from_s

    def observe(self, beside_m: float, now_s: float) -> float:
        """Take in another distance.

        Args:
            beside_m: From the path, metres.
            now_s: Flight clock.

        Returns:
            The greatest distance that was kept up for half a second within the last twenty, metres; zero: none was yet.
        """
        if now_s < self._from_s:
            return 0.0
        lately, kept_up = self._lately, self._kept_up
        if lately and now_s - lately[-1][0] > _GAP_S:
            lately.clear()
        lately.append((now_s, beside_m))
        if now_s - lately[0][0] >= _LASTS_S:
            kept_up.append((now_s, min(distance_m for _, distance_m in lately)))
            while now_s - lately[0][0] >= _LASTS_S:
                lately.popleft()
        while kept_up and now_s - kept_up[0][0] > _REMEMBERED_S:
            kept_up.popleft()
        return max((distance_m for _, distance_m in kept_up), default=0.0)
