"""What holding and a lost link interrupted, and whether it may go on."""

from __future__ import annotations

from mission.executive.phases import Phase, Trigger

RECOVERED_S = 2.0
RECOVERIES = 3
REMEMBERED_S = 180.0
"""So often within so long is no accident: it keeps happening."""
_PASSES = (Trigger.TOO_CLOSE, Trigger.OFF_TRACK, Trigger.STALLED)
"""What may pass by itself while holding."""


class Interruption:
    """Remembers where the flight goes on.

    Attributes:
        paused: Whether the operator wants the vehicle to stand; only the operator, or a danger, ends that.
    """

    def __init__(self) -> None:
        self.paused = False
        self._paused_from = Phase.LANDING
        self._held_from = Phase.FOLLOWING
        self._blind_from = Phase.FOLLOWING
        self._held_for: Trigger | None = None
        self._recovered_s: list[float] = []
        self._calm_since_s: float | None = None

    def begin(self, phase: Phase, goto: Phase, trigger: Trigger) -> None:
        """A phase is left for another: note what that interrupts, if it does."""
        if goto is Phase.BLIND:
            self._blind_from = phase
        elif goto is Phase.RETURN_PAUSED:
            self._paused_from = phase
        elif goto in (Phase.HOLDING, Phase.AUTO_HOLD):
            self._held_from, self._held_for = phase, trigger

    def interrupted_by(self, phase: Phase) -> Phase:
        """What a phase interrupted: where it goes on after it."""
        match phase:
            case Phase.BLIND:
                return self._blind_from
            case Phase.RETURN_PAUSED:
                return self._paused_from
            case _:
                return self._held_from

    def over(self) -> None:
        """The flight moves again."""
        self._held_for = None

    @property
    def by_block(self) -> bool:
        """Whether it was new information in the way."""
        return self._held_for is Trigger.BLOCKED

    @property
    def waits_for_way(self) -> bool:
        """Whether it was new information in the way, and nothing else keeps the vehicle standing."""
        return self.by_block and not self.paused

    @property
    def nowhere_to_land(self) -> bool:
        """Whether it was that no place to land is clear."""
        return self._held_for is Trigger.NO_LANDING

    @property
    def passes(self) -> bool:
        """Whether it may pass by itself."""
        return self._held_for in _PASSES and not self.paused

    def stand(self) -> None:
        """The vehicle begins to stand: how calm it is counts from here."""
        self._calm_since_s = None

    def observe(self, calm: bool, now_s: float) -> Trigger | None:
        """Whether what interrupted has passed.

        Args:
            calm: Whether the vehicle stands, with nothing to alarm.
            now_s: Flight clock.

        Returns:
            What to do about it; None: not yet.
        """
        if not calm:
            self._calm_since_s = None
        elif self._calm_since_s is None:
            self._calm_since_s = now_s
        elif now_s - self._calm_since_s >= RECOVERED_S:
            self._recovered_s = [at_s for at_s in self._recovered_s if now_s - at_s < REMEMBERED_S] + [now_s]
            return Trigger.GIVEN_UP if len(self._recovered_s) > RECOVERIES else Trigger.RECOVERED
        return None
