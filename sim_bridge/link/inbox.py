"""What was heard and not taken yet, and what the vehicle said lately; filled by the link's threads, emptied by one."""

from __future__ import annotations

import contextlib
import dataclasses
import queue
import time
from collections.abc import Iterator

from sim_bridge.link.telemetry import Heard
from sim_bridge.state import CommandDone, StatusText

_MOST_EVENTS = 20_000
_TEXTS_KEPT_S = 10.0
_MOST_TEXTS = 200
_LAST_WORDS_S = 3.0
_NOTICE = 5


@dataclasses.dataclass(frozen=True)
class Timed:
    """An event and when this machine heard it.

    Attributes:
        host_s: This machine's monotonic clock.
        event: What was heard.
    """

    host_s: float
    event: Heard | CommandDone


class Inbox:
    """A bounded queue of events that never blocks who fills it."""

    def __init__(self) -> None:
        self._events: queue.Queue[Timed] = queue.Queue(_MOST_EVENTS)
        self._texts: list[tuple[float, StatusText]] = []

    def post(self, host_s: float, event: Heard | CommandDone) -> None:
        """Put an event in."""
        if isinstance(event, StatusText):
            kept = [(at, text) for at, text in self._texts if host_s - at < _TEXTS_KEPT_S]
            self._texts = [*kept[-_MOST_TEXTS:], (host_s, event)]
        try:
            self._events.put_nowait(Timed(host_s, event))
        except queue.Full:
            # Nobody listens: the newest is worth more than the oldest.
            with contextlib.suppress(queue.Empty):
                self._events.get_nowait()
            self._events.put_nowait(Timed(host_s, event))

    def taken(self, timeout_s: float) -> Iterator[Timed]:
        """Everything that is there, waiting at most so long for the first."""
        try:
            yield self._events.get(timeout=timeout_s) if timeout_s > 0.0 else self._events.get_nowait()
            while True:
                yield self._events.get_nowait()
        except queue.Empty:
            return

    def texts_since(self, host_s: float) -> list[str]:
        """What the vehicle said since a moment of this machine's monotonic clock."""
        return [text.text for at_s, text in self._texts if at_s >= host_s]

    def last_words(self) -> str:
        """What the vehicle said in the last moments, as one line."""
        since_s = time.monotonic() - _LAST_WORDS_S
        said = [text.text for at_s, text in self._texts if at_s >= since_s and text.severity <= _NOTICE]
        return "; ".join(dict.fromkeys(said))
