"""A flight in a process of its own, to be killed: `python -m tests.mission.killed_flight ADDRESS FOLDER`."""

import sys
from pathlib import Path

import numpy as np

from mission.executive.events import FlightMethod
from mission.flying.flight import FlightSettings, fly_planned
from mission.flying.flight_progress import Watcher
from mission.planning import Planned
from tests.mission.hand_made import plan_by_hand

MISSION = """
[site]
origin = { latitude_deg = 47.3977, longitude_deg = 8.5456, altitude_amsl_m = 488.0 }
box_min_enu_m = [0.0, 0.0, 4.0]
box_max_enu_m = [60.0, 40.0, 20.0]
fence_margin_m = 10.0
[information]
kind = "uniform"
[planner]
start_enu_m = [15.0, 15.0, 6.0]
duration_s = 40.0
modes = [4, 4, 2]
[flight]
takeoff_altitude_m = 5.0
end = "return"
[replanning]
enabled = false
"""
CORNERS = np.array([[15.0, 15.0, 6.0], [50.0, 15.0, 6.0], [50.0, 30.0, 8.0], [15.0, 30.0, 6.0]])


def planned(folder: Path) -> Planned:
    """A plan made by hand, with its mission file in a folder."""
    return plan_by_hand(MISSION, CORNERS, folder)


def settings(address: str, folder: Path) -> FlightSettings:
    """By setpoints, to a vehicle that lives on."""
    return FlightSettings(address, FlightMethod.OFFBOARD, 1.0, folder / "flight")


if __name__ == "__main__":
    where = Path(sys.argv[2])
    fly_planned(planned(where), settings(sys.argv[1], where), Watcher())
