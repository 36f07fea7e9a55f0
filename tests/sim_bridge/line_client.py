"""A program of raw MAVLink bytes at the other end of a line that may be bad, in virtual time."""

from collections.abc import Sequence

from sim_bridge.ardupilot.vehicle import ArduCopter
from sim_bridge.dialects import Autopilot, flight_mode
from sim_bridge.faults import AnyFault
from sim_bridge.px4.vehicle import Px4
from sim_bridge.state import FlightMode, GeodeticPoint
from sim_bridge.station import Station
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import POSITION_VELOCITY, TICK_S, mavlink

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
TELEMETRY = (
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
)
HEIGHT_M = 20.0


class Client:
    """A program at the other end of a line that may be bad; it repeats what is not acknowledged."""

    def __init__(self, autopilot: Autopilot, faults: Sequence[AnyFault], parameters=(), **config) -> None:
        made = VehicleConfig(GROUND, ready_after_s=3.0, parameters=tuple(parameters), **config)
        self.vehicle = Px4(made) if autopilot is Autopilot.PX4 else ArduCopter(made)
        self.station = Station(self.vehicle, faults=faults)
        self.autopilot = autopilot
        self.now_s = 0.0
        self.heard: list[tuple[float, object]] = []
        self._codec = mavlink.MAVLink(None, 245, 190)
        self._reader = mavlink.MAVLink(None)
        self._reader.robust_parsing = True
        self.hold_ned_m: tuple[float, float, float] | None = None

    def send(self, message) -> None:
        self.station.put(bytes(message.pack(self._codec)), self.now_s)

    def wait(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        steps = 0
        while self.now_s < end_s - 1e-9:
            if self.hold_ned_m is not None and steps % 5 == 0:
                self.setpoint(self.hold_ned_m)
            steps += 1
            self.now_s += TICK_S
            for datagram in self.station.advance(self.now_s):
                self.heard += [(self.now_s, message) for message in self._reader.parse_buffer(datagram) or ()]

    def wait_for(self, what, within_s: float) -> None:
        end_s = self.now_s + within_s
        while not what():
            assert self.now_s < end_s, f"did not come about within {within_s} s"
            self.wait(0.1)

    def command(self, command: int, *params: float) -> int:
        """Repeated until it is acknowledged, as every client does it."""
        values = (*params, *(0.0,) * (7 - len(params)))
        for attempt in range(20):
            self.send(mavlink.MAVLink_command_long_message(1, 1, command, attempt, *values))
            asked_s = self.now_s
            self.wait(0.5)
            acks = [m for at, m in self.heard if at >= asked_s and m.get_type() == "COMMAND_ACK"]
            if acks := [ack for ack in acks if ack.command == command and ack.target_system == 245]:
                return acks[-1].result
        raise AssertionError(f"command {command} was never acknowledged")

    def setpoint(self, position) -> None:
        self.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                int(self.now_s * 1e3), 1, 1, 1, POSITION_VELOCITY, *position, *(0.0,) * 8
            )
        )

    def arm(self) -> int:
        return self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)

    def set_mode(self, main: float, sub: float = 0.0) -> int:
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1.0, main, sub)

    def fly(self) -> None:
        """Into the air and following setpoints, holding at a place."""
        if self.autopilot is Autopilot.ARDUPILOT:
            for message_id in TELEMETRY:
                self.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e5)
            assert self.set_mode(4.0) == mavlink.MAV_RESULT_ACCEPTED
        self.wait_for(lambda: self.arm() == mavlink.MAV_RESULT_ACCEPTED, 20.0)
        height = HEIGHT_M
        if self.autopilot is Autopilot.PX4:
            height += self.vehicle.body.home_amsl_m
        self.command(mavlink.MAV_CMD_NAV_TAKEOFF, *(0.0,) * 6, height)
        self.wait_for(lambda: self.height_m > HEIGHT_M - 0.5, 40.0)
        self.hold_ned_m = (0.0, 0.0, self.vehicle.body.home_ned_m[2] - HEIGHT_M)
        self.wait(1.0)
        if self.autopilot is Autopilot.PX4:
            assert self.set_mode(6.0) == mavlink.MAV_RESULT_ACCEPTED
        self.wait(2.0)
        assert self.mode is FlightMode.EXTERNAL

    @property
    def height_m(self) -> float:
        """True height."""
        return self.vehicle.body.rotor.height_m

    def all(self, kind: str, since_s: float = 0.0) -> list:
        return [message for at, message in self.heard if at >= since_s and message.get_type() == kind]

    @property
    def mode(self) -> FlightMode:
        return flight_mode(self.autopilot, self.all("HEARTBEAT")[-1].custom_mode)[0]

    @property
    def status(self) -> int:
        return self.all("HEARTBEAT")[-1].system_status

    @property
    def said(self) -> str:
        return "\n".join(text.text for text in self.all("STATUSTEXT"))
