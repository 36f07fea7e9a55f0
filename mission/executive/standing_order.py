"""The command that belongs to a phase: given when it is due, and again until the vehicle takes it."""

from __future__ import annotations

from mission.executive import readings
from mission.executive.events import Order
from mission.executive.known_vehicle import KnownVehicle
from mission.executive.phases import Phase, order_of
from mission.executive.stay import Stay
from sim_bridge.state import Command, CommandDone, VehicleState

STREAM_FIRST_S = 1.0
"""A vehicle must hear setpoints for this long before it is asked to follow them."""
_RETRY_S = 2.0
_ANSWER_S = 15.0
"""A command is answered within this, one way or the other; after it, it is asked again."""
_DISARM_AFTER_S = 5.0
_REFUSALS = 3


class StandingOrder:
    """What the vehicle is asked for in the present phase.

    Args:
        takeoff_altitude_m: Height of the end of the climb above where the vehicle stands.
        patience: Flight seconds a host second, for answers that take the host's time.
    """

    def __init__(self, takeoff_altitude_m: float, patience: float) -> None:
        self._takeoff_altitude_m = takeoff_altitude_m
        self._patience = patience
        self.begin()

    def begin(self) -> None:
        """A new phase: nothing was asked for in it yet."""
        self._ordered_s: float | None = None
        self._open = False
        self._refusal = ""
        self._refusals = 0
        self.taken_s: float | None = None

    def due(self, stay: Stay, vehicle: KnownVehicle, now_s: float) -> Order | None:
        """The order to give now; None: there is none, it was given a moment ago, or it is obeyed."""
        command, state = order_of(stay.phase), vehicle.state
        if command is None or state is None:
            return None
        if stay.phase in (Phase.LANDING, Phase.VEHICLE_RETURN) and vehicle.grounded_s(now_s) > _DISARM_AFTER_S:
            command = Command.DISARM
        if command is Command.FOLLOW_SETPOINTS and stay.lasted_s(now_s) < STREAM_FIRST_S:
            return None
        wait_s = _ANSWER_S * self._patience if self._open else _RETRY_S
        recent = self._ordered_s is not None and now_s - self._ordered_s < wait_s
        # That it is armed may not be shown yet.
        unsure = stay.phase is Phase.DISARMING and self.taken_s is None
        if recent or (readings.obeyed(command, state) and not unsure):
            return None
        self._open, self._ordered_s = True, now_s
        return Order(command, self._takeoff_altitude_m if command is Command.TAKE_OFF else None)

    @property
    def refused(self) -> bool:
        """Whether the vehicle answered time and again that it does not do it; a lost answer is none."""
        return self._refusals >= _REFUSALS

    def seen(self, command: Command, state: VehicleState, now_s: float) -> None:
        """Note that an order is taken where the vehicle does what it asks for, whether or not an answer came."""
        if self.taken_s is None and readings.obeyed(command, state):
            self.taken_s = now_s

    def answered(self, done: CommandDone, phase: Phase, now_s: float) -> bool:
        """Take in how a command ended.

        Returns:
            Whether it was refused for a reason that was not given in this phase before.
        """
        if done.command in (order_of(phase), Command.DISARM):
            self._open, self._ordered_s = False, now_s
            self.taken_s = now_s if done.accepted else None
        if done.command is order_of(phase) and done.answered and not done.accepted:
            self._refusals += 1
        if done.accepted or done.reason == self._refusal:
            return False
        self._refusal = done.reason
        return True
