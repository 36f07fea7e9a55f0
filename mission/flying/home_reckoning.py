"""How long the proven way home takes from where the vehicle is, reckoned again and again beside the flight."""

from __future__ import annotations

import concurrent.futures
import math
from collections.abc import Callable

from mission.executive.events import FindWay, WayHome
from planner.gate import ProvenTrajectory
from planner.problem import Problem

_EVERY_S = 5.0


class HomeReckoning:
    """Seeks the way home on a thread of its own: what the flight waits for does not wait for it.

    Args:
        find_way: Finds a proven way; its refusal is a ValueError.
    """

    def __init__(self, find_way: Callable[[FindWay], ProvenTrajectory]) -> None:
        self._find_way = find_way
        self._thread = concurrent.futures.ThreadPoolExecutor(1, thread_name_prefix="way home")
        self._sought: tuple[FindWay, concurrent.futures.Future[ProvenTrajectory]] | None = None
        self._known: Problem | None = None
        self._asked_s = -math.inf

    def ask(self, wanted: FindWay | None, known: Problem, now_s: float, rate: float) -> None:
        """Seek it, if it is time to or something was learned.

        Args:
            wanted: The way home from here; None: there is no need to know it.
            known: What is known; another object whenever something was learned.
            now_s: Flight clock.
            rate: Flight seconds a host second.
        """
        due = known is not self._known or now_s - self._asked_s >= _EVERY_S * max(1.0, rate)
        if wanted is not None and due and self._sought is None:
            self._known, self._asked_s = known, now_s
            self._sought = wanted, self._thread.submit(self._find_way, wanted)

    def answer(self) -> WayHome | None:
        """What was found since the last call; None: nothing.

        From where there is no way the last one counts: what is left of it is not known to be shorter.
        """
        if self._sought is None or not self._sought[1].done():
            return None
        (wanted, found), self._sought = self._sought, None
        return WayHome(wanted.start_m, found.result().duration_s) if found.exception() is None else None

    def close(self) -> None:
        """Seek it no more."""
        self._thread.shutdown(wait=False, cancel_futures=True)
