"""What may pass between the wire and the rest: whole messages, from the vehicle alone, signed where a key is set.

MAVLink 2 signing both ways: 13 bytes behind each message (link id, 48-bit time in 10 µs since 2015, six bytes of a
SHA-256 over key and message), the time rising for each sender. With a key nothing unsigned is accepted.
"""

from __future__ import annotations

import collections
import dataclasses
import os
import stat
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

KEY_BYTES = 32


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
        if key is not None:
            self._inward.signing.secret_key = key
            self._outward.signing.secret_key = key
            self._outward.signing.sign_outgoing = True
            self._outward.signing.timestamp = signing_time_10us
        self.refused: collections.Counter[str] = collections.Counter()

    def accept(self, data: bytes) -> Iterator[Accepted]:
        """The messages in what arrived that may pass; the others are counted in `refused`."""
        for message in self._inward.parse_buffer(data) or ():
            if message.get_type() == "BAD_DATA":
                self.refused["not MAVLink, damaged, or not signed with our key"] += 1
            elif message.get_srcSystem() != self._vehicle_system:
                self.refused["from another system"] += 1
            elif message.get_srcComponent() != mavlink.MAV_COMP_ID_AUTOPILOT1:
                self.refused["from another component"] += 1
            else:
                yield Accepted(message, bytes(message.get_msgbuf()))

    def seal(self, frame: bytes) -> bytes:
        """A message as it may leave: signed where a key is set."""
        if self._key is None:
            return frame
        message = self._reader.decode(bytearray(frame))
        self._outward.seq = message.get_seq()
        return bytes(message.pack(self._outward))
