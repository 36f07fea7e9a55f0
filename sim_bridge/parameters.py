"""A vehicle's parameters and their protocol.

PX4 sends an integer's bytes in the float field, ArduPilot its value as a float. An unknown name gets no reply.
"""

from __future__ import annotations

import enum
import math
import struct
from collections.abc import Mapping

from sim_bridge.codec import Message, mavlink


class Encoding(enum.Enum):
    """How an integer travels in PARAM_VALUE's float."""

    BYTEWISE = "bytewise"
    CAST = "cast"


class Parameters:
    """Names to numbers; an int stays an int.

    Args:
        values: What the vehicle starts with.
        encoding: How integers travel.
    """

    def __init__(self, values: Mapping[str, float], encoding: Encoding) -> None:
        self._values = dict(values)
        self._encoding = encoding

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def change(self, changes: Mapping[str, float]) -> None:
        """Set several, keeping each one's type.

        Raises:
            ValueError: A name that the vehicle does not have.
        """
        for name, value in changes.items():
            if name not in self._values:
                raise ValueError(f"the vehicle has no parameter {name}")
            self._values[name] = int(value) if isinstance(self._values[name], int) else float(value)

    def receive(self, message: Message) -> list[Message]:
        """Answer a request about parameters; anything else is answered with nothing."""
        match message:
            case mavlink.MAVLink_param_request_list_message():
                return [self._value(name) for name in self._values]
            case mavlink.MAVLink_param_request_read_message():
                names = list(self._values)
                name = names[message.param_index] if 0 <= message.param_index < len(names) else message.param_id
                return [self._value(name)] if name in self._values else []
            case mavlink.MAVLink_param_set_message():
                if message.param_id not in self._values:
                    return []
                value = self._decoded(message.param_value, message.param_type)
                if math.isfinite(value):
                    self.change({message.param_id: value})
                return [self._value(message.param_id)]
            case _:
                return []

    def _value(self, name: str) -> Message:
        value = self._values[name]
        if isinstance(value, int):
            kind = mavlink.MAV_PARAM_TYPE_INT32
            as_float = self._as_bytes(value) if self._encoding is Encoding.BYTEWISE else float(value)
        else:
            kind, as_float = mavlink.MAV_PARAM_TYPE_REAL32, value
        names = list(self._values)
        return mavlink.MAVLink_param_value_message(name.encode(), as_float, kind, len(names), names.index(name))

    @staticmethod
    def _as_bytes(value: int) -> float:
        return struct.unpack("<f", struct.pack("<i", value))[0]

    def _decoded(self, value: float, kind: int) -> float:
        whole = kind not in (mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_REAL64)
        if whole and self._encoding is Encoding.BYTEWISE:
            return float(struct.unpack("<i", struct.pack("<f", value))[0])
        return value
