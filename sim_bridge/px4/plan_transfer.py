"""PX4's side of mission, fence and rally transfers: one conversation at a time, with one partner, for all kinds.

Answers go to the partner, whoever asked: to a second station that interferes there is mostly silence, and what is
refused it may end the partner's own transfer. A conversation ends with its last message or after five seconds without a
word; until then nothing else begins.
"""

from __future__ import annotations

import enum
import struct
import zlib

from sim_bridge.codec import Message, mavlink
from sim_bridge.px4.plans import MOST_ITEMS, check, kept
from sim_bridge.vehicle.plan_items import Item, Peer
from sim_bridge.vehicle.plan_storage import KINDS, PlanStorage, mission_ack, sender_of

_RETRY_S, _GIVE_UP_S = 0.25, 5.0
_ACCEPTED, _ERROR = mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_ERROR
_IDENTITY = struct.Struct("<HBB4f2if")


class State(enum.Enum):
    """Where the conversation stands."""

    IDLE = "idle"
    RECEIVING = "receiving"
    SENDING = "sending"


class PlanTransfer(PlanStorage):
    """The plans of a PX4 vehicle."""

    def __init__(self) -> None:
        super().__init__()
        self._ids = dict.fromkeys(KINDS, 0)
        self.forget_transfer()

    def forget_transfer(self) -> None:
        """As after a boot: plans stay, a transfer does not."""
        self._state = State.IDLE
        self._kind = mavlink.MAV_MISSION_TYPE_MISSION
        self._partner: Peer = (0, 0)
        self._seq = self._count = self._id = 0
        self._items: list[Item] = []
        self._int_mode = False
        self._blocked = False
        self._asked_s = self._heard_s = 0.0

    @property
    def busy(self) -> bool:
        """Whether something is transferred."""
        return self._state is not State.IDLE

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Answer one message of the protocol that is for this vehicle; anything else is answered with nothing."""
        match message:
            case mavlink.MAVLink_mission_count_message():
                return self._begin(message, now_s)
            case mavlink.MAVLink_mission_item_int_message() | mavlink.MAVLink_mission_item_message():
                self._int_mode = isinstance(message, mavlink.MAVLink_mission_item_int_message)
                return self._take(message, now_s)
            case mavlink.MAVLink_mission_request_list_message():
                return self._list(message, now_s)
            case mavlink.MAVLink_mission_request_int_message() | mavlink.MAVLink_mission_request_message():
                self._int_mode = isinstance(message, mavlink.MAVLink_mission_request_int_message)
                return self._give(message, now_s)
            case mavlink.MAVLink_mission_clear_all_message():
                return self._clear(message)
            case mavlink.MAVLink_mission_ack_message():
                return self._answered(message, now_s)
            case _:
                return []

    def tick(self, now_s: float) -> list[Message]:
        """Ask again for what was lost, and end what stalled: with a text, and no ack."""
        if self._state is State.RECEIVING and now_s - self._asked_s > _RETRY_S:
            return [self._request(now_s)]
        if self._state is not State.IDLE and now_s - self._heard_s > _GIVE_UP_S:
            self._end()
            return [_critical("Operation timeout")]
        return []

    # Upload.

    def _begin(self, message: Message, now_s: float) -> list[Message]:
        if self._state is State.SENDING:
            return [_critical("WPM: IGN MISSION_COUNT: Busy"), self._ack(_ERROR)]
        self._heard_s = now_s
        if self._state is State.RECEIVING:
            if self._seq > 0:
                return [_critical("WPM: REJ. CMD: Busy"), self._ack(_ERROR)]
            # Taken for a repetition, as if the request for the first item had been lost: nothing in it is looked at.
            return [self._request(now_s)]
        if self._blocked:
            return [self._ack(_ERROR)]
        self._kind = message.mission_type
        if message.count > MOST_ITEMS.get(self._kind, 0):
            return [self._ack(mavlink.MAV_MISSION_NO_SPACE)]
        if message.count == 0:
            self._keep([], 0)
            return [self._ack(_ACCEPTED)]
        self._state, self._blocked = State.RECEIVING, True
        self._partner, self._count = sender_of(message), message.count
        self._seq, self._id, self._items = 0, 0, []
        return [self._request(now_s)]

    def _take(self, message: Message, now_s: float) -> list[Message]:
        if message.mission_type != self._kind:
            return [self._ack(_ERROR)]
        match self._state:
            case State.IDLE if self._seq == message.seq + 1:
                # The last item again: its acknowledgement was lost.
                return [self._ack(_ACCEPTED)]
            case State.IDLE:
                return [_critical("IGN MISSION_ITEM: No transfer"), self._ack(_ERROR)]
            case State.SENDING:
                return [_critical("IGN MISSION_ITEM: Busy"), self._ack(_ERROR)]
            case State.RECEIVING:
                self._heard_s = now_s
                return self._add(message, now_s) if message.seq == self._seq else []

    def _add(self, message: Message, now_s: float) -> list[Message]:
        item = Item.from_message(message)
        verdict = check(self._kind, item)
        if verdict != _ACCEPTED:
            self._end()
            told = [] if verdict == _ERROR else [_critical("IGN MISSION_ITEM: Invalid item")]
            return [*told, self._ack(verdict)]
        self._id = zlib.crc32(_identity(item), self._id)
        self._items.append(kept(self._kind, item))
        self._seq += 1
        if self._seq < self._count:
            return [self._request(now_s)]
        self._end()
        self._keep(self._items, self._id)
        return [self._ack(_ACCEPTED)]

    def _keep(self, items: list[Item], identity: int) -> None:
        """Make a plan the one that is held; the one that is held already changes nothing."""
        if self._kind in KINDS and (not items or identity != self._ids[self._kind]):
            self._ids[self._kind] = identity
            self._replace(self._kind, items)

    def _answered(self, message: Message, now_s: float) -> list[Message]:
        """The partner ends a transfer, or refuses the form it was asked in, as mavsdk does with MISSION_REQUEST."""
        if sender_of(message) != self._partner:
            return [_critical("REJ. WP CMD: partner id mismatch")]
        match self._state, message.type:
            case State.SENDING, _ if message.mission_type == self._kind:
                self._state = State.IDLE
            case State.RECEIVING, mavlink.MAV_MISSION_OPERATION_CANCELLED:
                self._end()
            case State.RECEIVING, mavlink.MAV_MISSION_UNSUPPORTED:
                self._int_mode = not self._int_mode
                return [self._request(now_s)]
            case _:
                pass
        return []

    # Download.

    def _list(self, message: Message, now_s: float) -> list[Message]:
        if self._seq == len(self._held):
            # Everything was sent; also an upload that has come just so far is taken for it, and ends here.
            self._state = State.IDLE
        if not (self._state is State.IDLE or (self._state is State.SENDING and message.mission_type == self._kind)):
            text = b"Mission download request ignored, already active"
            return [mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_INFO, text)]
        self._state, self._heard_s = State.SENDING, now_s
        self._kind, self._partner, self._seq = message.mission_type, sender_of(message), 0
        self._count = len(self._held)
        return [mavlink.MAVLink_mission_count_message(*self._partner, self._count, self._kind)]

    def _give(self, message: Message, now_s: float) -> list[Message]:
        if sender_of(message) != self._partner:
            return [_critical("WPM: REJ. CMD: partner id mismatch")]
        if self._state is State.RECEIVING:
            return [_critical("WPM: REJ. CMD: Busy")]
        if self._state is State.IDLE or message.mission_type != self._kind:
            return []
        self._heard_s = now_s
        expected = self._seq < self._count and message.seq == self._seq
        if not (expected or message.seq == self._seq - 1) or message.seq >= len(self._held):
            self._state = State.IDLE
            return [self._ack(_ERROR), _critical("WPM: REJ. CMD: Req. WP was unexpected")]
        self._seq += expected
        return [self._held[message.seq].to_message(self._partner, message.seq, self._kind, self._int_mode)]

    def _clear(self, message: Message) -> list[Message]:
        if self._state is not State.IDLE:
            return [_critical("WPM: IGN CLEAR CMD: Busy")]
        wanted = message.mission_type
        for self._kind in KINDS if wanted == mavlink.MAV_MISSION_TYPE_ALL else (wanted,):
            self._keep([], 0)
        self._kind = wanted
        return [self._ack(_ACCEPTED)]

    # Helpers.

    @property
    def _held(self) -> list[Item]:
        return self.plans.get(self._kind, [])

    def _end(self) -> None:
        self._state, self._blocked = State.IDLE, False

    def _ack(self, result: int) -> Message:
        return mission_ack(self._partner, result, self._kind)

    def _request(self, now_s: float) -> Message:
        self._asked_s = now_s
        form = mavlink.MAVLink_mission_request_message
        if self._int_mode:
            form = mavlink.MAVLink_mission_request_int_message
        return form(*self._partner, self._seq, self._kind)


def _identity(item: Item) -> bytes:
    place = (item.latitude_e7, item.longitude_e7, item.altitude_m)
    return _IDENTITY.pack(item.command, item.frame, item.autocontinue, *item.params, *place)


def _critical(text: str) -> Message:
    return mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_CRITICAL, text.encode())
