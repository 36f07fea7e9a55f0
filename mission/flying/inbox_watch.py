"""Has a flight's inbox looked into beside its loop, again and again: reading and merging take what time they take."""

from __future__ import annotations

import concurrent.futures
import time
from collections.abc import Callable

from mission.executive.events import Say
from mission.flying.pushes import TakenIn

_LOOK_IN_HOST_S = 0.1


class InboxWatch:
    """Looks in, on a thread of its own.

    Args:
        take_in: Takes in what was pushed since the last call; never called twice at a time.
    """

    def __init__(self, take_in: Callable[[], list[TakenIn]]) -> None:
        self._take_in = take_in
        self._thread = concurrent.futures.ThreadPoolExecutor(1, thread_name_prefix="pushes")
        self._looking: concurrent.futures.Future[list[TakenIn]] | None = None
        self._looked_s = 0.0

    def taken_in(self) -> list[TakenIn]:
        """What was taken in since the last call; has the inbox looked into again, if it is time to."""
        if self._looking is None:
            if time.monotonic() - self._looked_s >= _LOOK_IN_HOST_S:
                self._looked_s = time.monotonic()
                self._looking = self._thread.submit(self._take_in)
            return []
        if not self._looking.done():
            return []
        done, self._looking = self._looking, None
        if (error := done.exception()) is not None:
            return [TakenIn(Say(f"what was pushed was not taken in: {type(error).__name__}: {error}", True))]
        return done.result()

    def close(self) -> None:
        """Look in no more."""
        self._thread.shutdown(wait=False, cancel_futures=True)
