"""What a vehicle is told when the flight's own loop has failed and nobody will watch it any more."""

from __future__ import annotations

import time
from collections.abc import Callable

from mission.executive.phases import AIRBORNE, Phase
from sim_bridge.link.client import Link
from sim_bridge.state import Command, CommandDone

_ANSWER_HOST_S = 10.0
_WAIT_HOST_S = 0.1


def last_order(phase: Phase) -> Command | None:
    """What fits what the flight was doing; None: the vehicle is on the ground, or somebody else has it."""
    match phase:
        case Phase.ARMING:
            return Command.DISARM
        case Phase.TAKING_OFF | Phase.LANDING:
            return Command.LAND
        case _:
            return Command.RETURN if phase in AIRBORNE else None


def give_last_order(link: Link, phase: Phase, told: Callable[[CommandDone], None]) -> None:
    """Have the vehicle return by itself; where it refuses, or does not answer, land.

    Args:
        link: The vehicle.
        phase: What the flight was doing.
        told: Told of each answer.

    Raises:
        LinkError: The vehicle was never heard.
    """
    order = last_order(phase)
    if order is None:
        return
    link.withdraw()
    for command in dict.fromkeys((order, Command.LAND)):
        link.request(command)
        done = _answer(link, command)
        told(done)
        if done.accepted:
            return


def _answer(link: Link, command: Command) -> CommandDone:
    until_s = time.monotonic() + _ANSWER_HOST_S
    while time.monotonic() < until_s:
        for timed in link.events(_WAIT_HOST_S):
            if isinstance(timed.event, CommandDone) and timed.event.command is command:
                return timed.event
    return CommandDone(command, False, "not answered")
