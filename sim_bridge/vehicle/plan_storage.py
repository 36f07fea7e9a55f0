"""Missions, fences and rally points on the vehicle's side: upload, download, clearing.

What differs between the autopilots is given: who asks for items how, how often a lost one is asked again, how a stalled
upload ends, which items are refused, and what becomes of an item that is kept.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

from sim_bridge.codec import Message, mavlink
from sim_bridge.vehicle.plan_items import Item, Peer

KINDS = (mavlink.MAV_MISSION_TYPE_MISSION, mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY)
_ACCEPTED = mavlink.MAV_MISSION_ACCEPTED


@dataclasses.dataclass(frozen=True)
class Manners:
    """How an autopilot holds these conversations.

    Attributes:
        asks_int: Whether it comes to ask with MISSION_REQUEST_INT once it was sent a MISSION_ITEM_INT; until then, and
            without this always, it asks with MISSION_REQUEST.
        retry_s: A lost item is asked for again after this long.
        give_up_s: An upload without a word from the sender ends after this long.
        gives_up_with_ack: Whether it then says so with MISSION_ACK (OPERATION_CANCELLED); else with a text.
        busy: Answer to a second one who wants to upload.
        out_of_turn: Answer to an item that was not asked for; None: none.
        repeats_last_ack: Whether a last item that comes again is acknowledged again (its first ack was lost).
        replaces_in_place: Whether the old mission gives way item by item; else it stays until the new one is whole.
        most_items: By kind of plan; more are refused.
        check: From a kind and an item to MAV_MISSION_ACCEPTED or the reason to refuse it.
        kept: What is kept of an item.
    """

    asks_int: bool
    retry_s: float
    give_up_s: float
    gives_up_with_ack: bool
    busy: int
    out_of_turn: int | None
    repeats_last_ack: bool
    replaces_in_place: bool
    most_items: Mapping[int, int]
    check: Callable[[int, Item], int]
    kept: Callable[[int, Item], Item]


@dataclasses.dataclass
class _Upload:
    kind: int
    count: int
    peer: Peer
    items: list[Item]
    asked_s: float
    heard_s: float


class PlanStorage:
    """The three plans of a vehicle.

    Args:
        manners: How its autopilot talks.
    """

    def __init__(self, manners: Manners) -> None:
        self._manners = manners
        self.plans: dict[int, list[Item]] = {kind: [] for kind in KINDS}
        self._upload: _Upload | None = None
        self._int_mode = False
        self._finished: tuple[Peer, int, int] | None = None
        self._changed: list[int] = []

    @property
    def mission(self) -> list[Item]:
        """Items of the mission."""
        return self.plans[mavlink.MAV_MISSION_TYPE_MISSION]

    @property
    def fence(self) -> list[Item]:
        """Items of the fence."""
        return self.plans[mavlink.MAV_MISSION_TYPE_FENCE]

    def changed(self) -> list[int]:
        """Kinds of plans that became others since this was last asked."""
        kinds, self._changed = self._changed, []
        return kinds

    def forget_transfer(self) -> None:
        """As after a boot: plans stay, a transfer does not."""
        self._upload = self._finished = None
        self._int_mode = False

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Answer one message of the protocol; anything else is answered with nothing."""
        peer = (message.get_srcSystem(), message.get_srcComponent())
        match message:
            case mavlink.MAVLink_mission_count_message():
                return self._begin(message, peer, now_s)
            case mavlink.MAVLink_mission_item_int_message() | mavlink.MAVLink_mission_item_message():
                return self._take(message, peer, now_s)
            case mavlink.MAVLink_mission_request_list_message():
                return self._count(peer, message.mission_type)
            case mavlink.MAVLink_mission_request_int_message():
                return self._give(message, peer, as_int=True)
            case mavlink.MAVLink_mission_request_message():
                return self._give(message, peer, as_int=False)
            case mavlink.MAVLink_mission_clear_all_message():
                return self._clear(peer, message.mission_type)
            case mavlink.MAVLink_mission_ack_message():
                return self._answered(peer, message.type, now_s)
            case _:
                return []

    def tick(self, now_s: float) -> list[Message]:
        """Ask again for what was lost, and end what stalled."""
        upload = self._upload
        if upload is None:
            return []
        if now_s - upload.heard_s > self._manners.give_up_s:
            self._upload = None
            if self._manners.gives_up_with_ack:
                return [_ack(upload.peer, mavlink.MAV_MISSION_OPERATION_CANCELLED, upload.kind)]
            return [mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_CRITICAL, b"Operation timeout")]
        if now_s - upload.asked_s > self._manners.retry_s:
            upload.asked_s = now_s
            return [self._request(upload)]
        return []

    def _begin(self, message: Message, peer: Peer, now_s: float) -> list[Message]:
        kind, count, upload = message.mission_type, message.count, self._upload
        if kind not in self.plans:
            return [_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if upload is not None and (upload.peer != peer or (upload.items and not self._manners.replaces_in_place)):
            return [_ack(peer, self._manners.busy, kind)]
        self._finished = None
        if count > self._manners.most_items[kind]:
            return [_ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind)]
        if self._in_place(kind):
            del self.plans[kind][count:]
        if count == 0:
            self._upload = None
            self._replace(kind, [])
            return [_ack(peer, _ACCEPTED, kind)]
        self._upload = _Upload(kind, count, peer, [], now_s, now_s)
        return [self._request(self._upload)]

    def _take(self, message: Message, peer: Peer, now_s: float) -> list[Message]:
        self._int_mode = isinstance(message, mavlink.MAVLink_mission_item_int_message)
        upload, manners = self._upload, self._manners
        if upload is None:
            again = self._finished == (peer, message.mission_type, message.seq)
            return [_ack(peer, _ACCEPTED, message.mission_type)] if again and manners.repeats_last_ack else []
        if peer != upload.peer or message.mission_type != upload.kind:
            return [_ack(peer, manners.busy, message.mission_type)]
        if message.seq != len(upload.items):
            upload.heard_s = now_s
            return [] if manners.out_of_turn is None else [_ack(peer, manners.out_of_turn, upload.kind)]
        item = Item.from_message(message)
        verdict = manners.check(upload.kind, item)
        if verdict != _ACCEPTED:
            self._upload = None
            return [_ack(peer, verdict, upload.kind)]
        upload.items.append(manners.kept(upload.kind, item))
        upload.asked_s = upload.heard_s = now_s
        if self._in_place(upload.kind):
            self.plans[upload.kind][message.seq : message.seq + 1] = upload.items[-1:]
        if len(upload.items) < upload.count:
            return [self._request(upload)]
        self._upload = None
        self._finished = (peer, upload.kind, message.seq)
        self._replace(upload.kind, upload.items)
        return [_ack(peer, _ACCEPTED, upload.kind)]

    def _answered(self, peer: Peer, result: int, now_s: float) -> list[Message]:
        """A sender ends its upload, or refuses the form it was asked in, as mavsdk does with MISSION_REQUEST."""
        upload = self._upload
        if upload is None or peer != upload.peer:
            return []
        match result:
            case mavlink.MAV_MISSION_OPERATION_CANCELLED:
                self._upload = None
            case mavlink.MAV_MISSION_UNSUPPORTED if self._manners.asks_int:
                self._int_mode = not self._int_mode
                upload.asked_s = now_s
                return [self._request(upload)]
            case _:
                pass
        return []

    def _give(self, message: Message, peer: Peer, *, as_int: bool) -> list[Message]:
        kind, seq = message.mission_type, message.seq
        if self._upload is not None:
            return [_ack(peer, self._manners.busy, kind)]
        if kind not in self.plans or not 0 <= seq < len(self.plans[kind]):
            return [_ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)]
        return [self.plans[kind][seq].to_message(peer, seq, kind, as_int)]

    def _count(self, peer: Peer, kind: int) -> list[Message]:
        if kind not in self.plans:
            return [_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if self._upload is not None:
            return [_ack(peer, self._manners.busy, kind)]
        return [mavlink.MAVLink_mission_count_message(*peer, len(self.plans[kind]), kind)]

    def _clear(self, peer: Peer, wanted: int) -> list[Message]:
        kinds = KINDS if wanted == mavlink.MAV_MISSION_TYPE_ALL else (wanted,)
        if not set(kinds) <= set(KINDS):
            return [_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, wanted)]
        if self._upload is not None:
            return [_ack(peer, self._manners.busy, wanted)]
        for kind in kinds:
            self._replace(kind, [])
        return [_ack(peer, _ACCEPTED, wanted)]

    def _replace(self, kind: int, items: list[Item]) -> None:
        self.plans[kind] = items
        self._changed.append(kind)

    def _in_place(self, kind: int) -> bool:
        return self._manners.replaces_in_place and kind == mavlink.MAV_MISSION_TYPE_MISSION

    def _request(self, upload: _Upload) -> Message:
        as_int = self._manners.asks_int and self._int_mode
        message = mavlink.MAVLink_mission_request_int_message if as_int else mavlink.MAVLink_mission_request_message
        return message(*upload.peer, len(upload.items), upload.kind)


def _ack(peer: Peer, result: int, kind: int) -> Message:
    return mavlink.MAVLink_mission_ack_message(*peer, result, kind)
