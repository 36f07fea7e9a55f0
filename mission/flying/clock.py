"""The flight clock: the vehicle's own time, made continuous and readable between two messages.

It runs from zero when the flight begins, at the host's monotonic pace before the vehicle is heard, and then follows
the vehicle: a vehicle that lives faster or slower (a simulator) carries the clock with it. A simulator that runs faster
than real time runs in lock-step and waits for setpoints; so then this clock waits for the simulator too.
"""

from __future__ import annotations

import threading

# How much of a difference to the vehicle is taken over at once: the rest is taken for the jitter of the link.
_FOLLOW = 0.2
# A difference above this many host seconds is no jitter: the vehicle paused, or was restarted.
_JUMP_HOST_S = 1.0
# Faster than real time the clock runs no further ahead of the last message than this (flight seconds), until the
# vehicle has been silent for so long (host seconds) that it can no longer be waiting.
_LEAD_S = 0.1
_SILENT_HOST_S = 1.0
_RATE_WINDOW_HOST_S = 2.0
_RATE_TOLERANCE = 0.2


class FlightClock:
    """Seconds of the flight, from the host's and the vehicle's clocks.

    Args:
        host_s: The host's monotonic clock at zero.
        rate: Vehicle seconds a host second, as far as known beforehand.
    """

    def __init__(self, host_s: float, rate: float = 1.0) -> None:
        self._lock = threading.Lock()
        self._host_s = host_s
        self._flight_s = 0.0
        self._rate = rate
        self._offset_s: float | None = None
        self._last_s = 0.0
        self._window: tuple[float, float] | None = None

    @property
    def rate(self) -> float:
        """Flight seconds a host second."""
        return self._rate

    def now(self, host_s: float) -> float:
        """The flight clock at a moment of the host's; it never runs backwards."""
        with self._lock:
            self._last_s = max(self._last_s, self._read(host_s))
            return self._last_s

    def hear(self, vehicle_s: float, host_s: float) -> None:
        """Follow the vehicle's clock; called as the message comes, whatever else the flight is busy with.

        Args:
            vehicle_s: The vehicle's clock, as a message carried it.
            host_s: When the message came.
        """
        with self._lock:
            if self._offset_s is None:
                self._offset_s = self._read(host_s) - vehicle_s
            error_s = vehicle_s + self._offset_s - self._read(host_s)
            if abs(error_s) > max(1.0, _JUMP_HOST_S * self._rate):
                # The flight's time goes on where it was; only what it is compared with has changed.
                self._offset_s -= error_s
                self._window = None
                error_s = 0.0
            self._flight_s = self._read(host_s) + _FOLLOW * error_s
            self._host_s = host_s
            self._watch_rate(vehicle_s, host_s)

    def of(self, vehicle_s: float) -> float:
        """The flight clock at a moment of the vehicle's clock, which must have been heard before."""
        with self._lock:
            return vehicle_s + (self._offset_s or 0.0)

    def _read(self, host_s: float) -> float:
        elapsed_s = host_s - self._host_s
        if self._offset_s is None or self._rate <= 1.0 + _RATE_TOLERANCE:
            return self._flight_s + elapsed_s * self._rate
        running_on_s = max(0.0, elapsed_s - _SILENT_HOST_S) * self._rate
        return self._flight_s + min(elapsed_s * self._rate, _LEAD_S) + running_on_s

    def _watch_rate(self, vehicle_s: float, host_s: float) -> None:
        """Notice a vehicle whose time runs at another pace than thought."""
        if self._window is None:
            self._window = (vehicle_s, host_s)
            return
        since_vehicle_s, since_host_s = self._window
        elapsed_s = host_s - since_host_s
        if elapsed_s < _RATE_WINDOW_HOST_S:
            return
        measured = (vehicle_s - since_vehicle_s) / elapsed_s
        if abs(measured / self._rate - 1.0) > _RATE_TOLERANCE and measured > 0.0:
            self._rate = measured
        self._window = (vehicle_s, host_s)
