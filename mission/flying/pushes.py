"""What is pushed into a flight, taken in beside its loop: read, merged, answered.

What counts for an answer is what is known when it is given: the flight holds its course against that from its next step
on, however long the taking in took.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from mission.executive.events import Operator, Say
from mission.flying.belief import Belief
from mission.flying.intake import Arrived, Intake, Push, solids_in_push, with_push
from mission.mission_file import Mission

MOST_SOLIDS = 1000
"""Shapes that may be pushed into one flight: with many more, looking along the course takes longer than flying it."""
_OPERATOR = {"pause": Operator.PAUSE, "resume": Operator.RESUME, "return": Operator.RETURN, "land": Operator.LAND}


@dataclasses.dataclass(frozen=True)
class TakenIn:
    """What came of what was pushed.

    Attributes:
        said: What there is to tell.
        wish: What the operator wants; None: nothing.
    """

    said: Say | None
    wish: Operator | None = None


class Pushes:
    """Takes in what is pushed; called on one thread, which is not the loop's.

    Args:
        mission: What was asked.
        belief: What is known.
        intake: Where pushes arrive.
        consequence: What the flight will do about what it has just learned, beyond keeping clear of it; empty: nothing.
    """

    def __init__(self, mission: Mission, belief: Belief, intake: Intake, consequence: Callable[[], str]) -> None:
        self._mission = mission
        self._belief = belief
        self._intake = intake
        self._consequence = consequence
        self._solids = 0

    def take_in(self) -> list[TakenIn]:
        """Take in everything that was pushed since the last call."""
        return [self._take_in(arrived) for arrived in self._intake.arrived()]

    def _take_in(self, arrived: Arrived) -> TakenIn:
        push = arrived.push
        if push is None:
            return self._refused(arrived, arrived.reason)
        try:
            self._learn(push)
        except (ValueError, MemoryError) as error:
            return self._refused(arrived, str(error))
        reason = "taken in"
        if (push.obstacle or push.no_fly) and (consequence := self._consequence()):
            reason = f"taken in; {consequence}"
        self._intake.answer(arrived, True, reason)
        added = len(push.obstacle) + len(push.no_fly)
        words = [f"{added} obstacles"] * bool(added) + ["information"] * (push.information is not None)
        said = None
        if words:
            said = Say(f"learned new {' and '.join(words)}{reason.removeprefix('taken in')}", reason != "taken in")
        return TakenIn(said, None if push.command is None else _OPERATOR[push.command])

    def _learn(self, push: Push) -> None:
        solids = solids_in_push(push, self._mission)
        if self._solids + solids > MOST_SOLIDS:
            raise ValueError(
                f"{solids} shapes, after {self._solids} that were pushed before: a flight takes in {MOST_SOLIDS}; push "
                "fewer and larger ones, or put them into the mission file and plan anew"
            )
        mission, learned = with_push(self._mission, self._belief.problem, push)
        self._belief.change(obstacles=learned.obstacles, information=learned.information, search=learned.search)
        self._mission, self._solids = mission, self._solids + solids

    def _refused(self, arrived: Arrived, reason: str) -> TakenIn:
        self._intake.answer(arrived, False, reason)
        return TakenIn(Say(f"a push was refused: {reason}", warning=True))
