"""What takes a flight longer than a tick, on a thread of its own.

Results come back as events, and so does whatever breaks a job off.
"""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable

from mission.executive.events import Event


class GroundJobs:
    """One job after the other.

    Args:
        tell: Takes the events, from any thread.
    """

    def __init__(self, tell: Callable[[Event], None]) -> None:
        self._tell = tell
        self._thread = concurrent.futures.ThreadPoolExecutor(1, thread_name_prefix="checks")

    def submit(self, job: Callable[[], Event], failed: Callable[[str], Event]) -> None:
        """Have a job done.

        Args:
            job: What to do.
            failed: The event of a job that was broken off, from the reason.
        """

        def done(future: concurrent.futures.Future[Event]) -> None:
            if future.cancelled():
                return
            error = future.exception()
            if error is None:
                self._tell(future.result())
            else:
                # Refusals are ValueErrors and say all there is to say; of anything else its kind is worth knowing.
                name = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
                self._tell(failed(f"{name}{error}"))

        self._thread.submit(job).add_done_callback(done)

    def close(self) -> None:
        """Begin no more of them; one that is under way is not waited for."""
        self._thread.shutdown(wait=False, cancel_futures=True)
