"""The flight client: one vehicle, over mavsdk, told and heard in the mission's frame.

mavsdk does the conversations (commands with their repetitions, parameters, missions, the setpoint stream). Its bytes
pass through our own wire, because three things are only possible there: every message carries the vehicle's clock,
only the right sender (and signer) is heard (`guard`), and a closed stream lets not one setpoint out
(`stream`).

Nothing here blocks the caller except `connect`, parameters, and what is uploaded (`mission`).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from mavsdk import Configuration, Mavsdk, System, log_subscribe
from mavsdk.plugins.offboard import AccelerationNed, Offboard, PositionNedYaw, VelocityNedYaw

from sim_bridge.codec import Message, mavlink
from sim_bridge.dialects import Autopilot
from sim_bridge.frames import VehicleFrame
from sim_bridge.link.address import parse_address
from sim_bridge.link.commands import OWN_COMPONENT, OWN_SYSTEM, Commands
from sim_bridge.link.error import LinkError
from sim_bridge.link.guard import Guard
from sim_bridge.link.inbox import Inbox, Timed
from sim_bridge.link.parameters import LinkParameters
from sim_bridge.link.stream import StreamGate
from sim_bridge.link.telemetry import Telemetry
from sim_bridge.link.wire import Wire, open_wire
from sim_bridge.signing import read_key, time_10us
from sim_bridge.state import Command, GeodeticPoint, Setpoint, VehicleState, Waiting

_RECEIVE_S = 0.1
_NOT_HEARD = "the vehicle's heartbeat has not been heard yet"


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
            datagrams=wire.datagrams,
        )
        self._vehicle_system = vehicle_system
        self._telemetry = Telemetry(self._frame)
        self._inbox = Inbox()
        self._gate = StreamGate(self._seal_and_send)
        self._closed = threading.Event()
        self._system: System | None = None
        self._commands: Commands | None = None
        log_subscribe(lambda *_: True)
        self._sdk = Mavsdk(Configuration.create_manual(OWN_SYSTEM, OWN_COMPONENT, True))
        self._sdk.add_any_connection("raw://")
        self._sdk.subscribe_raw_bytes_to_be_sent(self._gate.send)
        self._receiver = threading.Thread(target=self._receive, name="link-receive", daemon=True)
        self._receiver.start()

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
            address: See `sim_bridge.link.address.parse_address`.
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
        self._offboard = Offboard(self._system)
        self._parameters = LinkParameters(self._system)
        self._commands = Commands(self._system, self._vehicle_system, self._offboard, self._telemetry, self._inbox)

    @property
    def autopilot(self) -> Autopilot:
        """Whose dialect the vehicle speaks."""
        if self._telemetry.autopilot is None:
            raise LinkError(_NOT_HEARD)
        return self._telemetry.autopilot

    @property
    def system(self) -> System:
        """The vehicle as mavsdk knows it."""
        if self._system is None:
            raise LinkError(_NOT_HEARD)
        return self._system

    @property
    def home(self) -> GeodeticPoint | None:
        """Where the vehicle would return to; None: not told yet."""
        return self._telemetry.home

    @property
    def reboots(self) -> int:
        """How often the vehicle's clock started anew."""
        return self._telemetry.reboots

    @property
    def refused_messages(self) -> dict[str, int]:
        """Messages that were not let in, by reason."""
        return dict(self._guard.refused)

    # Hearing.

    def events(self, timeout_s: float = 0.0) -> Iterator[Timed]:
        """What was heard since the last call, waiting at most so long for the first."""
        return self._inbox.taken(timeout_s)

    def texts_since(self, host_s: float) -> list[str]:
        """What the vehicle said since a moment of this machine's monotonic clock."""
        return self._inbox.texts_since(host_s)

    def last_words(self) -> str:
        """What the vehicle said in the last moments, as one line."""
        return self._inbox.last_words()

    def _receive(self) -> None:
        while not self._closed.is_set():
            data = self._wire.receive(_RECEIVE_S)
            if not data:
                continue
            host_s = time.monotonic()
            for accepted in self._guard.accept(data):
                self._wire.believe()
                for event in self._telemetry.receive(accepted.message):
                    if self._on_state is not None and isinstance(event, VehicleState):
                        self._on_state(event.time_s, host_s)
                    if self._commands is not None and isinstance(event, VehicleState | Waiting):
                        self._commands.told(waits=isinstance(event, Waiting))
                    self._inbox.post(host_s, event)
                if _is_for_mavsdk(accepted.message):
                    self._sdk.pass_received_raw_bytes(accepted.frame)

    # Telling.

    def request(self, command: Command, altitude_m: float | None = None) -> None:
        """Give a command; its `CommandDone` comes among the events.

        Args:
            command: What to do.
            altitude_m: Height above where it stands, for a take-off.

        Raises:
            LinkError: The vehicle has not been heard yet.
        """
        if self._commands is None:
            raise LinkError(_NOT_HEARD)
        self._commands.request(command, altitude_m)

    def open_stream(self) -> None:
        """Let setpoints out, from the next one on."""
        self._gate.open()

    def withdraw(self) -> None:
        """Give none of the commands that were asked for and not sent yet."""
        if self._commands is not None:
            self._commands.withdraw()

    def stream(self, setpoint: Setpoint) -> None:
        """Send one setpoint now, if the stream is open.

        mavsdk repeats it at 20 Hz until the next one or `close_stream`; what is not followed by another soon is left
        standing, and then silent (`sim_bridge.link.stream`).
        """
        vehicle_origin = self._telemetry.origin
        if vehicle_origin is None:
            raise LinkError("the vehicle has not told the origin of its local frame")
        position, velocity, acceleration, yaw_deg = self._frame.setpoint_ned(setpoint, self.autopilot, vehicle_origin)
        self._gate.expect(position)
        self._offboard.set_position_velocity_acceleration_ned(
            PositionNedYaw(*position, yaw_deg), VelocityNedYaw(*velocity, yaw_deg), AccelerationNed(*acceleration)
        )

    def close_stream(self) -> None:
        """Let no setpoint out any more, at once."""
        self._gate.close()

    def setpoint_gaps_s(self) -> list[float]:
        """Times between new setpoints on the wire, within each uninterrupted stream."""
        return self._gate.gaps_s()

    def parameter(self, name: str) -> float | None:
        """A parameter's value; None: the vehicle does not have it or does not answer."""
        return self._parameters.read(name)

    def set_parameter(self, name: str, value: float) -> None:
        """Write a parameter.

        Raises:
            LinkError: The vehicle did not take it.
        """
        self._parameters.write(name, value)

    def close(self) -> None:
        """Stop streaming and let go of the line; the vehicle keeps the mode it is in."""
        self.close_stream()
        if self._closed.is_set():
            return
        self._closed.set()
        self._receiver.join(2.0)
        if self._commands is not None:
            self._commands.close()
        self._sdk.destroy()
        self._wire.close()

    def _seal_and_send(self, frame: bytes) -> None:
        if sealed := self._guard.seal(frame):
            self._wire.send(sealed)


def _is_for_mavsdk(message: Message) -> bool:
    """Whether mavsdk is to hear a message that was let in."""
    match message.get_msgId():
        case mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            # It would only print a text, whatever bytes a vehicle put into it.
            return False
        case mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            # One with a result that it does not know is no end of the command to it, and the second ends the process.
            return message.result <= mavlink.MAV_RESULT_IN_PROGRESS
        case _:
            return True
