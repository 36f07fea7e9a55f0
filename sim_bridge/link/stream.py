"""The gate that setpoints pass: closed, not one gets out, whatever thread still repeats it."""

from __future__ import annotations

import itertools
import math
import struct
import threading
import time
from collections.abc import Callable

from pymavlink.dialects.v20 import common as mavlink

_MOST_TIMES = 2_000_000
_SETPOINTS = (
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
)
# Where the floats of a setpoint begin in its payload: behind the sender's clock, and behind latitude and longitude.
_FLOATS_BEGIN: dict[int, int] = dict(zip(_SETPOINTS, (4, 12), strict=True))
_FLOATS_END = 48
_HEADER_BYTES = 10


class StreamGate:
    """Lets everything out, and setpoints while it is open.

    Args:
        send: Puts a frame on the wire.
    """

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send = send
        self._lock = threading.Lock()
        self._open = False
        self._times_s: list[float] = []

    def open(self) -> None:
        """Let setpoints out."""
        self._open = True

    def close(self) -> None:
        """Let no setpoint out any more, at once."""
        with self._lock:
            if self._open:
                self._times_s.append(math.nan)
            self._open = False

    def send(self, frame: bytes) -> None:
        """Let a MAVLink 2 frame out, if it may; a setpoint that is not all numbers never may."""
        message_id = int.from_bytes(frame[7:10], "little")
        with self._lock:
            if message_id in _SETPOINTS:
                if not self._open or not _finite(frame, message_id):
                    return
                if len(self._times_s) < _MOST_TIMES:
                    self._times_s.append(time.monotonic())
            self._send(frame)

    def gaps_s(self) -> list[float]:
        """Times between setpoints on the wire, within each uninterrupted stream."""
        pairs = itertools.pairwise(self._times_s)
        return [after - before for before, after in pairs if not math.isnan(after - before)]


def _finite(frame: bytes, message_id: int) -> bool:
    """Whether every float of a setpoint is a number; zeros at the end of a payload are not sent."""
    payload = frame[_HEADER_BYTES : _HEADER_BYTES + frame[1]].ljust(_FLOATS_END, b"\0")
    floats = payload[_FLOATS_BEGIN[message_id] : _FLOATS_END]
    return all(math.isfinite(number) for (number,) in struct.iter_unpack("<f", floats))
