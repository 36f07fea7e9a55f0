"""An autopilot's own time: seconds since its boot, which is what everything it tells is stamped with."""

from __future__ import annotations


class BootClock:
    """Set from the world's clock, and started anew by every boot."""

    def __init__(self) -> None:
        self._boot_s = 0.0
        self.now_s = 0.0

    @property
    def world_s(self) -> float:
        """The world's clock at the moment that was set."""
        return self._boot_s + self.now_s

    def boot(self, world_s: float) -> None:
        """Start anew at a moment of the world's clock, which may lie ahead."""
        self._boot_s, self.now_s = world_s, 0.0

    def set(self, world_s: float) -> bool:
        """Set the clock; whether the autopilot runs."""
        self.now_s = world_s - self._boot_s
        return self.now_s >= 0.0
