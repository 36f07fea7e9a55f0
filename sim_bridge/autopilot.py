"""The vehicle's side of MAVLink: a state machine without sockets or clocks."""

from __future__ import annotations

from typing import Protocol

from sim_bridge.body import Body
from sim_bridge.codec import Message


class VehicleAutopilot(Protocol):
    """One built-in vehicle; implemented by `sim_bridge.px4` and `sim_bridge.ardupilot`, each final."""

    body: Body

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Take one message in and answer it.

        Args:
            message: From any sender; what is not for this vehicle is not answered.
            now_s: Vehicle time since boot.
        """
        ...

    def tick(self, now_s: float) -> list[Message]:
        """Move until now, and tell what is due."""
        ...

    def streamed_to_s(self) -> float | None:
        """Vehicle time of the last setpoint while one is being followed; None: none is.

        A simulator that runs faster than real time does not run ahead of it.
        """
        ...
