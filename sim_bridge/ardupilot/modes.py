"""ArduPilot Copter's flight modes."""

from __future__ import annotations

import enum


class Mode(enum.IntEnum):
    """Flight modes the built-in vehicle has, by the heartbeat's custom mode."""

    STABILIZE = 0
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    LAND = 9
    POSHOLD = 16
    BRAKE = 17

    @property
    def needs_position(self) -> bool:
        """Whether it cannot be flown without a valid position; LAND can, straight down."""
        return self not in (Mode.STABILIZE, Mode.ALT_HOLD, Mode.LAND)

    @property
    def follows_sticks(self) -> bool:
        """Whether a pilot's sticks fly the vehicle; without a pilot the throttle is at zero."""
        return self in (Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER, Mode.POSHOLD)

    @property
    def armable(self) -> bool:
        """Whether a ground station can arm in it."""
        return self not in (Mode.AUTO, Mode.RTL, Mode.LAND, Mode.BRAKE)
