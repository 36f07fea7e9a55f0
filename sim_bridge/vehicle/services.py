"""What both autopilots answer alike: parameters, plans, streams, PING, TIMESYNC, FTP."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

from sim_bridge.codec import Message, mavlink
from sim_bridge.vehicle.parameters import Parameters
from sim_bridge.vehicle.plan_items import Peer
from sim_bridge.vehicle.plan_storage import PlanStorage
from sim_bridge.vehicle.telemetry import Streams

Reply = tuple[int, list[Message]]
"""MAV_RESULT and what is said besides."""

_FTP_PAYLOAD_BYTES = 251
_NOWHERE = 2**31 - 1


@dataclasses.dataclass(frozen=True)
class Order:
    """A command, from COMMAND_LONG or COMMAND_INT.

    Attributes:
        command: MAV_CMD.
        params: p1 … p7; NaN: not given. Of COMMAND_INT p5 and p6 are degrees.
        peer: Who gave it.
        frame: MAV_FRAME of p5 … p7; COMMAND_LONG has none: home is set above sea level, all else is relative to it.
    """

    command: int
    params: tuple[float, float, float, float, float, float, float]
    peer: Peer
    frame: int

    @classmethod
    def from_message(cls, message: Message) -> Order | None:
        """Read a command; None: the message is none."""
        match message:
            case mavlink.MAVLink_command_long_message():
                p5, p6, p7 = message.param5, message.param6, message.param7
            case mavlink.MAVLink_command_int_message():
                p5 = math.nan if message.x == _NOWHERE else message.x * 1e-7
                p6 = math.nan if message.y == _NOWHERE else message.y * 1e-7
                p7 = message.z
            case _:
                return None
        params = (message.param1, message.param2, message.param3, message.param4, p5, p6, p7)
        peer = (message.get_srcSystem(), message.get_srcComponent())
        sets_home = message.command == mavlink.MAV_CMD_DO_SET_HOME
        unsaid = mavlink.MAV_FRAME_GLOBAL if sets_home else mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
        frame = getattr(message, "frame", unsaid)
        return cls(message.command, params, peer, frame)

    def whole(self, number: int) -> int:
        """Parameter p1 … p7 as a whole number; −1 where it is none."""
        value = self.params[number - 1]
        return round(value) if math.isfinite(value) else -1

    def given(self, number: int) -> float | None:
        """Parameter p1 … p7; None where it is not given."""
        value = self.params[number - 1]
        return value if math.isfinite(value) else None

    def ack(self, result: int, progress: int = 0) -> Message:
        """The answer to whoever gave it."""
        return mavlink.MAVLink_command_ack_message(self.command, result, progress, 0, *self.peer)


def status_texts(severity: int, text: str, text_id: int) -> list[Message]:
    """A line of text, in chunks of fifty bytes where it is longer."""
    data = text.encode()
    if len(data) <= 50:
        return [mavlink.MAVLink_statustext_message(severity, data)]
    chunks = [data[start : start + 50] for start in range(0, len(data), 50)]
    if len(chunks[-1]) == 50:
        chunks.append(b"")
    return [mavlink.MAVLink_statustext_message(severity, chunk, text_id, number) for number, chunk in enumerate(chunks)]


class Services:
    """The conversations that need no decision of the autopilot.

    Args:
        parameters: The vehicle's.
        storage: Its plans.
        streams: What it tells by itself.
        rates_hz: How often by default.
    """

    def __init__(
        self, parameters: Parameters, storage: PlanStorage, streams: Streams, rates_hz: dict[int, float]
    ) -> None:
        self.parameters = parameters
        self.storage = storage
        self.streams = streams
        self._rates_hz = rates_hz
        self._text_id = 0

    def say(self, severity: int, text: str) -> list[Message]:
        """A line of text, in one or more messages."""
        self._text_id = self._text_id % 65535 + 1
        return status_texts(severity, text, self._text_id)

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Answer a message for this vehicle, if it is one of these.

        Args:
            message: Any.
            now_s: Since boot.
        """
        match message:
            case mavlink.MAVLink_timesync_message():
                return [] if message.tc1 != 0 else [mavlink.MAVLink_timesync_message(int(now_s * 1e9), message.ts1)]
            case mavlink.MAVLink_ping_message():
                if message.target_system != 0:
                    return []
                peer = (message.get_srcSystem(), message.get_srcComponent())
                return [mavlink.MAVLink_ping_message(message.time_usec, message.seq, *peer)]
            case mavlink.MAVLink_file_transfer_protocol_message():
                return [_ftp_refusal(message)]
            case _:
                return self.parameters.receive(message) + self.storage.receive(message, now_s)

    def carry_out(self, order: Order, now_s: float, message: Callable[[int], Message | None]) -> Reply | None:
        """A command about messages; None: it is another.

        Args:
            order: Any.
            now_s: Since boot.
            message: Makes a message by its id; None: the vehicle has no such.
        """
        accepted, failed = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED
        wanted = order.whole(1)
        match order.command:
            case mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
                interval_us = order.params[1]
                if wanted == mavlink.MAVLINK_MSG_ID_HEARTBEAT or not math.isfinite(interval_us):
                    return failed, []
                if wanted not in self._rates_hz and message(wanted) is None:
                    return failed, []
                self.streams.set_interval(wanted, interval_us, self._rates_hz.get(wanted, 0.0), now_s)
                return accepted, []
            case mavlink.MAV_CMD_GET_MESSAGE_INTERVAL:
                interval = self.streams.interval_us(wanted)
                return accepted, [mavlink.MAVLink_message_interval_message(wanted & 0xFFFF, interval)]
            case mavlink.MAV_CMD_REQUEST_MESSAGE:
                asked = message(wanted)
                return (accepted, [asked]) if asked is not None else (mavlink.MAV_RESULT_DENIED, [])
            case mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
                asked = message(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
                return (accepted, [asked]) if asked is not None else (failed, [])
            case mavlink.MAV_CMD_GET_HOME_POSITION:
                asked = message(mavlink.MAVLINK_MSG_ID_HOME_POSITION)
                return (accepted, [asked]) if asked is not None else (failed, [])
            case _:
                return None


SERVED = (
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
)
"""Capabilities (MAV_PROTOCOL_CAPABILITY) that both autopilots tell of themselves."""


def version(capabilities: int, release: tuple[int, int, int], uid: int) -> Message:
    """AUTOPILOT_VERSION of a released firmware."""
    major, minor, patch = release
    software = major << 24 | minor << 16 | patch << 8 | mavlink.FIRMWARE_VERSION_TYPE_OFFICIAL
    none = [0] * 8
    return mavlink.MAVLink_autopilot_version_message(
        capabilities, software, 0, 0, 0, none, none, none, 0, 0, uid, [uid, *[0] * 17]
    )


def _ftp_refusal(message: Message) -> Message:
    """NAK with the sequence number and the opcode asked for: file not found, as where no such file is."""
    payload = bytes(message.payload)
    sequence = (int.from_bytes(payload[:2], "little") + 1) & 0xFFFF
    nak, reason = mavlink.MAV_FTP_OPCODE_NAK, mavlink.MAV_FTP_ERR_FILENOTFOUND
    # Session, opcode, size of the data, opcode asked for, burst, padding, offset (4), data.
    head = bytes([payload[2], nak, 1, payload[3], 0, 0, 0, 0, 0, 0, reason])
    peer = (message.get_srcSystem(), message.get_srcComponent())
    reply = sequence.to_bytes(2, "little") + head
    return mavlink.MAVLink_file_transfer_protocol_message(0, *peer, reply.ljust(_FTP_PAYLOAD_BYTES, b"\0"))
