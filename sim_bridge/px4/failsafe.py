"""PX4's failsafe state machine: which action the causes of the moment ask for, and who may take over from it.

Actions are ordered by severity and the worst one wins. The mode the user wanted is kept beside it: where an action ends
with its cause, the vehicle goes back to that mode by itself. That is how Offboard comes back when setpoints do.
"""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Callable, Mapping

from sim_bridge.px4.modes import Mode


class Action(enum.IntEnum):
    """What a failsafe does, from nothing to worst."""

    NONE = 0
    WARN = 1
    POSITION = 2
    ALTITUDE = 3
    STABILIZED = 4
    HOLD = 5
    RETURN = 6
    LAND = 7
    DESCEND = 8
    DISARM = 9
    TERMINATE = 10


MODES = {
    Action.POSITION: Mode.POSCTL,
    Action.ALTITUDE: Mode.ALTCTL,
    Action.STABILIZED: Mode.STABILIZED,
    Action.HOLD: Mode.HOLD,
    Action.RETURN: Mode.RETURN,
    Action.LAND: Mode.LAND,
    Action.DESCEND: Mode.DESCEND,
}
# What is tried when an action's mode cannot be flown; STABILIZED is only ever a last resort with sticks.
_NEXT_BEST = {
    Action.POSITION: Action.ALTITUDE,
    Action.HOLD: Action.RETURN,
    Action.RETURN: Action.LAND,
    Action.LAND: Action.DESCEND,
}


class Cause(enum.Enum):
    """Why a failsafe acts."""

    MODE = "the mode cannot be flown"
    FENCE = "outside the fence"
    BATTERY = "battery"
    GROUND_STATION = "ground station lost"


@dataclasses.dataclass(frozen=True)
class Response:
    """What a cause asks for.

    Attributes:
        action: What to do.
        outlasts_cause: Whether it stays when its cause is gone, until somebody changes the mode.
        delayed: Whether the vehicle first holds for COM_FAIL_ACT_T, so that a pilot can take over.
    """

    action: Action
    outlasts_cause: bool = False
    delayed: bool = False


def on_stream_loss(parameter: float) -> Action:
    """COM_OBL_RC_ACT."""
    actions = {
        1: Action.ALTITUDE,
        2: Action.STABILIZED,
        3: Action.RETURN,
        4: Action.LAND,
        5: Action.HOLD,
        6: Action.TERMINATE,
        7: Action.DISARM,
    }
    return actions.get(int(parameter), Action.POSITION)


def on_fence(parameter: float) -> Response:
    """GF_ACTION."""
    match int(parameter):
        case 0:
            return Response(Action.NONE)
        case 2:
            return Response(Action.HOLD, outlasts_cause=True)
        case 3:
            return Response(Action.RETURN, outlasts_cause=True, delayed=True)
        case 4:
            return Response(Action.TERMINATE, outlasts_cause=True)
        case 5:
            return Response(Action.LAND, delayed=True)
        case _:
            return Response(Action.WARN)


def on_battery(parameter: float, level: int) -> Response:
    """COM_LOW_BAT_ACT at warning level 1 low, 2 critical, 3 emergency."""
    choice = int(parameter)
    if level >= 2 and choice in (1, 2, 3):
        lands = choice == 2 or (choice == 3 and level == 3)
        return Response(Action.LAND if lands else Action.RETURN, delayed=True)
    return Response(Action.WARN)


def on_ground_station_loss(parameter: float) -> Response:
    """NAV_DLL_ACT."""
    actions = {
        1: Response(Action.HOLD, delayed=True),
        2: Response(Action.RETURN, outlasts_cause=True, delayed=True),
        3: Response(Action.LAND, delayed=True),
        5: Response(Action.TERMINATE, outlasts_cause=True),
        6: Response(Action.DISARM),
    }
    return actions.get(int(parameter), Response(Action.NONE))


@dataclasses.dataclass
class _Active:
    response: Response
    present: bool = True


class Failsafes:
    """Which action is in force."""

    def __init__(self) -> None:
        self.action = Action.NONE
        self._active: dict[Cause, _Active] = {}
        self._taken_over = False
        self._delay_until_s = 0.0

    @property
    def acts(self) -> bool:
        """Whether more than a warning is in force."""
        return self.action > Action.WARN

    def clear(self) -> None:
        """As at arming and disarming."""
        self.__init__()

    def update(
        self,
        causes: Mapping[Cause, Response],
        intended: Mode,
        *,
        mode_changed: bool,
        can_fly: Callable[[Mode], bool],
        delay_s: float,
        now_s: float,
    ) -> list[str]:
        """Look at the causes of the moment and choose an action.

        Args:
            causes: What each present cause asks for.
            intended: The mode the user wants.
            mode_changed: Whether the user chose a mode since the last call.
            can_fly: Whether a mode's needs are met.
            delay_s: COM_FAIL_ACT_T.
            now_s: Time since boot.

        Returns:
            What to tell, as texts.
        """
        if mode_changed:
            self._active = {cause: one for cause, one in self._active.items() if one.present}
        fresh_warning = self._take(causes, delay_s, now_s)
        worst = max((one.response.action for one in self._active.values()), default=Action.NONE)
        if mode_changed and worst == self.action and worst > Action.WARN:
            self._taken_over = True
        if not self._active:
            self._taken_over = False
        held = now_s < self._delay_until_s and not self._taken_over and Action.WARN < worst < Action.DISARM
        chosen = Action.HOLD if held else worst
        if self._taken_over and Action.WARN < chosen < Action.DISARM:
            chosen = Action.WARN
            mode_response = causes.get(Cause.MODE)
            if mode_response is not None:
                chosen = mode_response.action
        chosen = self._possible(chosen, can_fly)
        if intended is Mode.LAND and worst is Action.RETURN and can_fly(Mode.LAND):
            chosen, held = Action.WARN, False
        texts = []
        if chosen > self.action or fresh_warning:
            wait_s = round(self._delay_until_s - now_s)
            texts.append(f"Failsafe activated: entering Hold for {wait_s} seconds" if held else "Failsafe activated")
        self.action = chosen
        return texts

    def _take(self, causes: Mapping[Cause, Response], delay_s: float, now_s: float) -> bool:
        """Bring the active actions up to date; whether a new warning is among them."""
        fresh_warning = False
        for cause, one in list(self._active.items()):
            one.present = cause in causes
            if not one.present and not one.response.outlasts_cause:
                del self._active[cause]
        for cause, response in causes.items():
            known = self._active.get(cause)
            if known is not None:
                worse = response.action > known.response.action
                known.response = dataclasses.replace(known.response, action=response.action)
                if not worse:
                    continue
            else:
                self._active[cause] = _Active(response)
            if response.action is Action.WARN:
                fresh_warning = True
            if response.action >= Action.HOLD:
                self._taken_over = False
                if response.delayed and now_s >= self._delay_until_s:
                    self._delay_until_s = now_s + delay_s
        return fresh_warning

    @staticmethod
    def _possible(action: Action, can_fly: Callable[[Mode], bool]) -> Action:
        """The action itself, or the next one whose mode can be flown."""
        while action in MODES and not can_fly(MODES[action]):
            following = _NEXT_BEST.get(action)
            if following is None:
                break
            action = following
        return action
