"""One built-in vehicle behind its line: datagrams in, datagrams out, without sockets and without a clock.

A simulator gives it wall time, a test gives it any.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from sim_bridge.channel import Channel, Quality
from sim_bridge.codec import Codec, Message, frames_in, mavlink
from sim_bridge.faults import AnyFault, FaultDriver
from sim_bridge.signing import Signatures
from sim_bridge.vehicle.autopilot import VehicleAutopilot

_SETPOINTS = (
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
)
# Where x, vx and what comes behind begin and end in a setpoint's payload: behind it come mask and addresses, before it
# is the sender's clock, which is another in every repetition.
_CLOCK_BYTES = 4
_VELOCITY = struct.Struct("<3f")
_VELOCITY_BEGINS, _VELOCITY_ENDS = 16, 28
Record = Callable[[float, bytes], None]
"""Takes a moment and a datagram."""


class Station:
    """A vehicle with its line.

    Args:
        autopilot: The vehicle.
        quality: Of the line, both ways.
        seed: Of what the line does.
        record: Is given everything that is heard and sent; None: nothing is kept.
        faults: What goes wrong on purpose.
        signatures: Signs what is sent, and nothing else is heard than what is signed; None: unsigned.

    Raises:
        ValueError: A fault that needs a key where there is none.
    """

    def __init__(
        self,
        autopilot: VehicleAutopilot,
        quality: Quality | None = None,
        seed: int = 0,
        record: Record | None = None,
        faults: Sequence[AnyFault] = (),
        signatures: Signatures | None = None,
    ) -> None:
        self.autopilot = autopilot
        line = quality or Quality()
        self._inward = Channel(line, 2 * seed)
        self._outward = Channel(line, 2 * seed + 1)
        self._codec = Codec(autopilot.body.config.system)
        self._record = record
        self._signatures = signatures
        self._faults = FaultDriver(
            faults, autopilot, (self._inward, self._outward), None if signatures is None else signatures.sign
        )
        self._setpoint = b""
        self.news_s: float | None = None
        """When the last setpoint was put that was not a mere repetition; None: none was."""

    @property
    def round_trip_s(self) -> float:
        """How late, at most, an answer to what the vehicle says comes back to it over the line."""
        there, back = self._outward.quality, self._inward.quality
        return there.delay_s + there.jitter_s + back.delay_s + back.jitter_s

    def put(self, datagram: bytes, now_s: float) -> bool:
        """Hand over what was sent to the vehicle.

        Returns:
            Whether there was news in it, for `news_s`.
        """
        news = False
        for message_id, payload in frames_in(datagram):
            if message_id in _SETPOINTS:
                # A sender's library may repeat the last setpoint by itself, which says nothing of its program. Where
                # that setpoint stands still, a repetition is as good as new.
                still = not any(_VELOCITY.unpack_from(payload.ljust(_VELOCITY_ENDS, b"\0"), _VELOCITY_BEGINS))
                news = news or still or payload[_CLOCK_BYTES:] != self._setpoint
                self._setpoint = payload[_CLOCK_BYTES:]
        if news:
            self.news_s = now_s
        self._inward.put(datagram, now_s)
        return news

    def advance(self, now_s: float) -> list[bytes]:
        """Let time pass, a hundredth of a second or less at a time.

        Returns:
            The datagrams that came out of the line.
        """
        self._send(self._faults.advance(now_s), now_s)
        for datagram in self._inward.arrived(now_s):
            if self._record is not None:
                self._record(now_s, datagram)
            for message in self._codec.decode(datagram):
                if self._signatures is not None and self._signatures.fault(bytes(message.get_msgbuf())):
                    continue
                self._send(self.autopilot.receive(message, now_s), now_s)
        self._send(self.autopilot.tick(now_s), now_s)
        return self._outward.arrived(now_s)

    def _send(self, messages: list[Message], now_s: float) -> None:
        for message in messages:
            datagram = self._codec.encode(message)
            if self._signatures is not None:
                datagram = self._signatures.sign(datagram)
            if self._record is not None:
                self._record(now_s, datagram)
            self._outward.put(datagram, now_s)
