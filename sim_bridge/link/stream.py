"""The gate that setpoints pass: only numbers, only the newest while it is fresh, and none at all while it is closed.

mavsdk repeats the last setpoint at 20 Hz for as long as nobody gives it another: were whoever makes them stuck, a
vehicle would be sent on with a velocity that was right a while ago. So what is repeated too long leaves as a hold at
its place, and after some seconds not at all: a silent stream is the vehicle's signal to look after itself.
"""

from __future__ import annotations

import collections
import dataclasses
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
_MOST_ON_THEIR_WAY = 1000
_SETPOINTS = (
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
)
# SET_POSITION_TARGET_LOCAL_NED in a MAVLink 2 frame: the header, the time, then position, velocity, acceleration, yaw
# and its rate as floats.
# In the local frame: nobody here makes others, so none are let out.
_HEADER_BYTES = 10
_POSITION = slice(_HEADER_BYTES + 4, _HEADER_BYTES + 16)
_MOVING = slice(_HEADER_BYTES + 16, _HEADER_BYTES + 40)
_TURNING = slice(_HEADER_BYTES + 44, _HEADER_BYTES + 48)
_FLOATS = slice(_POSITION.start, _TURNING.stop)


@dataclasses.dataclass
class _Expected:
    """A setpoint that may leave: its position as it is sent, when it was set, whether it has left once."""

    position: bytes
    set_s: float
    has_left: bool = False


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
        # What may leave, oldest first: the one that left last, and those on their way.
        self._expected: collections.deque[_Expected] = collections.deque(maxlen=_MOST_ON_THEIR_WAY)
        self._times_s: list[float] = []

    def open(self) -> None:
        """Let setpoints out, from the next new one on."""
        with self._lock:
            self._expected.clear()
            self._open = True

    def close(self) -> None:
        """Let no setpoint out any more, at once."""
        self._open = False
        with self._lock:
            self._times_s.append(math.nan)

    def expect(self, position_ned_m: Vector) -> None:
        """A new setpoint is on its way, to this position in the vehicle's frame; once it left, no older one does."""
        new = _Expected(struct.pack("<3f", *position_ned_m), self._now())
        with self._lock:
            if self._expected and self._expected[-1].position == new.position:
                self._expected.pop()
            self._expected.append(new)

    def send(self, frame: bytes) -> None:
        """Let a MAVLink 2 frame out, if it may."""
        with self._lock:
            if int.from_bytes(frame[7:10], "little") in _SETPOINTS:
                frame = self._passing(frame)
            if frame:
                self._send(frame)

    def _passing(self, frame: bytes) -> bytes:
        """A setpoint as it may leave; empty: it may not."""
        position = frame[_POSITION]
        if not self._open or not _finite(frame) or all(one.position != position for one in self._expected):
            return b""
        while self._expected[0].position != position:
            self._expected.popleft()
        setpoint, now_s = self._expected[0], self._now()
        if not setpoint.has_left and len(self._times_s) < _MOST_TIMES:
            self._times_s.append(now_s)
        setpoint.has_left = True
        age_s = now_s - setpoint.set_s
        if age_s > HELD_S:
            return b""
        return frame if age_s <= FRESH_S else held(frame)

    def gaps_s(self) -> list[float]:
        """Times between new setpoints on the wire, within each uninterrupted stream; repetitions are none."""
        pairs = itertools.pairwise(self._times_s)
        return [after - before for before, after in pairs if not math.isnan(after - before)]


def _finite(frame: bytes) -> bool:
    """Whether every float of a setpoint in the local frame is a number."""
    return all(math.isfinite(number) for (number,) in struct.iter_unpack("<f", frame[_FLOATS]))


def held(frame: bytes) -> bytes:
    """A setpoint in the local frame, standing at its place: without velocity, acceleration and turning."""
    standing = bytearray(frame[: _HEADER_BYTES + frame[1]])
    for part in (_MOVING, _TURNING):
        standing[part] = bytes(part.stop - part.start)
    checksum = mavlink.x25crc(standing[1:])
    checksum.accumulate(bytes([mavlink.mavlink_map[int.from_bytes(frame[7:10], "little")].crc_extra]))
    return bytes(standing) + checksum.crc.to_bytes(2, "little")
