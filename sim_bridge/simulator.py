"""Built-in vehicles on UDP, in real time or faster.

Faster means lock-step: the vehicle's clock runs `speed` times faster than the wall's, but never further than a moment
ahead of the last new setpoint while setpoints are followed. A busy machine so slows the simulation down and does not
lose its stream; a stream that has truly ended (nothing new for a second of wall time) lets the clock run on.
"""

from __future__ import annotations

import dataclasses
import json
import select
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence

from sim_bridge.autopilot import VehicleAutopilot
from sim_bridge.body import VehicleConfig
from sim_bridge.channel import Channel, Quality
from sim_bridge.codec import Codec
from sim_bridge.link_autopilot import Autopilot
from sim_bridge.px4 import Px4
from sim_bridge.state import GeodeticPoint

TICK_S = 0.01
LEAD_S = 0.2
STREAM_ENDED_S = 1.0
LONGEST_CATCH_UP_S = 0.2
IDLE_S = 0.002


def make_autopilot(kind: Autopilot, config: VehicleConfig) -> VehicleAutopilot:
    """A vehicle of a kind.

    Raises:
        ValueError: A kind that is not built in, or a parameter that it does not have.
    """
    match kind:
        case Autopilot.PX4:
            return Px4(config)
        case Autopilot.ARDUPILOT:
            raise ValueError("the built-in vehicle speaks as PX4 only: write --autopilot px4")


@dataclasses.dataclass
class _Station:
    """One vehicle with its socket."""

    autopilot: VehicleAutopilot
    codec: Codec
    socket: socket.socket
    client: tuple[str, int]
    inward: Channel
    outward: Channel


class Simulator:
    """Vehicles, their sockets and the clock they share.

    Args:
        kind: Which autopilot.
        configs: One a vehicle.
        port: The first vehicle sends to this port of this machine, the next to the next.
        speed: Vehicle seconds a wall second.
        quality: Of the lines.
    """

    def __init__(
        self,
        kind: Autopilot,
        configs: Sequence[VehicleConfig],
        port: int,
        speed: float = 1.0,
        quality: Quality | None = None,
    ) -> None:
        if not speed > 0.0:
            raise ValueError(f"speed must be positive, got {speed}")
        self._speed = speed
        self._now_s = 0.0
        self._stations = []
        line = quality or Quality()
        for index, config in enumerate(configs):
            own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            own.bind(("127.0.0.1", 0))
            own.setblocking(False)
            self._stations.append(
                _Station(
                    autopilot=make_autopilot(kind, config),
                    codec=Codec(config.system),
                    socket=own,
                    client=("127.0.0.1", port + index),
                    inward=Channel(line, 2 * config.seed),
                    outward=Channel(line, 2 * config.seed + 1),
                )
            )

    def run(self, stop: Callable[[], bool]) -> None:
        """Fly until told to stop."""
        last_wall_s = time.monotonic()
        news_wall_s = last_wall_s
        newest: list[float | None] = []
        while not stop():
            self._hear()
            wall_s = time.monotonic()
            latest = [station.autopilot.streamed_to_s() for station in self._stations]
            if latest != newest:
                newest, news_wall_s = latest, wall_s
            wanted_s = self._now_s + min((wall_s - last_wall_s) * self._speed, LONGEST_CATCH_UP_S)
            last_wall_s = wall_s
            followed = [at_s for at_s in latest if at_s is not None]
            if followed and self._speed > 1.0 and wall_s - news_wall_s < STREAM_ENDED_S:
                wanted_s = min(wanted_s, min(followed) + LEAD_S)
            while self._now_s + TICK_S <= wanted_s:
                self._now_s += TICK_S
                for station in self._stations:
                    self._tell(station, station.autopilot.tick(self._now_s))
            if wanted_s > self._now_s:
                # What is less than a tick is kept for the next round.
                last_wall_s -= (wanted_s - self._now_s) / self._speed

    def close(self) -> None:
        """Let go of the sockets."""
        for station in self._stations:
            station.socket.close()

    def _hear(self) -> None:
        sockets = [station.socket for station in self._stations]
        ready, _, _ = select.select(sockets, [], [], IDLE_S)
        wall_s = time.monotonic()
        for station in self._stations:
            while station.socket in ready:
                try:
                    data, _ = station.socket.recvfrom(65536)
                except BlockingIOError:
                    break
                except ConnectionRefusedError:
                    # Nobody listened to what was sent earlier; they may yet.
                    continue
                station.inward.put(data, wall_s)
            for data in station.inward.arrived(wall_s):
                for message in station.codec.decode(data):
                    self._tell(station, station.autopilot.receive(message, self._now_s))

    def _tell(self, station: _Station, messages: Sequence[object]) -> None:
        wall_s = time.monotonic()
        for message in messages:
            station.outward.put(station.codec.encode(message), wall_s)
        for data in station.outward.arrived(wall_s):
            try:
                station.socket.sendto(data, station.client)
            except (BlockingIOError, ConnectionRefusedError):
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
        "--autopilot", autopilot.name.lower(),
    ]  # fmt: skip
    for name, value in parameters:
        command += ["--param", f"{name}={value:g}"]
    process = subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        raise RuntimeError(f"the simulator did not start (exit {process.wait()}); its error is above")
    return Spawned(address=f"udp://127.0.0.1:{json.loads(line)['ports'][0]}", process=process)
