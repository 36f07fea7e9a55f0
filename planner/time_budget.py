"""The optimiser's work, fitted to the time there is.

Early rounds are loose: they find the shape of a path, which breaks its limits then. A solve that is cut off in them has
nothing to show. So where time runs short every round is made shorter, and where there is little of it, fewer rounds
make a path firm.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence

from planner.polish import Round

FEWEST_STEPS = 8
"""A round of fewer steps hardly moves a path."""
FIRST_STEPS = 2
"""Of Stein steps: with many candidates each takes a good part of a second."""
HURRIED_BELOW = 0.5
"""Of the planned steps: twelve rounds of a few steps each pass fewer candidates than three longer ones (measured)."""
MOST_RESERVED = 0.5
"""The gate's time is held back, but no more than this share of what is left."""


class TimeBudget:
    """What a solve may still spend.

    Attributes:
        left_s: Seconds left, by the caller's clock; not positive once it is over.
        reserved_s: Of these, what the gate will need at the end.
        fell_short: Whether anything was shortened, or left out, for want of time.
    """

    def __init__(self, left_s: Callable[[], float]) -> None:
        self.left_s = left_s
        self.reserved_s = 0.0
        self.fell_short = False
        # Unknown, and taken for nothing, until the first piece is done.
        self._step_s = 0.0

    def is_over(self) -> bool:
        """Whether nothing is left; asked where there is something to do, which then is left out."""
        over = self.left_s() <= 0.0
        self.fell_short |= over
        return over

    def within(self, share: float) -> Callable[[], bool]:
        """Tells whether a share of the time left now is still there; asked where there is more to do."""
        left_s = self.left_s()
        until_s = (1.0 - share) * left_s if math.isfinite(left_s) else -math.inf

        def is_there() -> bool:
            there = self.left_s() > until_s
            self.fell_short |= not there
            return there

        return is_there

    def portions(self, steps: int, at_once: int, share: float) -> Iterator[int]:
        """So many steps, or as many as fit into a share of the time left, in portions.

        Args:
            steps: How many are wanted.
            at_once: How many are taken between two looks at the clock.
            share: Of the time left, 0 … 1.

        Yields:
            How many to take now; they are done before the next portion is asked for.
        """
        share_s = self._share_s(share)
        # How long a step takes is not known before the first few.
        affordable = FIRST_STEPS if math.isfinite(share_s) else math.inf
        while steps:
            portion = int(min(steps, at_once, affordable))
            if share_s <= 0.0 or portion < 1:
                self.fell_short = True
                return
            before_s = self.left_s()
            yield portion
            share_s -= self._spent_since(before_s, portion)
            affordable, steps = self._affordable(share_s), steps - portion

    def rounds(self, planned: Sequence[Round], share: float, hurried: Sequence[Round] = ()) -> Iterator[Round]:
        """The rounds, shortened to what fits into a share of the time left at the pace seen so far.

        Args:
            planned: What is done where there is time.
            share: Of the time left, 0 … 1.
            hurried: What is done instead where there is not even time for half of it.

        Yields:
            One round; it is done before the next is asked for.
        """
        share_s = self._share_s(share)
        share_s -= min(self.reserved_s, MOST_RESERVED * share_s)
        rest = list(planned)
        if hurried and share_s > 0.0 and self._affordable(share_s) < _steps(planned):
            # What was done before may have been slower: a few steps tell.
            before_s = self.left_s()
            yield dataclasses.replace(planned[0], steps=FEWEST_STEPS)
            share_s -= self._spent_since(before_s, FEWEST_STEPS)
            if self._affordable(share_s) < HURRIED_BELOW * _steps(planned):
                self.fell_short = True
                rest = list(hurried)
        while rest:
            if share_s <= 0.0:
                self.fell_short = True
                return
            fitting = fitted(rest, self._affordable(share_s))
            self.fell_short |= fitting != rest
            before_s = self.left_s()
            yield fitting[0]
            share_s -= self._spent_since(before_s, fitting[0].steps)
            rest = rest[1:]

    def _affordable(self, time_s: float) -> float:
        """Steps that fit into a time, at the pace of the last ones."""
        return time_s / self._step_s if self._step_s > 0.0 else math.inf

    def _share_s(self, share: float) -> float:
        left_s = self.left_s()
        return share * left_s if math.isfinite(left_s) else math.inf

    def _spent_since(self, before_s: float, steps: int) -> float:
        if not math.isfinite(before_s):
            return 0.0
        spent_s = max(0.0, before_s - self.left_s())
        self._step_s = spent_s / steps
        return spent_s


def fitted(planned: Sequence[Round], steps: float) -> list[Round]:
    """Rounds shortened alike to so many steps together, none to fewer than makes sense.

    Args:
        planned: As long as they should be.
        steps: How many there is time for.
    """
    share = min(1.0, steps / _steps(planned))
    return [
        dataclasses.replace(one, steps=min(one.steps, max(FEWEST_STEPS, int(share * one.steps)))) for one in planned
    ]


def _steps(rounds: Sequence[Round]) -> int:
    return sum(one.steps for one in rounds)
