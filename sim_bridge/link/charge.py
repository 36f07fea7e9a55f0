"""What a vehicle tells about its charge: the least of its batteries, and how long ago."""

from __future__ import annotations

from sim_bridge.codec import mavlink

_PAYLOAD = mavlink.MAV_BATTERY_FUNCTION_PAYLOAD
_WHOLE = -1
"""SYS_STATUS tells of no battery in particular."""


class Charge:
    """Remembers the last that was told of each battery: one that falls silent is not fuller for it."""

    def __init__(self) -> None:
        self._told: dict[int, tuple[float, float]] = {}

    def status(self, message: mavlink.MAVLink_sys_status_message, time_s: float) -> None:
        """Take in what the vehicle tells of itself."""
        self._take(_WHOLE, message.battery_remaining, time_s)

    def battery(self, message: mavlink.MAVLink_battery_status_message, time_s: float) -> None:
        """Take in what it tells of one battery; what feeds nothing but the payload does not matter."""
        if message.battery_function != _PAYLOAD:
            self._take(message.id, message.battery_remaining, time_s)

    def restart(self, time_s: float) -> None:
        """The vehicle's clock begins anew."""
        self._told = {battery: (fraction, time_s) for battery, (fraction, _) in self._told.items()}

    @property
    def fraction(self) -> float | None:
        """The charge of the emptiest battery, 0 … 1; None: never told."""
        return min((fraction for fraction, _ in self._told.values()), default=None)

    def age_s(self, time_s: float) -> float:
        """How long ago that was told of which nothing was heard for longest; never told: zero."""
        return max((time_s - told_s for _, told_s in self._told.values()), default=0.0)

    def _take(self, battery: int, percent: int, time_s: float) -> None:
        # −1 is a battery that does not know its charge.
        if 0 <= percent <= 100:
            self._told[battery] = (percent / 100.0, time_s)
