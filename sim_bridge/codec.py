"""Bytes to MAVLink messages and back, one dialect, without mavutil's globals.

Version 2 is spoken; version 1 is understood, which ground stations begin with.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import Any

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

Message = Any
"""A message of pymavlink's dialect: `mavlink.MAVLink_message`, whose fields are made at run time."""

# Decoding whole frames keeps nothing in it from one to the next.
_DECODER = mavlink.MAVLink(None)
_MARKERS = re.compile(rb"[\xfe\xfd]")
_HEADER_BYTES_V1, _HEADER_BYTES, _CHECKSUM_BYTES, _SIGNATURE_BYTES = 6, 10, 2, 13


class Codec:
    """One end of a conversation in datagrams.

    Args:
        system: Own system id.
        component: Own component id.
    """

    def __init__(self, system: int, component: int = mavlink.MAV_COMP_ID_AUTOPILOT1) -> None:
        self._mavlink = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)

    def encode(self, message: Message) -> bytes:
        """A message as bytes, with the next sequence number."""
        return message.pack(self._mavlink)

    def decode(self, datagram: bytes) -> list[Message]:
        """The messages in a datagram; what is garbage, unknown or cut off is left out."""
        return [message for message in messages(datagram) if message.get_msgId() >= 0]


def messages(datagram: bytes) -> Iterator[Message]:
    """What a datagram holds, decoded; a damaged frame, or a datagram without any, comes as BAD_DATA.

    Each datagram stands by itself: what one of them cuts off takes nothing from the next.
    """
    empty = True
    for frame in frames(datagram):
        empty = False
        yield _message(frame)
    if empty:
        yield mavlink.MAVLink_bad_data(bytearray(datagram), "no frame")


def frames(data: bytes) -> Iterator[bytes]:
    """Each whole MAVLink frame in a datagram, of version 1 or 2, unchecked and undecoded; what is none is skipped."""
    at = 0
    while (marker := _MARKERS.search(data, at)) is not None:
        begin = marker.start()
        end = _end(data, begin)
        if end <= len(data):
            yield data[begin:end]
        at = end if end <= len(data) else begin + 1


def frames_in(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Message id and payload of each MAVLink frame in a datagram, unchecked and undecoded."""
    for frame in frames(data):
        yield message_id(frame), _payload(frame)


def message_id(frame: bytes) -> int:
    """The message id of a whole frame."""
    if frame[0] == mavlink.PROTOCOL_MARKER_V1:
        return frame[_HEADER_BYTES_V1 - 1]
    return int.from_bytes(frame[7:_HEADER_BYTES], "little")


def _payload(frame: bytes) -> bytes:
    head = _HEADER_BYTES_V1 if frame[0] == mavlink.PROTOCOL_MARKER_V1 else _HEADER_BYTES
    return frame[head : head + frame[1]]


def _end(data: bytes, begin: int) -> int:
    """Where a frame that begins at a marker ends; behind the data, where its length is not even in there."""
    if begin + 3 > len(data):
        return len(data) + 1
    if data[begin] == mavlink.PROTOCOL_MARKER_V1:
        return begin + _HEADER_BYTES_V1 + data[begin + 1] + _CHECKSUM_BYTES
    signed = data[begin + 2] & mavlink.MAVLINK_IFLAG_SIGNED
    return begin + _HEADER_BYTES + data[begin + 1] + _CHECKSUM_BYTES + (_SIGNATURE_BYTES if signed else 0)


def _message(frame: bytes) -> Message:
    """A frame decoded; BAD_DATA, where it is damaged or asks for what nobody knows."""
    data = bytearray(frame)
    try:
        if frame[0] == mavlink.PROTOCOL_MARKER_V2 and frame[2] & ~mavlink.MAVLINK_IFLAG_SIGNED:
            raise mavlink.MAVError("unknown incompatibility flags")
        return _DECODER.decode(data)
    except mavlink.MAVError as error:
        return mavlink.MAVLink_bad_data(data, error.message)
