"""What a vehicle does by itself: of each parameter that says so, the values that hold, return or land.

Every other value is a reason not to fly, those that no release known here has as well. PX4 1.15, Copter 4.5.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping


@dataclasses.dataclass(frozen=True)
class Action:
    """A parameter that chooses what a vehicle does.

    Attributes:
        name: Of the parameter.
        when: What it does that about.
        safe: Values that hold, return or land.
        remedy: What to set it to.
        unsafe: What the vehicle does with the other values.
    """

    name: str
    when: str
    safe: tuple[int, ...]
    remedy: str
    unsafe: Mapping[int, str]

    def problem(self, value: float | None) -> str | None:
        """Why a vehicle must not fly with a value; None: it may, or the value is not known."""
        if value is None or int(value) in self.safe:
            return None
        what = self.unsafe.get(int(value), "does something that is not known here")
        return f"{self.name} is {int(value)}: {self.when}, the vehicle {what}; set it to {self.remedy}"


_STOPS = "stops the motors in the air"
_BATTERY_TERMINATES = {5: _STOPS}

SETPOINTS_END = Action(
    "COM_OBL_RC_ACT",
    "when setpoints stop",
    (3, 4, 5),
    "5 (hold), 3 (return) or 4 (land)",
    {
        0: "switches to POSCTL, which without a transmitter descends slowly to the ground wherever it is",
        1: "switches to ALTCTL, which without a transmitter drifts with the wind",
        2: "switches to MANUAL, which without a transmitter falls",
        6: _STOPS,
        7: _STOPS,
    },
)
PX4_FENCE = Action(
    "GF_ACTION",
    "outside the fence",
    (2, 3, 5),
    "2 (hold), 3 (return) or 5 (land)",
    {0: "flies on: leaving it has no consequence", 1: "flies on: leaving it is only told", 4: _STOPS},
)
PX4_GROUND_STATION = Action(
    "NAV_DLL_ACT",
    "when nothing is heard from the ground any more",
    # Disabled: setpoints that end are noticed by themselves, and an uploaded mission comes to its end.
    (0, 1, 2, 3),
    "2 (return)",
    {5: _STOPS, 6: _STOPS},
)
COPTER_FENCE = Action(
    "FENCE_ACTION",
    "outside the fence",
    (1, 2, 3, 4, 5),
    "1 (return or land)",
    {0: "flies on: leaving it has no consequence"},
)
COPTER_GROUND_STATION = Action(
    "FS_GCS_ENABLE",
    "if this computer is lost",
    (1, 3, 4, 5, 6, 7),
    "1 (return)",
    {0: "stays where it is until its battery is empty", 2: "flies an uploaded mission on (or, by release, returns)"},
)
COPTER_BATTERY = (
    Action("BATT_FS_LOW_ACT", "on a low battery", (0, 1, 2, 3, 4, 6, 7), "2 (return)", _BATTERY_TERMINATES),
    Action("BATT_FS_CRT_ACT", "on a critical battery", (0, 1, 2, 3, 4, 6, 7), "1 (land)", _BATTERY_TERMINATES),
)
