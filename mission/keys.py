"""The operator's keys while a flight goes on: p pause, r resume, h home, l land here."""

from __future__ import annotations

import contextlib
import os
import select
import sys
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from typing import TextIO

from mission.executive.events import Operator

KEYS = {"p": Operator.PAUSE, "r": Operator.RESUME, "h": Operator.RETURN, "l": Operator.LAND}
HELP = "keys: p pause · r resume · h come home · l land here · Ctrl-C come home, again: land, again: leave"
_POLL_S = 0.2


@contextlib.contextmanager
def listening(tell: Callable[[Operator], None], stream: TextIO = sys.stdin) -> Iterator[bool]:
    """Listen to the keys of a terminal, one by one and without echo.

    Args:
        tell: Told of each wish, on a thread of its own.
        stream: Where the keys come from; nothing is listened to where it is no terminal.

    Yields:
        Whether there is a terminal.
    """
    if not stream.isatty():
        yield False
        return
    number = stream.fileno()
    before = termios.tcgetattr(number)
    ended = threading.Event()

    def listen() -> None:
        while not ended.is_set():
            ready, _, _ = select.select([number], [], [], _POLL_S)
            if not ready:
                continue
            try:
                # Not through the stream, whose buffer would swallow keys that select then waits for.
                key = os.read(number, 1)
            except OSError:
                return
            if not key:
                # The terminal is gone, and would be ready for ever.
                return
            if (wish := KEYS.get(key.decode("ascii", "replace").lower())) is not None:
                tell(wish)

    tty.setcbreak(number)
    thread = threading.Thread(target=listen, name="keys", daemon=True)
    thread.start()
    try:
        yield True
    finally:
        ended.set()
        thread.join(2.0 * _POLL_S)
        with contextlib.suppress(termios.error):
            termios.tcsetattr(number, termios.TCSANOW, before)
