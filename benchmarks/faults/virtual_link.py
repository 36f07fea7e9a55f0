"""A link without sockets, threads or a clock: what mavsdk does for a flight, in virtual time.

Commands are repeated until they are acknowledged, as mavsdk does it (every half second, three times); setpoints go out
when they are given and are repeated at 20 Hz until the stream is closed. What passes is guarded and understood by the
same code as in a real flight.
"""

from __future__ import annotations

import dataclasses
import math
import os

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.dialects import Autopilot
from sim_bridge.frames import VehicleFrame
from sim_bridge.link.commands import OWN_COMPONENT, OWN_SYSTEM, STREAMS_HZ
from sim_bridge.link.guard import Guard
from sim_bridge.link.telemetry import Heard, Telemetry
from sim_bridge.state import Command, CommandDone, FlightMode, GeodeticPoint, Setpoint, VehicleState, Waiting
from sim_bridge.station import Station

ATTEMPTS = 3
ATTEMPT_S = 0.5
REPEAT_S = 0.05
HEARTBEAT_S = 1.0
SHOWN_S = 3.0
ASK_AGAIN_S = 5.0


@dataclasses.dataclass
class _Conversation:
    """A command that is not answered yet.

    Attributes:
        command: What was asked for; None: a message rate.
        steps: MAVLink commands to get through, in order.
        attempts: How often the first of them was sent.
        sent_s: When.
        waits_for: A mode that must be shown before it goes on.
    """

    command: Command | None
    steps: list[tuple[int, tuple[float, ...]]]
    attempts: int = 0
    sent_s: float = -math.inf
    waits_for: FlightMode | None = None


