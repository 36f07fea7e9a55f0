"""Ten minutes over a line that loses a fifth of everything and delays the rest by 200 ± 100 ms, in real time.

python -m benchmarks.flying.lossy [MINUTES]
"""

from __future__ import annotations

import collections
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.flying.processes import EXAMPLES, overrides, run_mission
from benchmarks.timing import machine
from mission.flying.flight_log import read_flight_log
from mission.loading import load
from mission.mission_file import Mission
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.simulator import spawn

MINUTES = 10.0
BAD_LINE = ("--loss", "0.2", "--delay", "0.2", "--jitter", "0.1")


def flown(mission: Mission, changes: list[str], line: tuple[str, ...]) -> dict[str, Any]:
    """Fly a mission over a line.

    Returns:
        The flight's summary; under "telemetry_hz" how often the vehicle's place came through, under "held" why it
        stood.
    """
    file = EXAMPLES / "forest.toml"
    vehicle = mission.vehicle
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "flight"
        simulator = spawn(
            geodetic_from_enu(mission.home_enu_m, mission.site.origin.point()),
            parameters=(
                ("COM_OBL_RC_ACT", 5.0),
                ("MPC_XY_VEL_MAX", vehicle.max_speed_mps),
                ("MPC_Z_VEL_MAX_UP", vehicle.max_climb_mps),
                ("MPC_Z_VEL_MAX_DN", vehicle.max_descent_mps),
            ),
            endurance_s=vehicle.endurance_s,
            arguments=line,
        )
        try:
            summary = run_mission(
                ["fly", str(file), "--link", simulator.address, "--out", str(folder), *overrides(changes)]
            )
        finally:
            simulator.stop()
        log = read_flight_log(folder)
        exploring = log.time_s[log.exploring()]
        held = [event["why"] for event in log.of_kind("phase") if event["phase"] in ("holding", "link lost")]
        return {
            **summary,
            "telemetry_hz": len(exploring) / max(float(exploring[-1] - exploring[0]), 1e-9),
            "held": collections.Counter(held),
        }


def main() -> None:
    """Fly, and print the table."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else MINUTES
    changes = [f"planner.duration_s={60.0 * minutes:g}", f"vehicle.endurance_s={max(1200.0, 150.0 * minutes):g}"]
    mission = load(EXAMPLES / "forest.toml", changes)
    print(f"{machine()}; forest, {minutes:g} minutes of exploration, real time, speed limit ", end="")
    print(f"{mission.vehicle.max_speed_mps:g} m/s, clearance margin {mission.flight.clearance_margin_m:g} m\n")
    summary = flown(mission, changes, BAD_LINE)
    replans = f"{summary['replans_taken']} of {summary['replans_asked']}"
    rows = {
        "outcome": summary["outcome"],
        "in the air": f"{summary['flown_s']:.0f} s",
        "telemetry that came through": f"{summary['telemetry_hz']:.0f} Hz",
        "greatest speed": f"{summary['max_speed_mps']:.2f} m/s",
        "tracking error, mean and greatest": f"{summary['tracking_error_mean_m']:.2f} m, "
        f"{summary['tracking_error_max_m']:.2f} m",
        "least clearance": f"{summary['min_clearance_m']:.2f} m",
        "ergodic metric flown": f"{summary['ergodic_metric']:.4f}",
        "replans taken": replans,
        "Offboard lost": f"{summary['offboard_lost']} times",
        "interruptions": ", ".join(f"{count} × {why}" for why, count in summary["held"].items()) or "none",
        "violations": "; ".join(summary["violations"]) or "none",
    }
    print("| 20 % loss, 200 ± 100 ms delay, each way | |")
    print("|---|---|")
    for name, value in rows.items():
        print(f"| {name} | {value} |")


if __name__ == "__main__":
    main()
