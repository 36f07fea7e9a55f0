"""The flight client: one vehicle, over mavsdk, told and heard in the mission's frame.

mavsdk does the conversations (commands with their repetitions, parameters, missions, the setpoint stream). Its bytes
pass through our own wire, because three things are only possible there: every message carries the vehicle's clock,
only the right sender (and signer) is heard, and a closed stream lets not one setpoint out, whatever thread still
repeats it.

Commands run on a thread of their own and answer as `CommandDone` among the events; nothing here blocks the caller
except `connect`, parameters, and what is uploaded.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import json
import math
import queue
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from mavsdk import Configuration, Mavsdk, System, log_subscribe
from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkDirectError, MavlinkMessage
from mavsdk.plugins.offboard import AccelerationNed, Offboard, OffboardError, PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.param import Param, ParamError, ParamResult
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.frames import VehicleFrame
from sim_bridge.link_autopilot import GUIDED, Autopilot
from sim_bridge.link_guard import Guard
from sim_bridge.link_telemetry import Heard, Telemetry
from sim_bridge.link_wire import Wire, open_wire, parse_address
from sim_bridge.signing import read_key, time_10us
from sim_bridge.state import (
    Command,
    CommandDone,
    FlightMode,
    GeodeticPoint,
    Setpoint,
    StatusText,
    VehicleState,
    Waiting,
)

OWN_SYSTEM = 245
OWN_COMPONENT = mavlink.MAV_COMP_ID_MISSIONPLANNER
_RECEIVE_S = 0.1
_MODE_SHOWN_S = 3.0
_TEXT_KEPT_S = 3.0
_IDLE_S = 0.5
_ASK_AGAIN_S = 5.0
_MOST_EVENTS = 20_000
_MOST_GAPS = 2_000_000
_SETPOINTS = (
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
)
_RESULTS = {
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED: "temporarily rejected",
    mavlink.MAV_RESULT_DENIED: "denied",
    mavlink.MAV_RESULT_UNSUPPORTED: "unsupported",
    mavlink.MAV_RESULT_FAILED: "failed",
}
# Copter tells only heartbeats and texts until it is asked: message id, times a second.
_STREAMS_HZ = {
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 10.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: 1.0,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: 1.0,
    mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: 1.0,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
}


class LinkError(RuntimeError):
    """The vehicle could not be reached, or did not answer; the text says what was tried."""


@dataclasses.dataclass(frozen=True)
class Timed:
    """An event and when this machine heard it.

    Attributes:
        host_s: This machine's monotonic clock.
        event: What was heard.
    """

    host_s: float
    event: Heard | CommandDone


class Link:
    """A vehicle within reach; made by `connect`.

    Args:
        wire: Carries the bytes.
        origin: The mission's origin.
        vehicle_system: The vehicle's MAVLink system id.
        key: Signing key; None: unsigned.
        on_state: Told of each state as it comes, on the receiving thread: the vehicle's clock, and this machine's.
    """

    def __init__(
        self,
        wire: Wire,
        origin: GeodeticPoint,
        vehicle_system: int = 1,
        key: bytes | None = None,
        on_state: Callable[[float, float], None] | None = None,
    ) -> None:
        self._on_state = on_state
        self._wire = wire
        self._frame = VehicleFrame(origin)
        self._guard = Guard(
            OWN_SYSTEM,
            OWN_COMPONENT,
            vehicle_system,
            key,
            signing_time_10us=time_10us(time.time()),
        )
        self._vehicle_system = vehicle_system
        self._telemetry = Telemetry(self._frame)
        self._inbox: queue.Queue[Timed] = queue.Queue(_MOST_EVENTS)
        self._orders: queue.SimpleQueue[tuple[Command, float | None] | None] = queue.SimpleQueue()
        self._texts: list[tuple[float, StatusText]] = []
        self._setpoint_times_s: list[float] = []
        self._stream_open = False
        self._waits = True
        self._asked_streams_s = 0.0
        self._closed = threading.Event()
        self._send_lock = threading.Lock()
        log_subscribe(lambda *_: True)
        self._sdk = Mavsdk(Configuration.create_manual(OWN_SYSTEM, OWN_COMPONENT, True))
        self._sdk.add_any_connection("raw://")
        self._sdk.subscribe_raw_bytes_to_be_sent(self._send)
        self._receiver = threading.Thread(target=self._receive, name="link-receive", daemon=True)
        self._worker = threading.Thread(target=self._work, name="link-commands", daemon=True)
        self._receiver.start()
        self._system: System | None = None

    @classmethod
    def connect(
        cls,
        address: str,
        origin: GeodeticPoint,
        *,
        vehicle_system: int = 1,
        key_file: Path | None = None,
        timeout_s: float = 30.0,
        on_state: Callable[[float, float], None] | None = None,
    ) -> Link:
        """Open a line and wait until the vehicle is heard on it.

        Args:
            address: See `sim_bridge.link_wire.parse_address`.
            origin: The mission's origin.
            vehicle_system: The vehicle's MAVLink system id.
            key_file: File with the signing key; None: unsigned.
            timeout_s: How long to wait for a heartbeat.
            on_state: Told of each state as it comes, on the receiving thread: the vehicle's clock, and this machine's.

        Raises:
            ValueError: The address or the key file cannot be read.
            LinkError: The line cannot be opened, or no vehicle is heard on it.
        """
        key = None if key_file is None else read_key(key_file)
        try:
            wire = open_wire(parse_address(address))
        except OSError as error:
            raise LinkError(f"{address} cannot be opened: {error}") from error
        link = cls(wire, origin, vehicle_system, key, on_state)
        try:
            link.wait_heard(timeout_s, address)
        except LinkError:
            link.close()
            raise
        return link

    def wait_heard(self, timeout_s: float, address: str = "the link") -> None:
        """Wait for the vehicle's heartbeat, and ask for what it does not send by itself.

        Raises:
            LinkError: None came.
        """
        self._system = self._sdk.first_autopilot(timeout_s)
        if self._system is None:
            refused = ", ".join(f"{count} messages {why}" for why, count in self._guard.refused.items())
            raise LinkError(
                f"no vehicle with system id {self._vehicle_system} was heard on {address} within {timeout_s:.0f} s"
                + (f" (refused: {refused})" if refused else "")
                + ": check that it is powered, that it sends to this address, and its system id"
            )
        self._action = Action(self._system)
        self._offboard = Offboard(self._system)
        self._param = Param(self._system)
        self._direct = MavlinkDirect(self._system)
        self._worker.start()
        self._ask_for_streams()

    @property
    def autopilot(self) -> Autopilot:
        """Whose dialect the vehicle speaks."""
        if self._telemetry.autopilot is None:
            raise LinkError("the vehicle's heartbeat has not been heard yet")
        return self._telemetry.autopilot

    @property
    def system(self) -> System:
        """The vehicle as mavsdk knows it."""
        if self._system is None:
            raise LinkError("the vehicle's heartbeat has not been heard yet")
        return self._system

    @property
    def home(self) -> GeodeticPoint | None:
        """Where the vehicle would return to; None: not told yet."""
        return self._telemetry.home

    def texts_since(self, host_s: float) -> list[str]:
        """What the vehicle said since a moment of this machine's monotonic clock."""
        return [text.text for at_s, text in self._texts if at_s >= host_s]

    def last_words(self) -> str:
        """What the vehicle said in the last moments, as one line."""
        said = [
            text.text for at_s, text in self._texts if at_s >= time.monotonic() - _TEXT_KEPT_S and text.severity <= 5
        ]
        return "; ".join(dict.fromkeys(said))

    @property
    def reboots(self) -> int:
        """How often the vehicle's clock started anew."""
        return self._telemetry.reboots

    @property
    def refused_messages(self) -> dict[str, int]:
        """Messages that were not let in, by reason."""
        return dict(self._guard.refused)

    def events(self, timeout_s: float = 0.0) -> Iterator[Timed]:
        """What was heard since the last call, waiting at most so long for the first."""
        try:
            yield self._inbox.get(timeout=timeout_s) if timeout_s > 0.0 else self._inbox.get_nowait()
            while True:
                yield self._inbox.get_nowait()
        except queue.Empty:
            return

    def setpoint_gaps_s(self) -> list[float]:
        """Times between setpoints on the wire, within each uninterrupted stream."""
        pairs = itertools.pairwise(self._setpoint_times_s)
        return [after - before for before, after in pairs if not math.isnan(after - before)]

    # Telling.

    def request(self, command: Command, altitude_m: float | None = None) -> None:
        """Give a command; its `CommandDone` comes among the events.

        Args:
            command: What to do.
            altitude_m: Height above home, for a take-off.
        """
        self._orders.put((command, altitude_m))

    def stream(self, setpoint: Setpoint) -> None:
        """Send one setpoint now; mavsdk repeats it at 20 Hz until the next one or `close_stream`."""
        vehicle_origin = self._telemetry.origin
        if vehicle_origin is None:
            raise LinkError("the vehicle has not told the origin of its local frame")
        position, velocity, acceleration, yaw_deg = self._frame.setpoint_ned(setpoint, self.autopilot, vehicle_origin)
        self._stream_open = True
        self._offboard.set_position_velocity_acceleration_ned(
            PositionNedYaw(*position, yaw_deg), VelocityNedYaw(*velocity, yaw_deg), AccelerationNed(*acceleration)
        )

    def close_stream(self) -> None:
        """Let no setpoint out any more, at once."""
        with self._send_lock:
            if self._stream_open:
                self._setpoint_times_s.append(float("nan"))
            self._stream_open = False

    def parameter(self, name: str) -> float | None:
        """A parameter's value; None: the vehicle does not have it or does not answer."""
        for read in (self._param.get_param_float, self._param.get_param_int):
            try:
                return float(read(name))
            except ParamError as error:
                # An unknown name is not answered at all; only one of another type is worth a second question.
                if error.result is ParamResult.TIMEOUT:
                    return None
        return None

    def set_parameter(self, name: str, value: float) -> None:
        """Write a parameter.

        Raises:
            LinkError: The vehicle did not take it.
        """
        try:
            self._param.set_param_float(name, value)
        except ParamError:
            try:
                self._param.set_param_int(name, int(value))
            except ParamError as error:
                raise LinkError(f"parameter {name} was not taken: {error.result.name.lower()}") from error

    def close(self) -> None:
        """Stop streaming and let go of the line; the vehicle keeps the mode it is in."""
        self.close_stream()
        if self._closed.is_set():
            return
        self._closed.set()
        self._orders.put(None)
        self._receiver.join(2.0)
        if self._worker.is_alive():
            self._worker.join(5.0)
        self._sdk.destroy()
        self._wire.close()

    # Threads.

    def _receive(self) -> None:
        while not self._closed.is_set():
            data = self._wire.receive(_RECEIVE_S)
            if not data:
                continue
            host_s = time.monotonic()
            for accepted in self._guard.accept(data):
                for event in self._telemetry.receive(accepted.message):
                    if self._on_state is not None and isinstance(event, VehicleState):
                        self._on_state(event.time_s, host_s)
                    if isinstance(event, VehicleState | Waiting):
                        self._waits = isinstance(event, Waiting)
                    self._post(host_s, event)
                self._sdk.pass_received_raw_bytes(accepted.frame)

    def _post(self, host_s: float, event: Heard | CommandDone) -> None:
        if isinstance(event, StatusText):
            self._texts = [(at, text) for at, text in self._texts if host_s - at < 10.0] + [(host_s, event)]
        try:
            self._inbox.put_nowait(Timed(host_s, event))
        except queue.Full:
            # Nobody listens: the newest is worth more than the oldest.
            with contextlib.suppress(queue.Empty):
                self._inbox.get_nowait()
            self._inbox.put_nowait(Timed(host_s, event))

    def _send(self, frame: bytes) -> None:
        message_id = int.from_bytes(frame[7:10], "little")
        with self._send_lock:
            if message_id in _SETPOINTS:
                if not self._stream_open:
                    return
                if len(self._setpoint_times_s) < _MOST_GAPS:
                    self._setpoint_times_s.append(time.monotonic())
            if sealed := self._guard.seal(frame):
                self._wire.send(sealed)

    def _ask_for_streams(self) -> None:
        """Ask for what the vehicle does not send by itself; where one is refused, the others still come."""
        self._asked_streams_s = time.monotonic()
        wanted = []
        if self.autopilot is Autopilot.ARDUPILOT:
            interval = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
            wanted += [(interval, float(message_id), 1e6 / rate_hz) for message_id, rate_hz in _STREAMS_HZ.items()]
        for message_id in (mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, mavlink.MAVLINK_MSG_ID_HOME_POSITION):
            wanted.append((mavlink.MAV_CMD_REQUEST_MESSAGE, float(message_id), 0.0))
        for command, *params in wanted:
            with contextlib.suppress(LinkError, MavlinkDirectError):
                self._command_long(command, *params)

    def _work(self) -> None:
        while True:
            try:
                order = self._orders.get(timeout=_IDLE_S)
            except queue.Empty:
                # A vehicle that was restarted has forgotten what it was asked to send.
                if self._waits and time.monotonic() - self._asked_streams_s > _ASK_AGAIN_S:
                    self._ask_for_streams()
                continue
            if order is None:
                return
            command, altitude_m = order
            try:
                self._carry_out(command, altitude_m)
                done = CommandDone(command, True)
            except (ActionError, OffboardError, MavlinkDirectError, LinkError) as error:
                done = CommandDone(command, False, self._reason(error))
            self._post(time.monotonic(), done)

    def _reason(self, error: Exception) -> str:
        """Why a command was refused, with what the vehicle said about it."""
        result = getattr(error, "result", None)
        words = result.name.lower().replace("_", " ") if result is not None else str(error)
        # The text may come a moment after the refusal.
        self._closed.wait(0.2)
        said = self.last_words()
        return words + (f' ("{said}")' if said else "")

    # Commands.

    def _carry_out(self, command: Command, altitude_m: float | None) -> None:
        match command:
            case Command.ARM:
                self._arm()
            case Command.DISARM:
                self._action.disarm()
            case Command.TAKE_OFF:
                if altitude_m is None:
                    raise LinkError("a take-off needs a height above home")
                self._take_off(altitude_m)
            case Command.FOLLOW_SETPOINTS:
                self._offboard.start()
            case Command.HOLD:
                self._action.hold()
            case Command.RETURN:
                self._action.return_to_launch()
            case Command.LAND:
                self._action.land()
            case Command.START_MISSION:
                self._start_mission()

    def _arm(self) -> None:
        if self.autopilot is Autopilot.ARDUPILOT:
            # A GUIDED accepted right after boot is silently undone: look at the mode before arming.
            self._set_guided()
        self._action.arm()

    def _set_guided(self) -> None:
        self._command_long(mavlink.MAV_CMD_DO_SET_MODE, float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED), float(GUIDED))
        until_s = time.monotonic() + _MODE_SHOWN_S
        while self._telemetry.mode is not FlightMode.EXTERNAL:
            if time.monotonic() > until_s:
                raise LinkError("GUIDED was accepted but did not stay")
            self._closed.wait(0.05)

    def _take_off(self, altitude_m: float) -> None:
        match self.autopilot:
            case Autopilot.PX4:
                # Above sea level; no position: where it stands.
                home = self._telemetry.home
                if home is None:
                    raise LinkError("the vehicle has not told the altitude of its home")
                self._command_long(mavlink.MAV_CMD_NAV_TAKEOFF, *(None,) * 6, home.altitude_amsl_m + altitude_m)
            case Autopilot.ARDUPILOT:
                self._command_long(mavlink.MAV_CMD_NAV_TAKEOFF, *(0.0,) * 6, altitude_m)

    def _start_mission(self) -> None:
        match self.autopilot:
            case Autopilot.PX4:
                # Main mode 4 AUTO, sub-mode 4 MISSION.
                self._command_long(mavlink.MAV_CMD_DO_SET_MODE, 1.0, 4.0, 4.0)
            case Autopilot.ARDUPILOT:
                self._command_long(mavlink.MAV_CMD_DO_SET_MODE, 1.0, 3.0)

    def _command_long(self, command: int, *params: float | None) -> None:
        """Send a command and wait for its answer; None is NaN, what is not given is 0.

        Raises:
            LinkError: It was refused.
            MavlinkDirectError: It was not answered.
        """
        values = [*params, *(0.0,) * (7 - len(params))]
        fields = {"target_system": self._vehicle_system, "target_component": 1, "command": command, "confirmation": 0}
        fields |= {f"param{index}": value for index, value in enumerate(values, start=1)}
        answer = self._direct.send_command(
            MavlinkMessage("COMMAND_LONG", OWN_SYSTEM, OWN_COMPONENT, self._vehicle_system, 1, json.dumps(fields))
        )
        result = json.loads(answer.fields_json)["result"]
        if result != mavlink.MAV_RESULT_ACCEPTED:
            raise LinkError(_RESULTS.get(result, f"result {result}"))