class VirtualLink:
    """The flight client of one virtual vehicle.

    Args:
        station: The vehicle and its line.
        autopilot: Whose dialect it speaks.
        origin: The mission's origin.
    """

    def __init__(self, station: Station, autopilot: Autopilot, origin: GeodeticPoint) -> None:
        self.autopilot = autopilot
        self.texts: list[tuple[float, str]] = []
        self._station = station
        self._frame = VehicleFrame(origin)
        self._guard = Guard(OWN_SYSTEM, OWN_COMPONENT, 1)
        self._telemetry = Telemetry(self._frame)
        self._codec = mavlink.MAVLink(None, OWN_SYSTEM, OWN_COMPONENT)
        self._talk: list[_Conversation] = []
        self._heard: list[Heard | CommandDone] = []
        self._stream: Setpoint | None = None
        self.setpoint_s = -math.inf
        """When the last setpoint left."""
        self._heartbeat_s = -math.inf
        self._waits = True
        self._asked_streams_s = -math.inf

    def request(self, command: Command, altitude_m: float | None, now_s: float) -> None:
        """Give a command; its answer comes among the events."""
        self._talk.append(_Conversation(command, self._steps(command, altitude_m)))

    def withdraw(self) -> None:
        """Give none of the commands that were not begun yet."""
        self._talk = [talk for talk in self._talk if talk.attempts or talk.waits_for or talk.command is None]

    def stream(self, setpoint: Setpoint, now_s: float) -> None:
        """Send a setpoint now, and again until the next one."""
        self._stream = setpoint
        self._send_setpoint(now_s)

    def close_stream(self) -> None:
        """Let no setpoint out any more."""
        self._stream = None

    def advance(self, now_s: float) -> list[Heard | CommandDone]:
        """Let time pass: what was heard, and what became of commands."""
        if now_s - self._heartbeat_s >= HEARTBEAT_S:
            self._heartbeat_s = now_s
            self._send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), now_s)
        if self._stream is not None and now_s - self.setpoint_s >= REPEAT_S:
            self._send_setpoint(now_s)
        if self._waits and not self._talk and now_s - self._asked_streams_s > ASK_AGAIN_S:
            self._ask_for_streams(now_s)
        self._converse(now_s)
        for datagram in self._station.advance(now_s):
            for accepted in self._guard.accept(datagram):
                self._take(accepted.message, now_s)
        heard, self._heard = self._heard, []
        return heard

    def _take(self, message, now_s: float) -> None:
        if message.get_type() == "COMMAND_ACK" and message.target_system in (0, OWN_SYSTEM):
            self._acknowledged(message, now_s)
        for event in self._telemetry.receive(message):
            text = getattr(event, "text", None)
            if text is not None:
                self.texts.append((now_s, text))
            if isinstance(event, VehicleState | Waiting):
                self._waits = isinstance(event, Waiting)
            self._heard.append(event)

    def _ask_for_streams(self, now_s: float) -> None:
        """What the vehicle does not send by itself; asked again when it was restarted and has forgotten."""
        self._asked_streams_s = now_s
        if self.autopilot is Autopilot.ARDUPILOT:
            interval = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
            rates = [(interval, (float(number), 1e6 / rate)) for number, rate in STREAMS_HZ.items()]
            self._talk += [_Conversation(None, [rate]) for rate in rates]

    def _converse(self, now_s: float) -> None:
        if not self._talk:
            return
        talk = self._talk[0]
        if talk.waits_for is not None:
            if self._telemetry.mode is talk.waits_for:
                talk.waits_for = None
            elif now_s - talk.sent_s > SHOWN_S:
                self._end(False, "GUIDED was accepted but did not stay")
            return
        if now_s - talk.sent_s < ATTEMPT_S:
            return
        if talk.attempts >= ATTEMPTS:
            self._end(False, "timeout", answered=False)
            return
        number, params = talk.steps[0]
        values = (*params, *(0.0,) * (7 - len(params)))
        self._send(mavlink.MAVLink_command_long_message(1, 1, number, talk.attempts, *values), now_s)
        talk.attempts, talk.sent_s = talk.attempts + 1, now_s

    def _acknowledged(self, ack, now_s: float) -> None:
        if not self._talk or not self._talk[0].attempts or self._talk[0].steps[0][0] != ack.command:
            return
        talk = self._talk[0]
        if ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            talk.sent_s = now_s
        elif ack.result != mavlink.MAV_RESULT_ACCEPTED and talk.command is not None:
            said = [text for at, text in self.texts if at > now_s - 3.0]
            self._end(False, f"result {ack.result} ({'; '.join(said)})")
        else:
            number, _ = talk.steps.pop(0)
            talk.attempts, talk.sent_s = 0, -math.inf
            guided = self.autopilot is Autopilot.ARDUPILOT and number == mavlink.MAV_CMD_DO_SET_MODE and talk.steps
            if guided:
                talk.waits_for, talk.sent_s = FlightMode.EXTERNAL, now_s
            if not talk.steps:
                self._end(True, "")

    def _end(self, accepted: bool, reason: str, answered: bool = True) -> None:
        talk = self._talk.pop(0)
        if talk.command is not None:
            self._heard.append(CommandDone(talk.command, accepted, reason, answered))

    def _steps(self, command: Command, altitude_m: float | None) -> list[tuple[int, tuple[float, ...]]]:
        px4 = self.autopilot is Autopilot.PX4
        set_mode, arm = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM
        match command:
            case Command.ARM:
                return [(arm, (1.0,))] if px4 else [(set_mode, (1.0, 4.0)), (arm, (1.0,))]
            case Command.DISARM:
                return [(arm, (0.0,))]
            case Command.TAKE_OFF:
                height = altitude_m or 0.0
                home = self._telemetry.home
                nan = math.nan
                if px4:
                    above_sea_m = (home.altitude_amsl_m if home else 0.0) + height
                    return [(mavlink.MAV_CMD_NAV_TAKEOFF, (nan, nan, nan, nan, nan, nan, above_sea_m))]
                return [(mavlink.MAV_CMD_NAV_TAKEOFF, (0.0,) * 6 + (height,))]
            case Command.FOLLOW_SETPOINTS:
                return [(set_mode, (1.0, 6.0) if px4 else (1.0, 4.0))]
            case Command.HOLD:
                return [(set_mode, (1.0, 4.0, 3.0) if px4 else (1.0, 17.0))]
            case Command.RETURN:
                return [(set_mode, (1.0, 4.0, 5.0) if px4 else (1.0, 6.0))]
            case Command.LAND:
                return [(mavlink.MAV_CMD_NAV_LAND, ())]
            case Command.START_MISSION:
                return [(set_mode, (1.0, 4.0, 4.0) if px4 else (1.0, 3.0))]

    def _send_setpoint(self, now_s: float) -> None:
        origin = self._telemetry.origin
        if self._stream is None or origin is None:
            return
        self.setpoint_s = now_s
        position, velocity, acceleration, yaw_deg = self._frame.setpoint_ned(self._stream, self.autopilot, origin)
        message = mavlink.MAVLink_set_position_target_local_ned_message(
            int(now_s * 1e3), 1, 1, 1, 2048, *position, *velocity, *acceleration, math.radians(yaw_deg), 0.0
        )
        self._send(message, now_s)

    def _send(self, message, now_s: float) -> None:
        self._station.put(bytes(message.pack(self._codec)), now_s)
        self._codec.seq = (self._codec.seq + 1) % 256
