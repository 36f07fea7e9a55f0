"""Built-in vehicles on UDP, in real time or faster.

Faster means lock-step: the vehicle's clock runs `speed` times faster than the wall's, but never further than a moment
ahead of the last new setpoint while setpoints are followed. A busy machine so slows the simulation down and does not
lose its stream; a stream that has truly ended (nothing new for a second of wall time) lets the clock run on.

A vehicle whose program fails is silent from then on, as one whose firmware has crashed; the others fly on.
"""

from __future__ import annotations

import dataclasses
import json
import math
import selectors
import socket
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence

from sim_bridge.ardupilot.vehicle import ArduCopter
from sim_bridge.dialects import Autopilot
from sim_bridge.px4.vehicle import Px4
from sim_bridge.state import GeodeticPoint
from sim_bridge.station import Station
from sim_bridge.vehicle.airframes import AirframeKind
from sim_bridge.vehicle.autopilot import VehicleAutopilot
from sim_bridge.vehicle.body import VehicleConfig

_HOST = "127.0.0.1"
_LAST_PORT = 65535
TICK_S = 0.01
# A setpoint is held until the next: a longer lead would fly stale ones at high speeds, a shorter one waste time.
LEAD_S = 0.07
STREAM_ENDED_S = 1.0
LONGEST_CATCH_UP_S = 0.2
TICKS_BETWEEN_HEARING = 20
IDLE_S = 0.002


def make_autopilot(kind: Autopilot, config: VehicleConfig) -> VehicleAutopilot:
    """A vehicle of a kind.

    Raises:
        ValueError: A parameter that it does not have.
    """
    match kind:
        case Autopilot.PX4:
            return Px4(config)
        case Autopilot.ARDUPILOT:
            return ArduCopter(config)


@dataclasses.dataclass
class _Plug:
    """A station with its socket."""

    station: Station
    socket: socket.socket
    clients: list[tuple[str, int]]
    news_wall_s: float = -math.inf
    failed: bool = False


class Simulator:
    """Vehicles, their sockets and the clock they share.

    Args:
        stations: The vehicles.
        port: The first vehicle sends to this port of this machine, the next to the next.
        speed: Vehicle seconds a wall second.
        ground_station_port: Every vehicle sends to this port too; None: nobody else listens.

    Raises:
        ValueError: A speed that is not positive, or a port that is none.
    """

    def __init__(
        self, stations: Sequence[Station], port: int, speed: float = 1.0, ground_station_port: int | None = None
    ) -> None:
        if not 0.0 < speed < math.inf:
            raise ValueError(f"speed must be positive and finite, got {speed}")
        ports = [*range(port, port + len(stations)), *([] if ground_station_port is None else [ground_station_port])]
        if not 1 <= min(ports) <= max(ports) <= _LAST_PORT or len(set(ports)) < len(ports):
            raise ValueError(f"every vehicle and the ground station need a UDP port of their own, got {ports}")
        self._speed = speed
        self._now_s = 0.0
        self._plugs: list[_Plug] = []
        self._selector = selectors.DefaultSelector()
        for index, station in enumerate(stations):
            own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            own.setblocking(False)
            own.bind((_HOST, 0))
            clients = [(_HOST, one) for one in (port + index, ground_station_port) if one is not None]
            plug = _Plug(station, own, clients)
            self._plugs.append(plug)
            self._selector.register(own, selectors.EVENT_READ, plug)

    def run(self, stop: Callable[[], bool]) -> None:
        """Fly until told to stop.

        What a vehicle's program fails with is told on stderr; with the last one that runs it is raised.
        """
        last_wall_s = time.monotonic()
        due_s = self._now_s
        while not stop():
            self._hear(0.0 if due_s - self._now_s > TICK_S else IDLE_S)
            wall_s = time.monotonic()
            due_s += (wall_s - last_wall_s) * self._speed
            last_wall_s = wall_s
            # What the wall's clock ran further than this is not made up for.
            due_s = min(due_s, self._allowed_s(wall_s), self._now_s + LONGEST_CATCH_UP_S * self._speed)
            for _ in range(TICKS_BETWEEN_HEARING):
                if self._now_s + TICK_S > due_s:
                    break
                self._now_s += TICK_S
                for plug in self._plugs:
                    if not plug.failed:
                        self._tell(plug, self._advanced(plug))

    def close(self) -> None:
        """Let go of the sockets."""
        self._selector.close()
        for plug in self._plugs:
            plug.socket.close()

    @property
    def failed(self) -> list[int]:
        """Systems of the vehicles whose programs failed."""
        return [plug.station.autopilot.body.config.system for plug in self._plugs if plug.failed]

    def _advanced(self, plug: _Plug) -> list[bytes]:
        try:
            return plug.station.advance(self._now_s)
        except Exception:
            plug.failed = True
            if all(one.failed for one in self._plugs):
                raise
            system = plug.station.autopilot.body.config.system
            print(f"vehicle {system} has failed and is silent from now on:", file=sys.stderr)
            traceback.print_exc()
            return []

    def _allowed_s(self, wall_s: float) -> float:
        """How far the clock may run: a moment ahead of the setpoints of every vehicle that is still sent new ones."""
        if self._speed <= 1.0:
            return math.inf
        return min(
            (
                plug.station.news_s + LEAD_S + plug.station.round_trip_s
                for plug in self._plugs
                if plug.station.news_s is not None
                and not plug.failed
                and wall_s - plug.news_wall_s < STREAM_ENDED_S
                and plug.station.autopilot.follows_setpoints()
            ),
            default=math.inf,
        )

    def _hear(self, wait_s: float) -> None:
        for key, _ in self._selector.select(wait_s):
            plug: _Plug = key.data
            while True:
                try:
                    data, sender = plug.socket.recvfrom(65536)
                except BlockingIOError:
                    break
                except ConnectionRefusedError:
                    # Nobody listened to what was sent earlier; they may yet.
                    continue
                if plug.failed or sender[0] != _HOST:
                    continue
                if plug.station.put(data, self._now_s):
                    plug.news_wall_s = time.monotonic()

    @staticmethod
    def _tell(plug: _Plug, datagrams: Sequence[bytes]) -> None:
        for data in datagrams:
            for client in plug.clients:
                try:
                    plug.socket.sendto(data, client)
                except (BlockingIOError, ConnectionRefusedError):
                    # Nobody is there yet, or too slow to take it all.
                    continue


