"""PX4's flight modes: their numbers, their names, and what each needs."""

from __future__ import annotations

import enum


class Mode(enum.Enum):
    """Flight modes the built-in vehicle has."""

    POSCTL = enum.auto()
    ALTCTL = enum.auto()
    STABILIZED = enum.auto()
    OFFBOARD = enum.auto()
    TAKEOFF = enum.auto()
    HOLD = enum.auto()
    MISSION = enum.auto()
    RETURN = enum.auto()
    LAND = enum.auto()
    DESCEND = enum.auto()
    """Straight down without a position; the heartbeat shows it as LAND."""

    @property
    def custom_mode(self) -> int:
        """As the heartbeat carries it."""
        main, sub = _NUMBERS[self]
        return sub << 24 | main << 16

    @property
    def words(self) -> str:
        """As PX4 names it in its texts."""
        return _WORDS[self]

    @property
    def prevents_arming(self) -> bool:
        """Whether nobody can arm in it."""
        return self in (Mode.RETURN, Mode.LAND, Mode.DESCEND)

    @property
    def needs_position(self) -> bool:
        """Whether it cannot be flown without a valid position."""
        return self not in (Mode.ALTCTL, Mode.STABILIZED, Mode.DESCEND)

    @property
    def follows_sticks(self) -> bool:
        """Whether a pilot's sticks fly the vehicle."""
        return self in (Mode.POSCTL, Mode.ALTCTL, Mode.STABILIZED)


_NUMBERS = {
    Mode.POSCTL: (3, 0),
    Mode.ALTCTL: (2, 0),
    Mode.STABILIZED: (7, 0),
    Mode.OFFBOARD: (6, 0),
    Mode.TAKEOFF: (4, 2),
    Mode.HOLD: (4, 3),
    Mode.MISSION: (4, 4),
    Mode.RETURN: (4, 5),
    Mode.LAND: (4, 6),
    Mode.DESCEND: (4, 6),
}
_WORDS = {
    Mode.POSCTL: "Position",
    Mode.ALTCTL: "Altitude",
    Mode.STABILIZED: "Stabilized",
    Mode.OFFBOARD: "Offboard",
    Mode.TAKEOFF: "Takeoff",
    Mode.HOLD: "Hold",
    Mode.MISSION: "Mission",
    Mode.RETURN: "Return",
    Mode.LAND: "Land",
    Mode.DESCEND: "Descend",
}
_AUTO = 4
_MISSION_SUB = 4


def mode_from_numbers(main: int, sub: int) -> Mode | None:
    """The mode that a command's main and sub mode mean; None: not one of the built-in vehicle's."""
    if main == _AUTO and sub == 0:
        sub = _MISSION_SUB
    wanted = (main, sub if main == _AUTO else 0)
    return next((mode for mode, numbers in _NUMBERS.items() if numbers == wanted), None)
