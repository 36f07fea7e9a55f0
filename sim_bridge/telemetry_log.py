"""Telemetry logs: every frame heard and sent, as ground stations write and read them; signing keys are left out.

A `.tlog` is frame after frame, each behind the moment it passed: microseconds since 1970, eight bytes, big-endian.
"""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from sim_bridge.codec import frames, mavlink, message_id

MOST_BYTES = 2**30
"""Two days of one vehicle that is flown by setpoints at 50 Hz."""

_HOLDS_A_KEY = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
_STAMP = struct.Struct(">Q")


class TelemetryLog:
    """A log being written; closed by `close` or at the end of a `with`.

    A log that cannot be written any more ends early: what it records goes on.

    Args:
        path: Of the file; an older one is replaced.
        began_unix_s: What a vehicle's second 0 is, in Unix time.
        tell: Told once why a log ended early.
        most_bytes: How large it may grow.

    Raises:
        OSError: The file cannot be opened.
    """

    def __init__(
        self, path: Path, began_unix_s: float, tell: Callable[[str], None], most_bytes: int = MOST_BYTES
    ) -> None:
        self._path = path
        self._file = path.open("wb")
        self._began_us = round(began_unix_s * 1e6)
        self._tell = tell
        self._left_bytes = most_bytes
        self._ended = False

    def write(self, now_s: float, datagram: bytes) -> None:
        """Keep the frames of a datagram that passed at a moment; what is no frame, or holds a key, is not kept."""
        if self._ended:
            return
        stamp = _STAMP.pack(self._began_us + round(now_s * 1e6))
        kept = b"".join(stamp + frame for frame in frames(datagram) if message_id(frame) != _HOLDS_A_KEY)
        if len(kept) > self._left_bytes:
            self._end("is as large as it may grow")
            return
        self._left_bytes -= len(kept)
        try:
            self._file.write(kept)
        except OSError as error:
            self._end(f"cannot be written any more: {error.strerror}")

    def close(self) -> None:
        """Write out what is left and close the file."""
        try:
            self._file.close()
        except OSError as error:
            self._end(f"lacks its end: {error.strerror}")

    def _end(self, why: str) -> None:
        self._ended = True
        # What a full disk did not take it does not take now.
        with contextlib.suppress(OSError):
            self._file.close()
        self._tell(f"{self._path} {why}: nothing more is recorded there")

    def __enter__(self) -> TelemetryLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
