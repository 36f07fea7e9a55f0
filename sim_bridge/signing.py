"""MAVLink 2 signing, the same at both ends of a link.

Thirteen bytes behind each frame: a link id, a 48-bit time in units of 10 µs since 2015, and six bytes of a SHA-256 over
key and frame. The time rises for each sender (system, component, link id), so that nothing recorded can be replayed.
"""

from __future__ import annotations

import hashlib
import hmac
import stat
from pathlib import Path

from sim_bridge.codec import mavlink

KEY_BYTES = 32
SIGNATURE_BYTES = 13
EPOCH_UNIX_S = 1_420_070_400
"""2015-01-01 in Unix time: where the clock of signatures begins."""

_DIGEST_BYTES = 6
_TIME_BYTES = 6
_CHECKSUM_BYTES = 2
_LINK_ID = 0
# A sender not heard before may be this far behind our clock (the protocol's own figure: one minute).
_NEW_STREAM_BEHIND_10US = 6_000_000


def read_key(path: Path) -> bytes:
    """Read a signing key: 32 bytes, or 64 hexadecimal digits.

    Raises:
        ValueError: A file that others may read, or that holds no such key. The key itself is never told.
        OSError: The file cannot be read.
    """
    if stat.S_IMODE(path.stat().st_mode) & 0o077:
        raise ValueError(f"{path} may be read by others: run `chmod 600 {path}`")
    content = path.read_bytes()
    if len(content) == KEY_BYTES:
        return content
    try:
        key = bytes.fromhex(content.decode("ascii").strip())
    except (UnicodeDecodeError, ValueError):
        key = b""
    if len(key) != KEY_BYTES:
        raise ValueError(f"{path} holds no signing key: it must have 32 bytes or 64 hexadecimal digits")
    return key


def time_10us(unix_s: float) -> int:
    """A moment of Unix time on the clock of signatures."""
    return int((unix_s - EPOCH_UNIX_S) * 1e5)


class Signatures:
    """Signs what leaves and checks what comes.

    Args:
        key: Both ends have the same.
        now_10us: What the first signature counts up from (`time_10us`); after that no clock is looked at, so that one
            which jumps changes nothing.

    Raises:
        ValueError: A moment before signatures were invented: the computer's clock was never set.
    """

    def __init__(self, key: bytes, now_10us: int) -> None:
        if now_10us <= 0:
            raise ValueError(
                "this computer's clock says a year before 2015: set it, or nothing that it signs is believed"
            )
        self._key = key
        self._now_10us = now_10us
        self._newest_10us: dict[tuple[int, int, int], int] = {}

    def sign(self, frame: bytes) -> bytes:
        """A frame with its signature; empty, where the frame is of no known message and cannot be sealed anew."""
        message_id = int.from_bytes(frame[7:10], "little")
        known = mavlink.mavlink_map.get(message_id)
        if known is None or frame[0] != mavlink.PROTOCOL_MARKER_V2:
            return b""
        sealed = bytearray(frame[: 10 + frame[1]])
        sealed[2] |= mavlink.MAVLINK_IFLAG_SIGNED
        checksum = mavlink.x25crc(sealed[1:])
        checksum.accumulate(bytes([known.crc_extra]))
        self._now_10us += 1
        sealed += checksum.crc.to_bytes(_CHECKSUM_BYTES, "little")
        sealed.append(_LINK_ID)
        sealed += self._now_10us.to_bytes(_TIME_BYTES, "little")
        return bytes(sealed) + self._digest(bytes(sealed))

    def fault(self, frame: bytes) -> str:
        """Why a frame's signature is not accepted; empty: it is.

        The time is believed only once the signature is: one forgery with a late time would else lock a sender out.
        """
        if frame[0] != mavlink.PROTOCOL_MARKER_V2 or not frame[2] & mavlink.MAVLINK_IFLAG_SIGNED:
            return "not signed"
        if not hmac.compare_digest(self._digest(frame[:-_DIGEST_BYTES]), frame[-_DIGEST_BYTES:]):
            return "signed with another key"
        stream = (frame[-SIGNATURE_BYTES], frame[5], frame[6])
        moment = int.from_bytes(frame[-SIGNATURE_BYTES + 1 : -_DIGEST_BYTES], "little")
        if moment <= self._newest_10us.get(stream, self._now_10us - _NEW_STREAM_BEHIND_10US):
            return "signed before: repeated, or from a clock far behind"
        self._newest_10us[stream] = moment
        self._now_10us = max(self._now_10us, moment)
        return ""

    def _digest(self, signed: bytes) -> bytes:
        return hashlib.sha256(self._key + signed).digest()[:_DIGEST_BYTES]
