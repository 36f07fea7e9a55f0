"""A ground station of raw MAVLink bytes that talks to a built-in vehicle in virtual time: no sockets, no clocks."""

import math
import os
from collections.abc import Callable

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.vehicle.autopilot import VehicleAutopilot

TICK_S = 0.01
POSITION_ONLY = 2552
POSITION_VELOCITY = 2496
POSITION_VELOCITY_ACCELERATION = 2048
VELOCITY_ONLY = 2503
ALL_IGNORED = 0xFFF
NAN = math.nan

# PX4's main and sub mode.
POSCTL, OFFBOARD = (3, 0), (6, 0)
TAKEOFF, HOLD, MISSION, RETURN, LAND = (4, 2), (4, 3), (4, 4), (4, 5), (4, 6)


class GroundStation:
    """One end of a line whose other end is a vehicle.

    Args:
        vehicle: Whom to talk to.
        system: Own system id.
        component: Own component id.
    """

    def __init__(self, vehicle: VehicleAutopilot, system: int = 245, component: int = 190) -> None:
        self.vehicle = vehicle
        self.now_s = 0.0
        self.heard: list[tuple[float, object]] = []
        self._own = mavlink.MAVLink(None, system, component)
        self._theirs = mavlink.MAVLink(None, vehicle.body.config.system, 1)

    # Telling.

    def send(self, message) -> list:
        """Send one message; what it is answered with at once."""
        (received,) = mavlink.MAVLink(None).parse_buffer(bytes(message.pack(self._own)))
        return self._hear(self.vehicle.receive(received, self.now_s))

    def command(self, command: int, *params: float, system: int = 1) -> int:
        """Send COMMAND_LONG; the result of its acknowledgement."""
        values = (*params, *(0.0,) * (7 - len(params)))
        replies = self.send(mavlink.MAVLink_command_long_message(system, 1, command, 0, *values))
        (ack,) = [reply for reply in replies if reply.get_type() == "COMMAND_ACK"]
        assert ack.command == command
        return ack.result

    def arm(self) -> int:
        """Arm."""
        return self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)

    def look(self) -> tuple[int, int]:
        """The mode of this moment, without waiting for the next heartbeat."""
        self.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_HEARTBEAT)
        return self.custom_mode

    def px4_mode(self, mode: tuple[int, int]) -> int:
        """Ask for a mode by its main and sub mode."""
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1.0, *map(float, mode))

    def setpoint(
        self,
        position=(0.0, 0.0, 0.0),
        velocity=(0.0, 0.0, 0.0),
        acceleration=(0.0, 0.0, 0.0),
        yaw_rad=0.0,
        mask: int = POSITION_VELOCITY_ACCELERATION,
        frame: int = mavlink.MAV_FRAME_LOCAL_NED,
        system: int = 1,
    ) -> None:
        """Send one local setpoint; it is never acknowledged, though a text may say that it does not count."""
        replies = self.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                int(self.now_s * 1e3), system, 1, frame, mask, *position, *velocity, *acceleration, yaw_rad, 0.0
            )
        )
        assert all(reply.get_type() == "STATUSTEXT" for reply in replies)

    def take_off(self, height_m: float = 20.0) -> None:
        """Arm and climb to a height above home, as PX4 wants it told: above sea level."""
        home_amsl_m = self.last("HOME_POSITION").altitude * 1e-3
        assert self.arm() == mavlink.MAV_RESULT_ACCEPTED
        result = self.command(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, home_amsl_m + height_m)
        assert result == mavlink.MAV_RESULT_ACCEPTED
        self.wait_for(lambda: self.custom_mode == HOLD, within_s=60.0)

    # Waiting.

    def wait(self, seconds: float, each_s: float = 0.05, do: Callable[[], None] | None = None) -> list:
        """Let vehicle time pass, doing something every so often; what was heard meanwhile."""
        first, end_s, next_s = len(self.heard), self.now_s + seconds, self.now_s
        while self.now_s < end_s - 1e-9:
            if do is not None and self.now_s >= next_s - 1e-9:
                do()
                next_s += each_s
            self.now_s += TICK_S
            self._hear(self.vehicle.tick(self.now_s))
        return [message for _, message in self.heard[first:]]

    def wait_for(self, what: Callable[[], bool], within_s: float, do: Callable[[], None] | None = None) -> None:
        """Let time pass until something is so.

        Raises:
            AssertionError: It did not become so in time.
        """
        end_s = self.now_s + within_s
        while not what():
            assert self.now_s < end_s, f"{what} did not come about within {within_s} s"
            self.wait(0.1, do=do)

    # What was heard.

    def last(self, kind: str):
        """The newest message of a type."""
        return next(message for _, message in reversed(self.heard) if message.get_type() == kind)

    def all(self, kind: str) -> list:
        """Every message of a type, in order."""
        return [message for _, message in self.heard if message.get_type() == kind]

    def times(self, kind: str) -> list[float]:
        """When messages of a type came."""
        return [at_s for at_s, message in self.heard if message.get_type() == kind]

    @property
    def said(self) -> str:
        """All that the vehicle said in words, a line a text, chunks put together."""
        lines: list[str] = []
        for text in self.all("STATUSTEXT"):
            if text.chunk_seq:
                lines[-1] += text.text
            else:
                lines.append(text.text)
        return "\n".join(lines)

    def forget(self) -> None:
        """Forget what was heard."""
        self.heard.clear()

    @property
    def custom_mode(self) -> tuple[int, int]:
        """PX4's main and sub mode in the last heartbeat."""
        number = self.last("HEARTBEAT").custom_mode
        return number >> 16 & 0xFF, number >> 24 & 0xFF

    @property
    def status(self) -> int:
        """MAV_STATE in the last heartbeat."""
        return self.last("HEARTBEAT").system_status

    @property
    def armed(self) -> bool:
        """Whether the last heartbeat says so."""
        return bool(self.last("HEARTBEAT").base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)

    @property
    def position(self) -> tuple[float, float, float]:
        """The last local position, north, east, down."""
        last = self.last("LOCAL_POSITION_NED")
        return last.x, last.y, last.z

    @property
    def velocity(self) -> tuple[float, float, float]:
        """The last local velocity, north, east, down."""
        last = self.last("LOCAL_POSITION_NED")
        return last.vx, last.vy, last.vz

    def _hear(self, messages) -> list:
        decoded = []
        for message in messages:
            decoded += mavlink.MAVLink(None).parse_buffer(bytes(message.pack(self._theirs))) or []
        self.heard += [(self.now_s, message) for message in decoded]
        return decoded
