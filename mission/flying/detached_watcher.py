"""A watcher behind a thread: a terminal that blocks, or is gone, neither stalls a flight nor ends it."""

from __future__ import annotations

import contextlib
import functools
import queue
import threading
from collections.abc import Callable

from mission.flying.flight_progress import Progress, Watcher

_MOST_WAITING = 1000
_CLOSE_HOST_S = 2.0


class DetachedWatcher(Watcher):
    """Passes on what it is told, on a thread of its own; what a watcher does not keep up with is lost to it.

    Everything that is said stands in the flight's log as well.

    Args:
        watcher: Told; whatever it raises is its own affair.
    """

    def __init__(self, watcher: Watcher) -> None:
        self._watcher = watcher
        self._calls: queue.Queue[Callable[[], None] | None] = queue.Queue(_MOST_WAITING)
        self._thread = threading.Thread(target=self._run, name="watcher", daemon=True)
        self._thread.start()

    def say(self, text: str, warning: bool) -> None:
        """A line that stays."""
        self._pass_on(functools.partial(self._watcher.say, text, warning))

    def progress(self, progress: Progress) -> None:
        """How the flight stands."""
        self._pass_on(functools.partial(self._watcher.progress, progress))

    def close(self) -> None:
        """The flight is over; a watcher that is stuck is not waited for."""
        self._pass_on(self._watcher.close)
        self._pass_on(None)
        self._thread.join(_CLOSE_HOST_S)

    def _pass_on(self, call: Callable[[], None] | None) -> None:
        with contextlib.suppress(queue.Full):
            self._calls.put_nowait(call)

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            with contextlib.suppress(Exception):
                call()
