"""A million random and mutated frames into both ends, and whole mutated plans: nothing raises, and nothing grows.

The vehicles are in the air and hear what `tests/sim_bridge/test_fuzz.py` makes; others are sent plans with odd items,
whose uploads go to the end, and fly what they accept (`tests/sim_bridge/test_fuzz_plans.py`). The client is the real
one, mavsdk included, on a wire that brings nothing else; what it hears goes on to an executive with a mission to fly.

python -m benchmarks.flying.fuzz [FRAMES]
"""

from __future__ import annotations

import ctypes
import functools
import gc
import os
import random
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.faults.pillar import along_corners, mission, problem
from benchmarks.timing import machine
from mission.executive.events import (
    Assignment,
    Checked,
    Connected,
    Event,
    FindWay,
    FlightEnd,
    FlightMethod,
    RunChecks,
    WayFound,
)
from mission.executive.executive import Executive
from mission.flying.belief import Belief
from mission.flying.flight_rules import energy_of, monitors_of
from mission.flying.ways import along
from sim_bridge.codec import mavlink
from sim_bridge.dialects import Autopilot
from sim_bridge.link.client import Link
from tests.mission.proven import proven
from tests.sim_bridge.test_fuzz import VEHICLE, frame, fuzz
from tests.sim_bridge.test_fuzz_plans import ROUNDS, fuzz_plans

FRAMES = 1_000_000
TOLD = (
    "HEARTBEAT",
    "LOCAL_POSITION_NED",
    "ATTITUDE",
    "SYS_STATUS",
    "BATTERY_STATUS",
    "EXTENDED_SYS_STATE",
    "HOME_POSITION",
    "GPS_GLOBAL_ORIGIN",
    "GLOBAL_POSITION_INT",
    "STATUSTEXT",
    "MISSION_CURRENT",
    "MISSION_ITEM_REACHED",
    "COMMAND_ACK",
    "PARAM_VALUE",
    "MISSION_COUNT",
    "MISSION_ITEM_INT",
    "MISSION_REQUEST_INT",
    "MISSION_ACK",
    "TIMESYNC",
)
SOUND_EVERY = 25
FLIGHT_FRAMES = 2000
BATCH = 50
WARM_SHARE = 0.25
_PAGE_KIB = os.sysconf("SC_PAGE_SIZE") // 1024


def resident_kib() -> int:
    """Memory of this process that is in use: what the allocator only keeps for later is given back first."""
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):
        trim(0)
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * _PAGE_KIB


class FuzzedWire:
    """Brings frames as a mad vehicle sends them, some sound ones among them; swallows what is sent.

    Args:
        frames: How many in all.
        seed: Of what they hold.
    """

    datagrams = True

    def __init__(self, frames: int, seed: int) -> None:
        self._left = frames
        self._chance = random.Random(seed)
        self._codec = mavlink.MAVLink(None, *VEHICLE)
        self.brought = 0
        self.begun = False

    def believe(self) -> None:
        """There is nobody else to answer to."""

    def receive(self, timeout_s: float) -> bytes:
        """Some frames in one datagram; heartbeats alone until the flight begins."""
        if not self.begun or self._left <= 0:
            time.sleep(timeout_s)
            return b"".join(self._sound())
        batch = []
        for _ in range(min(BATCH, self._left)):
            self.brought += 1
            batch.append(frame(self._chance, self.brought, TOLD, VEHICLE))
            if self.brought % SOUND_EVERY == 0:
                batch += self._sound()
        self._left -= min(BATCH, self._left)
        return b"".join(batch)

    @property
    def empty(self) -> bool:
        """Whether everything was brought."""
        return self._left <= 0

    def send(self, data: bytes) -> None:
        """Swallow."""

    def close(self) -> None:
        """Nothing to let go of."""

    def _sound(self) -> list[bytes]:
        """What a vehicle in flight says."""
        self._codec.seq = (self._codec.seq + 1) % 256
        moment_ms = int(self.brought * 10 % 2**32)
        armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED | mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        messages = (
            mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_PX4, armed, 6 << 16, 4, 3),
            mavlink.MAVLink_attitude_message(moment_ms, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0),
            mavlink.MAVLink_gps_global_origin_message(473977000, 85456000, 488000, 0),
            mavlink.MAVLink_home_position_message(
                473977000, 85456000, 488000, 0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0
            ),
            mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0),
            mavlink.MAVLink_extended_sys_state_message(0, 2),
            mavlink.MAVLink_local_position_ned_message(moment_ms, 20.0, 20.0, -12.0, 0.0, 0.0, 0.0),
        )
        return [bytes(message.pack(self._codec)) for message in messages]


@functools.cache
def _assignment() -> Assignment:
    limits = problem().limits
    return Assignment(
        exploration=along_corners(),
        takeoff_altitude_m=mission().takeoff_altitude_m,
        end=FlightEnd.RETURN,
        method=FlightMethod.OFFBOARD,
        max_acceleration_mps2=limits.max_acceleration_mps2,
        max_yaw_rate_radps=limits.max_yaw_rate_radps,
        max_climb_mps=limits.max_climb_mps,
        resumed=True,
    )


