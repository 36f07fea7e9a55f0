"""The gap between setpoints over a long flight in real time, with replans solved beside it.

Measured where they leave (the sender's monotonic clock at its socket) and where they arrive (the vehicle's clock, as
its own log has it, to a hundredth of a second); all of them, and only those that are new: mavsdk repeats the last one
by itself, which says nothing of the flight.

python -m benchmarks.flying.gap [MINUTES [FOLDER]]

With a folder the flight is kept there, its log and its wire, to look into what was late.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import struct
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.flying.processes import EXAMPLES, overrides, run_mission
from benchmarks.timing import machine
from mission.flying.flight_log import read_flight_log
from mission.flying.recorder import LOG_NAME
from mission.loading import load
from sim_bridge.codec import frames_in, mavlink
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.simulator import spawn

MINUTES = 30.0
ON_THE_WAY_S = 90.0
"""Take-off, way to the start, way home and landing."""
INTERRUPTED_S = 5.0
"""A pause longer than this is the end of one stream and the beginning of another."""
_STAMP = struct.Struct(">Q")
_CLOCK_BYTES, _VELOCITY_BEGINS = 4, 12
_VELOCITY = struct.Struct("<3f")


def setpoints_heard(path: Path) -> Iterator[tuple[float, bytes]]:
    """Moments in seconds and payloads without the sender's clock, of every setpoint in a vehicle's log."""
    data = path.read_bytes()
    place = 0
    while place + _STAMP.size < len(data):
        (stamp_us,) = _STAMP.unpack_from(data, place)
        place += _STAMP.size
        # Magic, length, flags: twelve bytes around the payload, and a signature of thirteen where the flag says so.
        size = data[place + 1] + 12 + (13 if data[place + 2] & 1 else 0)
        for message_id, payload in frames_in(data[place : place + size]):
            if message_id == mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
                yield stamp_us * 1e-6, payload[_CLOCK_BYTES:]
        place += size


def sent_s(folder: Path) -> Float[np.ndarray, "setpoint"]:
    """When the flight gave its own setpoints out, host clock."""
    moments = []
    for line in (folder / LOG_NAME).read_text(encoding="utf-8").splitlines():
        if '"kind":"setpoint"' in line:
            moments.append(json.loads(line)["host"])
    return np.array(moments)


def gaps_s(moments_s: Float[np.ndarray, "setpoint"]) -> Float[np.ndarray, "gap"]:
    """Times between setpoints of one stream."""
    gaps = np.diff(moments_s)
    return gaps[gaps < INTERRUPTED_S]


def row(name: str, gaps: Float[np.ndarray, "gap"]) -> str:
    """A line of the table."""
    quantiles = 1e3 * np.quantile(gaps, [0.5, 0.99, 0.999])
    late = int((gaps > 0.1).sum())
    return (
        f"| {name} | {len(gaps)} | "
        + " | ".join(f"{value:.0f} ms" for value in quantiles)
        + (f" | {1e3 * gaps.max():.0f} ms | {late} |")
    )


def main() -> None:
    """Fly, and print the table."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else MINUTES
    exploration_s = max(60.0, 60.0 * minutes - ON_THE_WAY_S)
    changes = [f"planner.duration_s={exploration_s:g}", f"vehicle.endurance_s={2.0 * exploration_s + 600.0:g}"]
    file = EXAMPLES / "search.toml"
    mission = load(file, changes)
    with contextlib.ExitStack() as stack:
        kept = sys.argv[2] if len(sys.argv) > 2 else None
        scratch = kept or stack.enter_context(tempfile.TemporaryDirectory())
        folder = Path(scratch) / "flight"
        vehicle = spawn(
            geodetic_from_enu(mission.home_enu_m, mission.site.origin.point()),
            parameters=(("COM_OBL_RC_ACT", 5.0), ("MPC_XY_VEL_MAX", mission.vehicle.max_speed_mps)),
            endurance_s=mission.vehicle.endurance_s,
            arguments=("--record", scratch),
        )
        try:
            summary = run_mission(
                ["fly", str(file), "--link", vehicle.address, "--out", str(folder), *overrides(changes)]
            )
        finally:
            vehicle.stop()
        heard = list(setpoints_heard(Path(scratch) / "vehicle-1.tlog"))
        log = read_flight_log(folder)
        given_s = sent_s(folder)
    arrived_s = np.array([moment for moment, _ in heard])
    # A setpoint that stands still is as good as new each time it is repeated.
    new = [True]
    new += [
        after[1] != before[1] or not any(_VELOCITY.unpack_from(after[1], _VELOCITY_BEGINS))
        for before, after in itertools.pairwise(heard)
    ]
    print(f"{machine()}; search, {summary['flown_s'] / 60.0:.1f} minutes in the air in real time, one process flying,")
    print(f"one solving ({summary['replans_taken']} of {summary['replans_asked']} replans taken), one vehicle\n")
    print("| setpoints | gaps | median | p99 | p99.9 | longest | over 100 ms |")
    print("|---|---|---|---|---|---|---|")
    print(row("new ones, as the flight gives them out", gaps_s(given_s)))
    print(row("new ones, as the vehicle hears them", gaps_s(arrived_s[np.array(new)])))
    print(row("all, as the vehicle hears them", gaps_s(arrived_s)))
    print(
        f"\nAt the sender's socket, new ones: p99.9 {1e3 * summary['setpoint_gap_p999_s']:.0f} ms, longest "
        f"{1e3 * summary['setpoint_gap_max_s']:.0f} ms. {summary['outcome']}; Offboard lost {summary['offboard_lost']} "
        f"times; {len(log.of_kind('stall'))} stalls; violations: {'; '.join(summary['violations']) or 'none'}."
    )


if __name__ == "__main__":
    main()
