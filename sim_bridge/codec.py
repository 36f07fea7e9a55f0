"""Bytes to MAVLink 2 messages and back, one dialect, without mavutil's globals."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

Message = Any
"""A message of pymavlink's dialect: `mavlink.MAVLink_message`, whose fields are made at run time."""

_HEADER_BYTES, _CHECKSUM_BYTES, _SIGNATURE_BYTES = 10, 2, 13


class Codec:
    """One end of a conversation.

    Args:
        system: Own system id.
        component: Own component id.
    """

    def __init__(self, system: int, component: int = mavlink.MAV_COMP_ID_AUTOPILOT1) -> None:
        self._mavlink = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self._mavlink.robust_parsing = True

    def encode(self, message: Message) -> bytes:
        """A message as bytes, with the next sequence number."""
        return message.pack(self._mavlink)

    def decode(self, data: bytes) -> list[Message]:
        """The messages in some bytes; what is garbage, unknown or cut off is left out."""
        found = self._mavlink.parse_buffer(data) or []
        return [message for message in found if message.get_msgId() >= 0]


def frames(data: bytes) -> Iterator[bytes]:
    """Each whole MAVLink 2 frame in a datagram, unchecked and undecoded."""
    at = 0
    while at + _HEADER_BYTES <= len(data) and data[at] == mavlink.PROTOCOL_MARKER_V2:
        signed = data[at + 2] & mavlink.MAVLINK_IFLAG_SIGNED
        end = at + _HEADER_BYTES + data[at + 1] + _CHECKSUM_BYTES + (_SIGNATURE_BYTES if signed else 0)
        if end > len(data):
            return
        yield data[at:end]
        at = end


def frames_in(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Message id and payload of each MAVLink 2 frame in a datagram, unchecked and undecoded."""
    for frame in frames(data):
        yield int.from_bytes(frame[7:_HEADER_BYTES], "little"), frame[_HEADER_BYTES : _HEADER_BYTES + frame[1]]