def _executive() -> Executive:
    belief = Belief(problem())
    monitors = monitors_of(mission(), belief, energy_of(mission(), problem()))
    executive = Executive(_assignment(), monitors, lambda: belief.problem)
    executive.receive(Connected(), 0.0)
    return executive


def _way_found(asked: FindWay) -> WayFound:
    """The straight way; from where a mutated frame says that the vehicle is there may be none."""
    try:
        return WayFound(asked, proven(along(np.array([asked.start_m, asked.end_m]), problem().limits)))
    except ValueError as refused:
        return WayFound(asked, None, str(refused))


def _hear(executive: Executive, event: Event, now_s: float) -> None:
    """Give an executive what was heard, and the answers that it asks for."""
    for action in executive.receive(event, now_s) + executive.tick(now_s):
        match action:
            case RunChecks():
                executive.receive(Checked(()), now_s)
            case FindWay():
                executive.receive(_way_found(action), now_s)
            case _:
                pass


def client(frames: int) -> tuple[int, int, int]:
    """Let a flight client hear so many frames.

    Returns:
        Frames brought, events that came of them, and growth of the memory in KiB after a quarter of the frames.
    """
    first = int(WARM_SHARE * frames)
    events = _hear_frames(first, seed=1)
    gc.collect()
    before_kib = resident_kib()
    events += _hear_frames(frames - first, seed=2)
    gc.collect()
    return frames, events, resident_kib() - before_kib


def _hear_frames(frames: int, seed: int) -> int:
    """Let one client hear so many frames; how many events came of them."""
    wire, raised = FuzzedWire(frames, seed), []
    # What is raised on one of the link's threads ends that thread alone.
    threading.excepthook = raised.append
    link = Link(wire, mission().site.origin.point())
    events = 0
    try:
        link.wait_heard(10.0)
        wire.begun = True
        executive, flown, now_s = _executive(), 0, 0.0
        while not wire.empty and not raised:
            for timed in link.events(0.05):
                events += 1
                now_s += 0.01
                _hear(executive, timed.event, now_s)
            if executive.finished or wire.brought - flown > FLIGHT_FRAMES:
                executive, flown, now_s = _executive(), wire.brought, 0.0
        if raised:
            raise RuntimeError(f"a thread of the link ended after {wire.brought} frames") from raised[0].exc_value
        return events
    finally:
        link.close()


def vehicle(autopilot: Autopilot, frames: int) -> tuple[int, int, int]:
    """Let a vehicle in the air hear so many frames.

    Returns:
        Frames brought, datagrams it still says in a second afterwards, and growth of the memory in KiB after a quarter
        of the frames.
    """
    first = int(WARM_SHARE * frames)
    fuzz(autopilot, first, seed=1)
    gc.collect()
    before_kib = resident_kib()
    said = fuzz(autopilot, frames - first, seed=2)
    gc.collect()
    return frames, len(said), resident_kib() - before_kib


def plans(autopilot: Autopilot, count: int) -> tuple[int, int, int]:
    """Let vehicles in the air take so many mutated plans, and fly them.

    Returns:
        Plans brought, how many were accepted, and growth of the memory in KiB after a quarter of them.
    """
    flights = -(-count // ROUNDS)
    first = int(WARM_SHARE * flights)
    accepted = sum(fuzz_plans(autopilot, seed) for seed in range(first))
    gc.collect()
    before_kib = resident_kib()
    accepted += sum(fuzz_plans(autopilot, seed) for seed in range(first, flights))
    gc.collect()
    return flights * ROUNDS, accepted, resident_kib() - before_kib


def main() -> None:
    """Print the table."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    print(f"{machine()}\n")
    print("| end | frames or plans, none of which raised anything | came of it | memory grew by | each |")
    print("|---|---|---|---|---|")
    ends: dict[str, tuple[Callable[[int], tuple[int, int, int]], int, str]] = {
        f"vehicle, {autopilot.name.lower()}": (functools.partial(vehicle, autopilot), frames // 2, "datagrams, alive")
        for autopilot in Autopilot
    }
    ends |= {
        f"plans flown, {autopilot.name.lower()}": (functools.partial(plans, autopilot), frames // 1000, "accepted")
        for autopilot in Autopilot
    }
    ends["flight client"] = (client, frames, "events")
    for name, (run, count, what) in ends.items():
        began_s = time.perf_counter()
        brought, came, grown_kib = run(count)
        spent_us = 1e6 * (time.perf_counter() - began_s) / brought
        print(f"| {name} | {brought:,} | {came:,} {what} | {grown_kib} KiB | {spent_us:.0f} µs |", flush=True)


if __name__ == "__main__":
    main()
