"""The vehicle's side of MAVLink: a state machine without sockets or clocks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, TypeVar

from sim_bridge.codec import Message
from sim_bridge.state import FlightMode
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.services import Services

Mode = TypeVar("Mode")


class VehicleAutopilot(Protocol):
    """One built-in vehicle; implemented by `sim_bridge.px4.vehicle` and `sim_bridge.ardupilot.vehicle`, each final.

    All times are the world's, in seconds; what the vehicle tells counts from its own boot.
    """

    body: Body
    services: Services
    refusal: str
    """Why arming is refused, whatever else is well; empty: it is not."""

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Take one message in and answer it.

        Args:
            message: From any sender; what is not for this vehicle is not obeyed.
            now_s: Now.
        """
        ...

    def tick(self, now_s: float) -> list[Message]:
        """Move until now, and tell what is due."""
        ...

    def follows_setpoints(self) -> bool:
        """Whether the vehicle is flown by setpoints: a simulator that runs faster than real time waits for them."""
        ...

    def reboot(self, now_s: float, outage_s: float, *, recovers_in_air: bool) -> None:
        """Start anew: parameters and plans stay, everything else is forgotten.

        Args:
            now_s: Now.
            outage_s: How long nothing is said or controlled.
            recovers_in_air: Whether the motors come back where they ran, and the vehicle lands by itself.
        """
        ...

    def pilot_switches(self, mode: FlightMode) -> list[Message]:
        """A pilot takes the transmitter, sticks centred, and chooses a mode.

        Raises:
            ValueError: The autopilot has no such mode.
        """
        ...


def switched_to(modes: Mapping[FlightMode, Mode], wanted: FlightMode, autopilot: str) -> Mode:
    """The mode that a position of a pilot's switch stands for.

    Raises:
        ValueError: The autopilot has no such mode.
    """
    if wanted not in modes:
        known = ", ".join(one.value for one in modes)
        raise ValueError(f"a pilot cannot switch {autopilot} to {wanted.value}: write {known}")
    return modes[wanted]
