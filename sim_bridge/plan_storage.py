"""Missions, fences and rally points on the vehicle's side: upload, download, clearing.

What differs between the autopilots is given: who asks for the first item how, how often a lost one is asked again, how
a stalled upload ends, and which items are refused. The old plan stays until a whole new one has arrived.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from sim_bridge.codec import Message, mavlink

Check = Callable[[int, Message], int]
"""From a plan's type and an item to MAV_MISSION_ACCEPTED or the reason to refuse it."""


@dataclasses.dataclass(frozen=True)
class Manners:
    """How an autopilot holds these conversations.

    Attributes:
        first_request_is_int: Whether the first item is asked for with MISSION_REQUEST_INT.
        later_requests_are_int: The others.
        retry_s: A lost item is asked for again after this long.
        give_up_s: An upload without progress ends after this long.
        gives_up_with_ack: Whether it then says so with MISSION_ACK (OPERATION_CANCELLED); else with a text.
        most_items: More are refused with NO_SPACE.
        check: Looks at each item.
    """

    first_request_is_int: bool
    later_requests_are_int: bool
    retry_s: float
    give_up_s: float
    gives_up_with_ack: bool
    most_items: int
    check: Check


@dataclasses.dataclass
class _Upload:
    kind: int
    count: int
    peer: tuple[int, int]
    items: list[Message]
    asked_s: float
    progressed_s: float


class PlanStorage:
    """The three plans of a vehicle.

    Args:
        manners: How its autopilot talks.
    """

    def __init__(self, manners: Manners) -> None:
        self._manners = manners
        self.plans: dict[int, list[Message]] = {
            mavlink.MAV_MISSION_TYPE_MISSION: [],
            mavlink.MAV_MISSION_TYPE_FENCE: [],
            mavlink.MAV_MISSION_TYPE_RALLY: [],
        }
        self.accepted: int | None = None
        """Type of the plan that was just replaced; whoever looks sets it back to None."""
        self._upload: _Upload | None = None

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Answer one message of the protocol; anything else is answered with nothing."""
        peer = (message.get_srcSystem(), message.get_srcComponent())
        match message:
            case mavlink.MAVLink_mission_count_message():
                return self._begin(message, peer, now_s)
            case mavlink.MAVLink_mission_item_int_message() | mavlink.MAVLink_mission_item_message():
                return self._take(message, peer, now_s)
            case mavlink.MAVLink_mission_request_list_message():
                kind = message.mission_type
                if kind not in self.plans:
                    return [_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
                return [mavlink.MAVLink_mission_count_message(*peer, len(self.plans[kind]), kind)]
            case mavlink.MAVLink_mission_request_int_message() | mavlink.MAVLink_mission_request_message():
                return self._give(message, peer)
            case mavlink.MAVLink_mission_clear_all_message():
                kinds = list(self.plans) if message.mission_type == 255 else [message.mission_type]
                for kind in kinds:
                    if kind not in self.plans:
                        return [_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
                    self.plans[kind] = []
                    self.accepted = kind
                return [_ack(peer, mavlink.MAV_MISSION_ACCEPTED, message.mission_type)]
            case mavlink.MAVLink_mission_ack_message():
                upload = self._upload
                if upload is not None and peer == upload.peer and message.type != mavlink.MAV_MISSION_ACCEPTED:
                    self._upload = None
                return []
            case _:
                return []

    def tick(self, now_s: float) -> list[Message]:
        """Ask again for what was lost, and end what stalled."""
        upload = self._upload
        if upload is None:
            return []
        if now_s - upload.progressed_s >= self._manners.give_up_s:
            self._upload = None
            if self._manners.gives_up_with_ack:
                return [_ack(upload.peer, mavlink.MAV_MISSION_OPERATION_CANCELLED, upload.kind)]
            return [mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_WARNING, b"Operation timeout")]
        if now_s - upload.asked_s >= self._manners.retry_s:
            upload.asked_s = now_s
            return [self._request(upload)]
        return []

    def _begin(self, message: Message, peer: tuple[int, int], now_s: float) -> list[Message]:
        kind = message.mission_type
        if kind not in self.plans:
            return [_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if self._upload is not None and self._upload.peer != peer:
            return [_ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        if message.count > self._manners.most_items:
            return [_ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind)]
        if message.count == 0:
            self._upload = None
            self.plans[kind] = []
            self.accepted = kind
            return [_ack(peer, mavlink.MAV_MISSION_ACCEPTED, kind)]
        self._upload = _Upload(kind, message.count, peer, [], now_s, now_s)
        return [self._request(self._upload)]

    def _take(self, message: Message, peer: tuple[int, int], now_s: float) -> list[Message]:
        upload = self._upload
        if upload is None or peer != upload.peer or message.mission_type != upload.kind:
            return []
        if message.seq != len(upload.items):
            # A repeated or early item: the one that is wanted is asked for by the retry.
            return []
        verdict = self._manners.check(upload.kind, message)
        if verdict != mavlink.MAV_MISSION_ACCEPTED:
            self._upload = None
            return [_ack(peer, verdict, upload.kind)]
        upload.items.append(message)
        upload.asked_s = upload.progressed_s = now_s
        if len(upload.items) < upload.count:
            return [self._request(upload)]
        self._upload = None
        self.plans[upload.kind] = upload.items
        self.accepted = upload.kind
        return [_ack(peer, mavlink.MAV_MISSION_ACCEPTED, upload.kind)]

    def _give(self, message: Message, peer: tuple[int, int]) -> list[Message]:
        kind, seq = message.mission_type, message.seq
        if kind not in self.plans or not 0 <= seq < len(self.plans[kind]):
            return [_ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)]
        item = self.plans[kind][seq]
        x, y = item_lat_lon_e7(item)
        return [
            mavlink.MAVLink_mission_item_int_message(
                *peer, seq, item.frame, item.command, 0, item.autocontinue,
                item.param1, item.param2, item.param3, item.param4, x, y, item.z, kind,
            )
        ]  # fmt: skip

    def _request(self, upload: _Upload) -> Message:
        seq = len(upload.items)
        as_int = self._manners.first_request_is_int if seq == 0 else self._manners.later_requests_are_int
        kind = mavlink.MAVLink_mission_request_int_message if as_int else mavlink.MAVLink_mission_request_message
        return kind(*upload.peer, seq, upload.kind)


def item_lat_lon_e7(item: Message) -> tuple[int, int]:
    """Latitude and longitude of a stored item, 1e-7 degrees."""
    if isinstance(item, mavlink.MAVLink_mission_item_int_message):
        return item.x, item.y
    return round(item.x * 1e7), round(item.y * 1e7)


def _ack(peer: tuple[int, int], result: int, kind: int) -> Message:
    return mavlink.MAVLink_mission_ack_message(*peer, result, kind)
