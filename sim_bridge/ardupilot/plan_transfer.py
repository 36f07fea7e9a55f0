"""ArduPilot's side of mission, fence and rally transfers: one conversation a kind, begun anew by whoever began it."""

from __future__ import annotations

import dataclasses

from sim_bridge.ardupilot.plans import MOST_ITEMS, check, fence_fault, kept
from sim_bridge.codec import Message, mavlink
from sim_bridge.vehicle.plan_items import Item, Peer
from sim_bridge.vehicle.plan_storage import PlanStorage, mission_ack, sender_of

_RETRY_S, _GIVE_UP_S = 1.0, 8.0
_ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
_FENCE = mavlink.MAV_MISSION_TYPE_FENCE
_NAMES = {
    mavlink.MAV_MISSION_TYPE_MISSION: "Mission",
    mavlink.MAV_MISSION_TYPE_FENCE: "Fence",
    mavlink.MAV_MISSION_TYPE_RALLY: "Rally",
}


@dataclasses.dataclass
class _Upload:
    kind: int
    count: int
    peer: Peer
    items: list[Item]
    asked_s: float
    heard_s: float


class PlanTransfer(PlanStorage):
    """The plans of an ArduPilot vehicle."""

    def __init__(self) -> None:
        super().__init__()
        self._uploads: dict[int, _Upload] = {}

    def forget_transfer(self) -> None:
        """As after a boot: plans stay, a transfer does not."""
        self._uploads.clear()

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Answer one message of the protocol that is for this vehicle; anything else is answered with nothing."""
        peer = sender_of(message)
        match message:
            case mavlink.MAVLink_mission_count_message():
                return self._begin(message, peer, now_s)
            case mavlink.MAVLink_mission_item_int_message() | mavlink.MAVLink_mission_item_message():
                return self._take(message, peer, now_s)
            case mavlink.MAVLink_mission_request_list_message():
                return self._list(peer, message.mission_type)
            case mavlink.MAVLink_mission_request_int_message():
                if message.mission_type in self._uploads:
                    return [mission_ack(peer, mavlink.MAV_MISSION_DENIED, message.mission_type)]
                return self._give(message, peer, as_int=True)
            case mavlink.MAVLink_mission_request_message():
                return self._give(message, peer, as_int=False)
            case mavlink.MAVLink_mission_clear_all_message():
                return self._clear(peer, message.mission_type)
            case _:
                return []

    def tick(self, now_s: float) -> list[Message]:
        """Ask again for what was lost, and end what stalled: with a text and an ack."""
        told: list[Message] = []
        for upload in list(self._uploads.values()):
            if now_s - upload.heard_s > _GIVE_UP_S:
                del self._uploads[upload.kind]
                told += [
                    _warning(f"{_NAMES[upload.kind]} upload timeout"),
                    mission_ack(upload.peer, mavlink.MAV_MISSION_OPERATION_CANCELLED, upload.kind),
                ]
            elif now_s - upload.asked_s > _RETRY_S:
                told.append(_request(upload, now_s))
        return told

    def _begin(self, message: Message, peer: Peer, now_s: float) -> list[Message]:
        kind, count = message.mission_type, message.count
        if kind not in self.plans:
            return [mission_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if kind in self._uploads and self._uploads[kind].peer != peer:
            return [mission_ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        if count > MOST_ITEMS[kind]:
            text = f"Only {MOST_ITEMS[kind]} items are supported"
            return [mission_ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind), _warning(text)]
        if kind != _FENCE:
            # The old plan gives way item by item; a fence does at the end.
            del self.plans[kind][count:]
        upload = _Upload(kind, count, peer, [], now_s, now_s)
        if count == 0:
            return self._complete(upload)
        self._uploads[kind] = upload
        return [_request(upload, now_s)]

    def _take(self, message: Message, peer: Peer, now_s: float) -> list[Message]:
        kind = message.mission_type
        if kind not in self.plans:
            return [mission_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        upload = self._uploads.get(kind)
        if upload is None:
            return [mission_ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
        if message.seq != len(upload.items):
            return [mission_ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)]
        if peer != upload.peer:
            return [mission_ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        item = Item.from_message(message)
        verdict = check(kind, item, upload.count)
        if verdict != _ACCEPTED:
            del self._uploads[kind]
            return [mission_ack(peer, verdict, kind)]
        upload.items.append(kept(kind, item))
        upload.heard_s = now_s
        if kind != _FENCE:
            self.plans[kind][message.seq : message.seq + 1] = upload.items[-1:]
        return [_request(upload, now_s)] if len(upload.items) < upload.count else self._complete(upload)

    def _complete(self, upload: _Upload) -> list[Message]:
        self._uploads.pop(upload.kind, None)
        fault = fence_fault(upload.items) if upload.kind == _FENCE else ""
        if fault:
            texts = [_warning(fault), _warning("Fence validation failed")]
            return [*texts, mission_ack(upload.peer, mavlink.MAV_MISSION_ERROR, upload.kind)]
        self._replace(upload.kind, upload.items)
        return [mission_ack(upload.peer, _ACCEPTED, upload.kind)]

    def _give(self, message: Message, peer: Peer, *, as_int: bool) -> list[Message]:
        kind, seq = message.mission_type, message.seq
        if kind not in self.plans:
            return []
        plan = self.plans[kind]
        if seq < len(plan):
            return [plan[seq].to_message(peer, seq, kind, as_int)]
        refusal = mission_ack(peer, mavlink.MAV_MISSION_ERROR, kind)
        if kind == mavlink.MAV_MISSION_TYPE_MISSION:
            # How many there are, for who does not know.
            return [mavlink.MAVLink_mission_count_message(*peer, len(plan), kind), refusal]
        return [refusal]

    def _list(self, peer: Peer, kind: int) -> list[Message]:
        if kind not in self.plans:
            return [mission_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if kind in self._uploads:
            return [mission_ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        return [mavlink.MAVLink_mission_count_message(*peer, len(self.plans[kind]), kind)]

    def _clear(self, peer: Peer, kind: int) -> list[Message]:
        if kind not in self.plans:
            return [mission_ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if kind in self._uploads:
            return [mission_ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
        self._replace(kind, [])
        return [mission_ack(peer, _ACCEPTED, kind)]


def _request(upload: _Upload, now_s: float) -> Message:
    upload.asked_s = now_s
    return mavlink.MAVLink_mission_request_message(*upload.peer, len(upload.items), upload.kind)


def _warning(text: str) -> Message:
    return mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_WARNING, text.encode())
