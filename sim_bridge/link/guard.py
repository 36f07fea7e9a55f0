"""What may pass between the wire and the rest: whole messages, from the vehicle alone, signed where a key is set.

With a key nothing unsigned is accepted.
"""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Callable, Iterable, Iterator

from sim_bridge.codec import Message, mavlink, messages
from sim_bridge.signing import Signatures


@dataclasses.dataclass(frozen=True)
class Accepted:
    """A message that may pass.

    Attributes:
        message: Decoded.
        frame: Its bytes, as they came.
    """

    message: Message
    frame: bytes


class Guard:
    """Lets messages pass.

    Args:
        own_system: Our system id.
        own_component: Our component id.
        vehicle_system: The only system that is listened to.
        key: Signing key; None: nothing is signed, and signatures are not looked at.
        signing_time_10us: Time since 2015 in units of 10 µs: what the first signature counts up from.
        datagrams: Whether what arrives comes in datagrams, each of which stands by itself; else it is a stream of
            bytes, cut anywhere.
    """

    def __init__(
        self,
        own_system: int,
        own_component: int,
        vehicle_system: int,
        key: bytes | None = None,
        signing_time_10us: int = 1,
        *,
        datagrams: bool = True,
    ) -> None:
        self._vehicle_system = vehicle_system
        self._messages = messages if datagrams else _stream_reader(own_system, own_component)
        self._signatures = None if key is None else Signatures(key, signing_time_10us)
        self.refused: collections.Counter[str] = collections.Counter()

    def accept(self, data: bytes) -> Iterator[Accepted]:
        """The messages in what arrived that may pass; the others are counted in `refused`."""
        for message in self._messages(data):
            if message.get_type() == "BAD_DATA":
                self.refused["not MAVLink, or damaged"] += 1
            elif self._signatures is not None and (fault := self._signatures.fault(bytes(message.get_msgbuf()))):
                self.refused[fault] += 1
            elif message.get_srcSystem() != self._vehicle_system:
                self.refused["from another system"] += 1
            elif message.get_srcComponent() != mavlink.MAV_COMP_ID_AUTOPILOT1:
                self.refused["from another component"] += 1
            else:
                yield Accepted(message, bytes(message.get_msgbuf()))

    def seal(self, frame: bytes) -> bytes:
        """A message as it may leave: signed where a key is set; empty: it may not."""
        return frame if self._signatures is None else self._signatures.sign(frame)


def _stream_reader(system: int, component: int) -> Callable[[bytes], Iterable[Message]]:
    """What reads messages from a stream of bytes, and keeps what is cut off until the rest comes."""
    parser = mavlink.MAVLink(None, system, component)
    parser.robust_parsing = True
    return lambda data: parser.parse_buffer(data) or ()
