"""Telemetry logs: every frame heard and sent, as ground stations write and read them.

A `.tlog` is frame after frame, each behind the moment it passed: microseconds since 1970, eight bytes, big-endian.
"""

from __future__ import annotations

import struct
from pathlib import Path
from types import TracebackType

from sim_bridge.codec import frames

_STAMP = struct.Struct(">Q")


class TelemetryLog:
    """A log being written; closed by `close` or at the end of a `with`.

    Args:
        path: Of the file; an older one is replaced.
        began_unix_s: What a vehicle's second 0 is, in Unix time.

    Raises:
        OSError: The file cannot be written.
    """

    def __init__(self, path: Path, began_unix_s: float) -> None:
        self._file = path.open("wb")
        self._began_us = round(began_unix_s * 1e6)

    def write(self, now_s: float, datagram: bytes) -> None:
        """Keep the frames of a datagram that passed at a moment; what is no frame is not kept."""
        stamp = _STAMP.pack(self._began_us + round(now_s * 1e6))
        for frame in frames(datagram):
            self._file.write(stamp + frame)

    def close(self) -> None:
        """Write out what is left and close the file."""
        self._file.close()

    def __enter__(self) -> TelemetryLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
