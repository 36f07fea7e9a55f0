"""Commands to a vehicle, in its own dialect, each waited for until it is answered.

They run on a thread of their own and end as `CommandDone` among the events: nothing here blocks who asks.
"""

from __future__ import annotations

import contextlib
import json
import queue
import threading
import time

from mavsdk import System
from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkDirectError, MavlinkMessage
from mavsdk.plugins.offboard import Offboard, OffboardError
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.dialects import GUIDED, Autopilot
from sim_bridge.link.error import LinkError
from sim_bridge.link.inbox import Inbox
from sim_bridge.link.telemetry import Telemetry
from sim_bridge.state import Command, CommandDone, FlightMode

OWN_SYSTEM = 245
OWN_COMPONENT = mavlink.MAV_COMP_ID_MISSIONPLANNER
_MODE_SHOWN_S = 3.0
_IDLE_S = 0.5
_ASK_AGAIN_S = 5.0
_TEXT_FOLLOWS_S = 0.2
_RESULTS = {
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED: "temporarily rejected",
    mavlink.MAV_RESULT_DENIED: "denied",
    mavlink.MAV_RESULT_UNSUPPORTED: "unsupported",
    mavlink.MAV_RESULT_FAILED: "failed",
}
_UNANSWERED = ("UNKNOWN", "NO_SYSTEM", "CONNECTION_ERROR", "BUSY", "TIMEOUT")
# Copter tells only heartbeats and texts until it is asked: message id, times a second.
STREAMS_HZ = {
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 10.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: 1.0,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: 1.0,
    mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: 1.0,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
}


class Commands:
    """Gives one vehicle commands, and keeps it telling what is needed.

    Args:
        system: The vehicle as mavsdk knows it.
        vehicle_system: Its MAVLink system id.
        offboard: The setpoint stream, which is started like a command.
        telemetry: What it told.
        inbox: Where answers go.
    """

    def __init__(
        self, system: System, vehicle_system: int, offboard: Offboard, telemetry: Telemetry, inbox: Inbox
    ) -> None:
        if telemetry.autopilot is None:
            raise LinkError("the vehicle's heartbeat has not been heard yet")
        self._autopilot = telemetry.autopilot
        self._vehicle_system = vehicle_system
        self._telemetry = telemetry
        self._inbox = inbox
        self._action = Action(system)
        self._offboard = offboard
        self._direct = MavlinkDirect(system)
        self._orders: queue.SimpleQueue[tuple[Command, float | None] | None] = queue.SimpleQueue()
        self._closed = threading.Event()
        self._waits = True
        self._asked_streams_s = 0.0
        self._worker = threading.Thread(target=self._work, name="link-commands", daemon=True)
        self._worker.start()
        self._ask_for_streams()

    def request(self, command: Command, altitude_m: float | None) -> None:
        """Give a command.

        Args:
            command: What to do.
            altitude_m: Height above where it stands, for a take-off.
        """
        self._orders.put((command, altitude_m))

    def withdraw(self) -> None:
        """Give none of the commands that wait for their turn; the one being given takes its course."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._orders.get_nowait()

    def told(self, waits: bool) -> None:
        """Note whether the vehicle still fails to tell something that was asked for."""
        self._waits = waits

    def close(self) -> None:
        """Give no more commands."""
        self._closed.set()
        self._orders.put(None)
        self._worker.join(5.0)

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
                done = CommandDone(command, False, self._reason(error), answered=_is_answer(error))
            except Exception as error:  # noqa: BLE001 (whatever it was, the next command must still be given)
                done = CommandDone(command, False, f"{type(error).__name__}: {error}")
            self._inbox.post(time.monotonic(), done)

    def _reason(self, error: Exception) -> str:
        """Why a command was refused, with what the vehicle said about it."""
        result = getattr(error, "result", None)
        words = result.name.lower().replace("_", " ") if result is not None else str(error)
        # The text may come a moment after the refusal.
        self._closed.wait(_TEXT_FOLLOWS_S)
        said = self._inbox.last_words()
        return words + (f' ("{said}")' if said else "")

    def _ask_for_streams(self) -> None:
        """Ask for what the vehicle does not send by itself; where one is refused, the others still come."""
        self._asked_streams_s = time.monotonic()
        wanted = []
        if self._autopilot is Autopilot.ARDUPILOT:
            interval = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
            wanted += [(interval, float(message_id), 1e6 / rate_hz) for message_id, rate_hz in STREAMS_HZ.items()]
        for message_id in (mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, mavlink.MAVLINK_MSG_ID_HOME_POSITION):
            wanted.append((mavlink.MAV_CMD_REQUEST_MESSAGE, float(message_id), 0.0))
        for command, *params in wanted:
            # Whatever becomes of one, commands are given by this thread too.
            with contextlib.suppress(Exception):
                self._command_long(command, *params)

    def _carry_out(self, command: Command, altitude_m: float | None) -> None:
        match command:
            case Command.ARM:
                self._arm()
            case Command.DISARM:
                self._action.disarm()
            case Command.TAKE_OFF:
                if altitude_m is None:
                    raise LinkError("a take-off needs a height")
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
        if self._autopilot is Autopilot.ARDUPILOT:
            # A GUIDED accepted right after boot is silently undone: look at the mode before arming.
            self._set_guided()
        elif self._telemetry.mode is FlightMode.EXTERNAL:
            # PX4 goes back to Offboard when it disarms after a flight, and there it arms for a stream only.
            self._action.hold()
        self._action.arm()

    def _set_guided(self) -> None:
        self._command_long(mavlink.MAV_CMD_DO_SET_MODE, float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED), float(GUIDED))
        until_s = time.monotonic() + _MODE_SHOWN_S
        while self._telemetry.mode is not FlightMode.EXTERNAL:
            if time.monotonic() > until_s:
                raise LinkError("GUIDED was accepted but did not stay")
            self._closed.wait(0.05)

    def _take_off(self, altitude_m: float) -> None:
        match self._autopilot:
            case Autopilot.PX4:
                # Above sea level; no position: where it stands. What is known of home may be from before it armed.
                stands_amsl_m = self._telemetry.altitude_amsl_m
                if stands_amsl_m is None:
                    raise LinkError("the vehicle has not told its altitude")
                self._command_long(mavlink.MAV_CMD_NAV_TAKEOFF, *(None,) * 6, stands_amsl_m + altitude_m)
            case Autopilot.ARDUPILOT:
                # Above home, which is where it stood when it armed.
                self._command_long(mavlink.MAV_CMD_NAV_TAKEOFF, *(0.0,) * 6, altitude_m)

    def _start_mission(self) -> None:
        match self._autopilot:
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


def _is_answer(error: Exception) -> bool:
    """Whether a refusal came from the vehicle, and not from an answer that never came."""
    match error:
        case ActionError() | OffboardError():
            return error.result.name not in _UNANSWERED
        case MavlinkDirectError():
            return False
        case _:
            return True
