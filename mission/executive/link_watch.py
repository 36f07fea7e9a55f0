"""How long nothing was heard, and what to make of a vehicle that is heard again."""

from __future__ import annotations

import enum
import math

from mission.executive.phases import STREAMING, Phase, Trigger
from sim_bridge.state import FlightMode, VehicleState

LINK_LOST_S = 1.5
LINK_GIVEN_UP_S = 10.0
LINK_GONE_S = 60.0
REJOINS = 3
NOTICED_S = 0.4
"""A silence shorter than this is a lost message or two."""
_SHOWN_S = 3.0
"""What a vehicle did in a silence shows this long after it at the latest: heartbeats come once a second."""


class Silence(enum.Enum):
    """What a silence has come to."""

    LOST = "no state for too long to fly on"
    GIVEN_UP = "no state for so long that the vehicle is to return by itself"
    GONE = "not a word for very long"


class LinkWatch:
    """Watches one link.

    Args:
        now_s: Flight clock at the beginning.
        patience: Flight seconds a host second: a link lives in the host's time, however fast a simulator's runs.
    """

    def __init__(self, now_s: float, patience: float) -> None:
        self._patience = patience
        self._heard_s = now_s
        self._stated_s = now_s
        self._silent_until_s = -math.inf
        self._told_to_return = False
        self._rejoins = 0

    def heard(self, now_s: float) -> None:
        """The vehicle said something."""
        self._heard_s = now_s

    def stated(self, now_s: float) -> None:
        """The vehicle told where it is."""
        if now_s - self._stated_s > NOTICED_S:
            self._silent_until_s = now_s
        self._heard_s = self._stated_s = now_s

    def missed(self, now_s: float) -> None:
        """The vehicle did not hear us for a while. A machine that stood still hears all that was said, only late."""
        self._silent_until_s = now_s

    def silence(self, phase: Phase, now_s: float) -> Silence | None:
        """What the silence has come to in a phase; None: nothing, or nothing new.

        A silence is given up once: whoever is told of it tells the vehicle to return.
        """
        silent_s = (now_s - self._stated_s) / self._patience
        if phase in STREAMING and silent_s > LINK_LOST_S:
            self._told_to_return = False
            return Silence.LOST
        if phase is Phase.BLIND and silent_s > LINK_GIVEN_UP_S and not self._told_to_return:
            self._told_to_return = True
            return Silence.GIVEN_UP
        if (now_s - self._heard_s) / self._patience > LINK_GONE_S:
            return Silence.GONE
        return None

    def lately_silent(self, now_s: float) -> bool:
        """Whether one did not hear the other just now, however shortly: the vehicle may have acted on that."""
        return now_s - self._silent_until_s < _SHOWN_S

    def heard_again(self, state: VehicleState) -> Trigger:
        """What to make of a vehicle that was not heard for a while.

        Args:
            state: What it tells now.
        """
        ours = state.mode is FlightMode.EXTERNAL
        going_home = state.mode in (FlightMode.RETURN, FlightMode.LAND)
        if not state.armed:
            return Trigger.DISARMED
        if going_home and (state.failsafe or self._told_to_return):
            return Trigger.LINK_BACK_RETURNING
        if ours and not self._told_to_return:
            return Trigger.LINK_BACK
        if not ours and not state.failsafe:
            return Trigger.PILOT
        # Held by its failsafe, or still waiting for setpoints that we stopped sending.
        if self._rejoins >= REJOINS:
            return Trigger.LINK_BACK_RETURNING
        self._rejoins += 1
        return Trigger.LINK_BACK_HOLDING
