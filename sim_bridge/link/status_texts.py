"""Lines of text from a vehicle, put together from the chunks of fifty bytes that they may come in.

A bad line doubles, swaps and loses chunks: each has its number, and what is missing of a text is in the end marked.
"""

from __future__ import annotations

import dataclasses

from sim_bridge.codec import mavlink
from sim_bridge.state import StatusText

_CHUNK_BYTES = 50
_MOST_CHUNKS = 8
_MOST_TEXTS = 8
_GAP = "…".encode()
# Heartbeats come once a second: chunks are waited for between one and two seconds.
_BEATS_WAITED = 2


@dataclasses.dataclass
class _Text:
    """What came of one text.

    Attributes:
        severity: MAV_SEVERITY.
        chunks: Their bytes by their numbers.
        beats: Heartbeats since the first of them.
        told: Whether it was told; what is heard of it now is a repetition.
    """

    severity: int
    chunks: dict[int, bytes] = dataclasses.field(default_factory=dict)
    beats: int = 0
    told: bool = False

    @property
    def complete(self) -> bool:
        """Whether nothing is missing: the last chunk is one that is not full, and nothing longer is waited for."""
        first_missing = next(number for number in range(_MOST_CHUNKS + 1) if number not in self.chunks)
        last = self.chunks.get(first_missing - 1, bytes(_CHUNK_BYTES))
        return len(last) < _CHUNK_BYTES or first_missing == _MOST_CHUNKS

    def tell(self) -> list[StatusText]:
        """The text, with a mark where something is missing; nothing, where it was told before."""
        if self.told:
            return []
        self.told = True
        numbers = range(max(self.chunks) + 1)
        end = b"" if self.complete or len(self.chunks[numbers[-1]]) < _CHUNK_BYTES else _GAP
        return [_status(self.severity, b"".join(self.chunks.get(number, _GAP) for number in numbers) + end)]


class StatusTexts:
    """Puts texts together; knows no clock but the vehicle's heartbeats."""

    def __init__(self) -> None:
        self._texts: dict[int, _Text] = {}

    def chunk(self, message: mavlink.MAVLink_statustext_message) -> list[StatusText]:
        """Take one message in.

        Returns:
            The texts that were finished by it.
        """
        data = message._text_raw.split(b"\0", 1)[0]
        severity, number = int(message.severity), int(message.chunk_seq)
        if message.id == 0:
            return [_status(severity, data)]
        if number >= _MOST_CHUNKS:
            return []
        finished: list[StatusText] = []
        text = self._texts.get(message.id)
        if text is not None and text.chunks.get(number, data) != data:
            # The number of an earlier text is used again.
            finished += self._texts.pop(message.id).tell()
            text = None
        if text is None:
            if len(self._texts) >= _MOST_TEXTS:
                finished += self._texts.pop(next(iter(self._texts))).tell()
            text = self._texts[message.id] = _Text(severity)
        text.chunks[number] = data
        return finished + (text.tell() if text.complete else [])

    def heartbeat(self) -> list[StatusText]:
        """A heartbeat came: the texts whose missing chunks are waited for no longer."""
        finished: list[StatusText] = []
        for number, text in list(self._texts.items()):
            text.beats += 1
            if text.beats >= _BEATS_WAITED:
                finished += self._texts.pop(number).tell()
        return finished


def _status(severity: int, data: bytes) -> StatusText:
    return StatusText(severity, data.decode("utf-8", "replace"))