@dataclasses.dataclass(frozen=True)
class Spawned:
    """A simulator in a process of its own.

    Attributes:
        address: For a link.
        process: It.
    """

    address: str
    process: subprocess.Popen[str]

    def stop(self) -> None:
        """End it."""
        self.process.terminate()
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()


def spawn(
    ground: GeodeticPoint,
    *,
    speed: float = 1.0,
    parameters: Sequence[tuple[str, float]] = (),
    endurance_s: float = 1200.0,
    ready_after_s: float = 3.0,
    seed: int = 0,
    autopilot: Autopilot = Autopilot.PX4,
    kind: AirframeKind = AirframeKind.QUADROTOR,
    drag_per_s: float | None = None,
    wander_m: float = 0.8,
    arguments: Sequence[str] = (),
) -> Spawned:
    """Start `sim-bridge` for one vehicle on a free port and wait until it runs.

    Args:
        ground: Where the vehicle stands.
        speed: Vehicle seconds a wall second.
        parameters: Changes to the autopilot's defaults.
        endurance_s: Time a full battery hovers.
        ready_after_s: From boot until it can be armed.
        seed: Of everything random.
        autopilot: Which personality.
        kind: What it is built like.
        drag_per_s: Deceleration per speed through the air, 1/s; None: that of its kind.
        wander_m: How far its position estimate wanders from the truth.
        arguments: Further options of `sim-bridge`.

    Raises:
        RuntimeError: It did not start; the text is what it said.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    place = f"{ground.latitude_deg:.9f},{ground.longitude_deg:.9f},{ground.altitude_amsl_m:.3f}"
    command = [
        sys.executable, "-m", "sim_bridge", "--json", "--port", str(port), "--speed", str(speed), "--origin", place,
        "--endurance", str(endurance_s), "--ready-after", str(ready_after_s), "--seed", str(seed),
        "--autopilot", autopilot.name.lower(), "--airframe", kind.value, "--wander", str(wander_m), "--with-parent",
    ]  # fmt: skip
    if drag_per_s is not None:
        command += ["--drag", str(drag_per_s)]
    for name, value in parameters:
        command += ["--param", f"{name}={value:g}"]
    # A session of its own: Ctrl-C is for the flight, which then flies home and needs its vehicle for that.
    process = subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, text=True, start_new_session=True)
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        raise RuntimeError(f"the simulator did not start (exit {process.wait()}); its error is above")
    return Spawned(address=f"udp://127.0.0.1:{json.loads(line)['ports'][0]}", process=process)
