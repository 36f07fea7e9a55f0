"""A vehicle's parameters and their protocol.

PX4 sends an integer's bytes in the float field and ignores a write of another type; ArduPilot sends an integer's value
as a float and takes any. An unknown name gets no reply from either.
"""

from __future__ import annotations

import enum
import math
import struct
from collections.abc import Mapping

from sim_bridge.codec import Message, mavlink

_SMALLEST, _LARGEST = -(2**31), 2**31 - 1


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
        self.changes = 0
        """How often any was written."""

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def change(self, changes: Mapping[str, float]) -> None:
        """Set several, keeping each one's type.

        Raises:
            ValueError: A name that the vehicle does not have, or a value that is no number.
        """
        for name, value in changes.items():
            if name not in self._values:
                raise ValueError(f"the vehicle has no parameter {name}: it has {', '.join(sorted(self._values))}")
            if not math.isfinite(value):
                raise ValueError(f"parameter {name} needs a finite number, got {value}")
            whole = isinstance(self._values[name], int)
            self._values[name] = max(_SMALLEST, min(_LARGEST, int(value))) if whole else float(value)
        self.changes += 1

    def receive(self, message: Message) -> list[Message]:
        """Answer a request about parameters; anything else is answered with nothing."""
        match message:
            case mavlink.MAVLink_param_request_list_message():
                return [self._value(name) for name in self._values]
            case mavlink.MAVLink_param_request_read_message():
                names = list(self._values)
                index = message.param_index
                name = message.param_id if index < 0 else names[index] if index < len(names) else ""
                return [self._value(name)] if name in self._values else []
            case mavlink.MAVLink_param_set_message():
                return self._set(message)
            case _:
                return []

    def _set(self, message: Message) -> list[Message]:
        name, kind = message.param_id, message.param_type
        if name not in self._values:
            return []
        value = message.param_value
        if self._encoding is Encoding.BYTEWISE:
            if kind != self._kind(name):
                return []
            if kind == mavlink.MAV_PARAM_TYPE_INT32:
                value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        if math.isfinite(value):
            self.change({name: value})
        return [self._value(name)]

    def _kind(self, name: str) -> int:
        whole = isinstance(self._values[name], int)
        return mavlink.MAV_PARAM_TYPE_INT32 if whole else mavlink.MAV_PARAM_TYPE_REAL32

    def _value(self, name: str) -> Message:
        value = self._values[name]
        if isinstance(value, int) and self._encoding is Encoding.BYTEWISE:
            as_float = struct.unpack("<f", struct.pack("<i", value))[0]
        else:
            as_float = float(value)
        names = list(self._values)
        kind = self._kind(name)
        return mavlink.MAVLink_param_value_message(name.encode(), as_float, kind, len(names), names.index(name))
