"""What a vehicle says again and again: Copter tells of every waypoint in a line of its own."""

from __future__ import annotations

import re

from mission.executive.events import VEHICLE_SAYS

QUIET_S = 60.0
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_MOST_REMEMBERED = 256


class Chatter:
    """Knows what the vehicle said lately, but for the numbers in it. Whatever else is said is worth saying."""

    def __init__(self) -> None:
        self._said_s: dict[str, float] = {}

    def repeats(self, text: str, now_s: float) -> bool:
        """Whether the vehicle said the like within `QUIET_S`; remembers that it was said now.

        Args:
            text: What is said.
            now_s: When, on any clock that does not run backwards.
        """
        if not text.startswith(VEHICLE_SAYS):
            return False
        likeness = _NUMBER.sub("#", text)
        said_s = self._said_s.pop(likeness, None)
        # The latest are last, so the first is the one to be forgotten.
        self._said_s[likeness] = now_s
        if len(self._said_s) > _MOST_REMEMBERED:
            del self._said_s[next(iter(self._said_s))]
        return said_s is not None and now_s - said_s <= QUIET_S
