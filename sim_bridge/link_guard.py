"""What may pass between the wire and the rest: whole messages, from the vehicle alone, signed where a key is set.

MAVLink 2 signing both ways: 13 bytes behind each message (link id, 48-bit time in 10 µs since 2015, six bytes of a
SHA-256 over key and message), the time rising for each sender. With a key nothing unsigned is accepted.
"""

from __future__ import annotations

import collections
import dataclasses
import hashlib
import hmac
import os
import stat
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

KEY_BYTES = 32
_SIGNATURE_BYTES = 13
_DIGEST_BYTES = 6
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


@dataclasses.dataclass(frozen=True)
class Accepted:
    """A message that may pass.

    Attributes:
        message: Decoded.
        frame: Its bytes, as they came.
    """

    message: mavlink.MAVLink_message
    frame: bytes


class Guard:
    """Lets messages pass.

    Args:
        own_system: Our system id.
        own_component: Our component id.
        vehicle_system: The only system that is listened to.
        key: Signing key; None: nothing is signed, and signatures are not looked at.
        signing_time_10us: Time since 2015 in units of 10 µs: what the first signature counts up from.
    """

    def __init__(
        self,
        own_system: int,
        own_component: int,
        vehicle_system: int,
        key: bytes | None = None,
        signing_time_10us: int = 1,
    ) -> None:
        self._vehicle_system = vehicle_system
        self._inward = mavlink.MAVLink(None, own_system, own_component)
        self._inward.robust_parsing = True
        self._outward = mavlink.MAVLink(None, own_system, own_component)
        self._reader = mavlink.MAVLink(None, own_system, own_component)
        self._key = key
        self._newest_10us: dict[tuple[int, int, int], int] = {}
        if key is not None:
            self._outward.signing.secret_key = key
            self._outward.signing.sign_outgoing = True
            self._outward.signing.timestamp = signing_time_10us
        self.refused: collections.Counter[str] = collections.Counter()

    def accept(self, data: bytes) -> Iterator[Accepted]:
        """The messages in what arrived that may pass; the others are counted in `refused`."""
        for message in self._inward.parse_buffer(data) or ():
            if message.get_type() == "BAD_DATA":
                self.refused["not MAVLink, or damaged"] += 1
            elif self._key is not None and (fault := self._signature_fault(bytes(message.get_msgbuf()), self._key)):
                self.refused[fault] += 1
            elif message.get_srcSystem() != self._vehicle_system:
                self.refused["from another system"] += 1
            elif message.get_srcComponent() != mavlink.MAV_COMP_ID_AUTOPILOT1:
                self.refused["from another component"] += 1
            else:
                yield Accepted(message, bytes(message.get_msgbuf()))

    def _signature_fault(self, frame: bytes, key: bytes) -> str:
        """Why a message's signature is not accepted; empty: it is.

        pymavlink's own check takes over the time of a forged message before it looks at the signature, so that one
        forgery with a late time would lock the vehicle out.
        """
        if frame[0] != mavlink.PROTOCOL_MARKER_V2 or not frame[2] & mavlink.MAVLINK_IFLAG_SIGNED:
            return "not signed"
        expected = hashlib.sha256(key + frame[:-_DIGEST_BYTES]).digest()[:_DIGEST_BYTES]
        if not hmac.compare_digest(expected, frame[-_DIGEST_BYTES:]):
            return "signed with another key"
        link_id = frame[-_SIGNATURE_BYTES]
        stream = (link_id, frame[5], frame[6])
        time_10us = int.from_bytes(frame[-_SIGNATURE_BYTES + 1 : -_DIGEST_BYTES], "little")
        own = self._outward.signing
        newest = self._newest_10us.get(stream, own.timestamp - _NEW_STREAM_BEHIND_10US)
        if time_10us <= newest:
            return "signed before: repeated, or from a clock far behind"
        self._newest_10us[stream] = time_10us
        own.timestamp = max(own.timestamp, time_10us)
        return ""

    def seal(self, frame: bytes) -> bytes:
        """A message as it may leave: signed where a key is set."""
        if self._key is None:
            return frame
        message = self._reader.decode(bytearray(frame))
        self._outward.seq = message.get_seq()
        return bytes(message.pack(self._outward))
