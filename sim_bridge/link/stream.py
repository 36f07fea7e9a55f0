"""The gate that setpoints pass: only the newest one while it is fresh, and none at all while the gate is closed.

mavsdk repeats the last setpoint at 20 Hz for as long as nobody gives it another: were whoever makes them stuck, a
vehicle would be sent on with a velocity that was right a while ago. So what is repeated too long leaves as a hold at
its place, and after some seconds not at all: a silent stream is the vehicle's signal to look after itself.
"""

from __future__ import annotations

import itertools
import math
import struct
import threading
import time
from collections.abc import Callable

from sim_bridge.codec import mavlink
from sim_bridge.state import Vector

FRESH_S = 0.5
"""Host seconds for which a setpoint may be repeated as it is."""
HELD_S = 5.0
"""Host seconds after which it is not repeated any more."""

_MOST_TIMES = 2_000_000
_SETPOINTS = (
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
)
# SET_POSITION_TARGET_LOCAL_NED in a MAVLink 2 frame: the header, the time, then position, velocity, acceleration, yaw
# and its rate as floats.
_HEADER_BYTES = 10
_POSITION = slice(_HEADER_BYTES + 4, _HEADER_BYTES + 16)
_MOVING = slice(_HEADER_BYTES + 16, _HEADER_BYTES + 40)
_TURNING = slice(_HEADER_BYTES + 44, _HEADER_BYTES + 48)


class StreamGate:
    """Lets everything out, and setpoints while it is open.

    Args:
        send: Puts a frame on the wire.
        now: This machine's monotonic clock.
    """

    def __init__(self, send: Callable[[bytes], None], now: Callable[[], float] = time.monotonic) -> None:
        self._send = send
        self._now = now
        self._lock = threading.Lock()
        self._open = False
        self._newest: tuple[bytes, float] | None = None
        self._is_news = False
        self._times_s: list[float] = []

    def open(self) -> None:
        """Let setpoints out, from the next new one on."""
        with self._lock:
            self._newest = None
            self._open = True

    def close(self) -> None:
        """Let no setpoint out any more, at once."""
        self._open = False
        with self._lock:
            self._times_s.append(math.nan)

    def expect(self, position_ned_m: Vector) -> None:
        """A new setpoint is on its way, to this position in the vehicle's frame; older ones do not pass any more."""
        with self._lock:
            self._newest = struct.pack("<3f", *position_ned_m), self._now()
            self._is_news = True

    def send(self, frame: bytes) -> None:
        """Let a MAVLink 2 frame out, if it may."""
        with self._lock:
            if int.from_bytes(frame[7:10], "little") in _SETPOINTS:
                frame = self._passing(frame)
            if frame:
                self._send(frame)

    def _passing(self, frame: bytes) -> bytes:
        """A setpoint as it may leave; empty: it may not."""
        if not self._open or self._newest is None or frame[_POSITION] != self._newest[0]:
            return b""
        now_s = self._now()
        age_s = now_s - self._newest[1]
        if self._is_news and len(self._times_s) < _MOST_TIMES:
            self._times_s.append(now_s)
        self._is_news = False
        if age_s > HELD_S:
            return b""
        return frame if age_s <= FRESH_S else held(frame)

    def gaps_s(self) -> list[float]:
        """Times between new setpoints on the wire, within each uninterrupted stream; repetitions are none."""
        pairs = itertools.pairwise(self._times_s)
        return [after - before for before, after in pairs if not math.isnan(after - before)]


def held(frame: bytes) -> bytes:
    """A setpoint in the local frame, standing at its place: without velocity, acceleration and turning."""
    standing = bytearray(frame[: _HEADER_BYTES + frame[1]])
    for part in (_MOVING, _TURNING):
        standing[part] = bytes(part.stop - part.start)
    checksum = mavlink.x25crc(standing[1:])
    checksum.accumulate(bytes([mavlink.mavlink_map[int.from_bytes(frame[7:10], "little")].crc_extra]))
    return bytes(standing) + checksum.crc.to_bytes(2, "little")
