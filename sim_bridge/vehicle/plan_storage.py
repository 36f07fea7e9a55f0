"""Missions, fences and rally points on the vehicle's side: what is held, and what both autopilots' protocols share.

How they are talked about differs from the ground up: `sim_bridge.px4.plan_transfer` holds one conversation for all
kinds, `sim_bridge.ardupilot.plan_transfer` one for each.
"""

from __future__ import annotations

import abc

from sim_bridge.codec import Message, mavlink
from sim_bridge.vehicle.plan_items import Item, Peer

KINDS = (mavlink.MAV_MISSION_TYPE_MISSION, mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY)


class PlanStorage(abc.ABC):
    """The three plans of a vehicle."""

    def __init__(self) -> None:
        self.plans: dict[int, list[Item]] = {kind: [] for kind in KINDS}
        self._changed: list[int] = []

    @property
    def mission(self) -> list[Item]:
        """Items of the mission."""
        return self.plans[mavlink.MAV_MISSION_TYPE_MISSION]

    @property
    def fence(self) -> list[Item]:
        """Items of the fence."""
        return self.plans[mavlink.MAV_MISSION_TYPE_FENCE]

    @property
    def rally(self) -> list[Item]:
        """Rally points."""
        return self.plans[mavlink.MAV_MISSION_TYPE_RALLY]

    def changed(self) -> list[int]:
        """Kinds of plans that became others since this was last asked."""
        kinds, self._changed = self._changed, []
        return kinds

    def _replace(self, kind: int, items: list[Item]) -> None:
        self.plans[kind] = items
        self._changed.append(kind)

    @abc.abstractmethod
    def forget_transfer(self) -> None:
        """As after a boot: plans stay, a transfer does not."""

    @abc.abstractmethod
    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Answer one message of the protocol that is for this vehicle; anything else is answered with nothing."""

    @abc.abstractmethod
    def tick(self, now_s: float) -> list[Message]:
        """Ask again for what was lost, and end what stalled."""


def sender_of(message: Message) -> Peer:
    """Who sent it."""
    return message.get_srcSystem(), message.get_srcComponent()


def mission_ack(peer: Peer, result: int, kind: int) -> Message:
    """MISSION_ACK."""
    return mavlink.MAVLink_mission_ack_message(*peer, result, kind)
