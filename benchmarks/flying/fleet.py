"""Ten vehicles at once in real time, and one far faster: what the built-in vehicle costs.

The vehicles run as `sim-bridge` does, in a process of its own; this one flies them all on circles, a setpoint for
every position heard (30 Hz), and looks at their clocks. The last rows are whole flights by `mission fly`, replans off.

python -m benchmarks.flying.fleet
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.flying.processes import EXAMPLES, overrides, run_mission
from benchmarks.timing import machine
from mission.flying.recorder import LOG_NAME
from sim_bridge.codec import Codec, mavlink

FLEETS = (1, 5, 10)
SPEEDS = (1.0, 20.0, 50.0, 100.0)
FLIGHT_SPEEDS = (10.0, 20.0, 30.0)
MEASURED_HOST_S = 15.0
HEIGHT_M, RADIUS_M, CIRCLE_MPS = 20.0, 15.0, 4.0
_OFFBOARD = (1.0, 6.0)
_TICKS_A_S = os.sysconf("SC_CLK_TCK")


@dataclasses.dataclass
class Client:
    """A program that flies one vehicle on a circle.

    Attributes:
        port: Its own UDP port.
        system: The vehicle's system id.
        vehicle_s: The vehicle's clock, as heard last.
        position_ned_m: Where the vehicle is.
        states: Positions heard.
    """

    port: int
    system: int
    vehicle_s: float = 0.0
    position_ned_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    states: int = 0
    armed: bool = False
    ready: bool = False
    mode: int = 0

    def __post_init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", self.port))
        self.socket.setblocking(False)
        self._codec = Codec(245, 190)
        self._vehicle: tuple[str, int] | None = None
        self._sent_s = -math.inf
        self._ordered_host_s = -math.inf
        self._circle_s: float | None = None

    def hear(self) -> None:
        """Take in what came."""
        while True:
            try:
                data, self._vehicle = self.socket.recvfrom(65536)
            except BlockingIOError:
                return
            for message in self._codec.decode(data):
                match message:
                    case mavlink.MAVLink_local_position_ned_message():
                        self.vehicle_s = message.time_boot_ms * 1e-3
                        self.position_ned_m = (message.x, message.y, message.z)
                        self.states += 1
                    case mavlink.MAVLink_heartbeat_message():
                        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
                        self.mode = message.custom_mode >> 16 & 0xFF
                    case mavlink.MAVLink_sys_status_message():
                        self.ready = bool(message.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_PREARM_CHECK)
                    case _:
                        pass

    def tell(self) -> None:
        """Send the setpoint that is due, and what else the vehicle still needs to be told."""
        if self._vehicle is None or not self.ready:
            return
        if self.vehicle_s > self._sent_s:
            self._sent_s = self.vehicle_s
            self._send(self._setpoint())
        if time.monotonic() - self._ordered_host_s > 0.2 and not (self.armed and self.mode == _OFFBOARD[1]):
            self._ordered_host_s = time.monotonic()
            set_mode, arm = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM
            for command, params in ((set_mode, _OFFBOARD), (arm, (1.0, 0.0))):
                self._send(
                    mavlink.MAVLink_command_long_message(self.system, 1, command, 0, *params, 0.0, 0.0, 0.0, 0.0, 0.0)
                )

    @property
    def circles(self) -> bool:
        """Whether it flies its circle."""
        return self._circle_s is not None

    def _setpoint(self):
        if self._circle_s is None and self.position_ned_m[2] < -0.8 * HEIGHT_M:
            self._circle_s = self.vehicle_s
        angle = 0.0 if self._circle_s is None else CIRCLE_MPS / RADIUS_M * (self.vehicle_s - self._circle_s)
        turning = 0.0 if self._circle_s is None else CIRCLE_MPS
        position = (RADIUS_M * math.sin(angle), RADIUS_M * (1.0 - math.cos(angle)), -HEIGHT_M)
        velocity = (turning * math.cos(angle), turning * math.sin(angle), 0.0)
        return mavlink.MAVLink_set_position_target_local_ned_message(
            int(self.vehicle_s * 1e3) % 2**32, self.system, 1, 1, 0b100111000000, *position, *velocity,
            0.0, 0.0, 0.0, 0.0, 0.0,
        )  # fmt: skip

    def _send(self, message) -> None:
        assert self._vehicle is not None, "the vehicle speaks first"
        self.socket.sendto(self._codec.encode(message), self._vehicle)


def spent_s(process: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS_A_S


def free_ports(count: int) -> int:
    """The first of so many UDP ports in a row that nobody holds."""
    for first in range(21000, 60000, 100):
        try:
            for port in range(first, first + count):
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(("127.0.0.1", port))
        except OSError:
            continue
        return first
    raise RuntimeError("no free UDP ports")


def flown(vehicles: int, speed: float) -> tuple[float, float, float]:
    """Fly so many vehicles for a while.

    Returns:
        Vehicle seconds a second, of the slowest; processor seconds of the simulator a second; positions a vehicle
        second.
    """
    port = free_ports(vehicles)
    command = [sys.executable, "-m", "sim_bridge", "--json", "--port", str(port), "--vehicles", str(vehicles)]
    command += ["--speed", str(speed), "--ready-after", "3", "--endurance", "20000"]
    simulator = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    clients = [Client(port + index, 1 + index) for index in range(vehicles)]
    try:
        assert simulator.stdout is not None
        simulator.stdout.readline()
        _serve(clients, lambda: all(client.circles for client in clients), 60.0)
        began_s, before_s = time.monotonic(), spent_s(simulator.pid)
        clocks = [client.vehicle_s for client in clients]
        states = sum(client.states for client in clients)
        _serve(clients, lambda: False, MEASURED_HOST_S)
        passed_s = time.monotonic() - began_s
        ran_s = np.array([client.vehicle_s for client in clients]) - clocks
        rate = (sum(client.states for client in clients) - states) / ran_s.sum()
        return float(ran_s.min()) / passed_s, (spent_s(simulator.pid) - before_s) / passed_s, rate
    finally:
        simulator.terminate()
        simulator.wait()
        for client in clients:
            client.socket.close()


def _serve(clients: list[Client], done, longest_host_s: float) -> None:
    until_s = time.monotonic() + longest_host_s
    while not done() and time.monotonic() < until_s:
        for client in clients:
            client.hear()
            client.tell()
        time.sleep(0.0005)


def whole_flight(speed: float) -> tuple[float, float]:
    """Fly an example.

    Returns:
        Flight seconds a second while exploring, and the mean distance from the course.
    """
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "flight"
        changes = ["replanning.enabled=false", "planner.duration_s=120"]
        summary = run_mission(
            ["fly", str(EXAMPLES / "forest.toml"), "--speed", str(speed), "--out", str(folder), *overrides(changes)]
        )
        moments = [
            (record["t"], record["host"])
            for record in map(json.loads, (folder / LOG_NAME).read_text(encoding="utf-8").splitlines())
            if record["kind"] == "telemetry" and record["phase"] == "exploring"
        ]
    flight_s, host_s = np.ptp(np.array(moments), axis=0)
    return float(flight_s / host_s), summary["tracking_error_mean_m"]


def main() -> None:
    """Print the tables."""
    print(f"{machine()}\n")
    print("| vehicles | speed asked | vehicle seconds a second (slowest) | processor seconds a second | positions |")
    print("|---|---|---|---|---|")
    for vehicles, speed in [*((count, 1.0) for count in FLEETS), *((1, speed) for speed in SPEEDS[1:])]:
        pace, cost, rate = flown(vehicles, speed)
        print(f"| {vehicles} | {speed:g} | {pace:.2f} | {cost:.2f} | {rate:.0f} Hz |", flush=True)
    print("\n| `mission fly --speed` | flight seconds a second | mean distance from the course |")
    print("|---|---|---|")
    for speed in FLIGHT_SPEEDS:
        pace, error_m = whole_flight(speed)
        print(f"| {speed:g} | {pace:.1f} | {error_m:.2f} m |", flush=True)


if __name__ == "__main__":
    main()
