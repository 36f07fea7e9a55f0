"""A small mission against a real autopilot's simulator, which is started by hand: see docs/autopilots.md.

`MISSION_SITL_LINK` says where the vehicle is heard (`udp://:14540`); it must stand at the mission's home, disarmed,
with the parameters that docs/flying.md asks for.
"""

import os

import numpy as np
import pytest

from mission.executive.events import FlightMethod
from mission.flying.flight import FlightSettings, Outcome, fly_planned
from mission.flying.flight_folder import read_flight_folder
from mission.flying.flight_log import read_flight_log
from mission.flying.flight_progress import Watcher
from sim_bridge.link.client import Link
from sim_bridge.state import VehicleState
from tests.mission.killed_flight import CORNERS, planned

ADDRESS = os.environ.get("MISSION_SITL_LINK", "")

pytestmark = [
    pytest.mark.sitl,
    pytest.mark.timeout(900),
    pytest.mark.skipif(not ADDRESS, reason="MISSION_SITL_LINK names no autopilot's simulator to fly"),
]


@pytest.mark.parametrize("method", FlightMethod)
def test_a_real_autopilot_flies_the_course_and_lands(method, tmp_path):
    flight = tmp_path / "flight"
    flown = fly_planned(planned(tmp_path), FlightSettings(ADDRESS, method, 1.0, flight), Watcher())
    assert flown.outcome is Outcome.DONE, flown.summary
    assert flown.summary["violations"] == []
    log = read_flight_log(flight)
    nearest_m = [np.linalg.norm(log.position_m[log.exploring()] - corner, axis=1).min() for corner in CORNERS]
    # An estimate that wanders by 0.8 m, and waypoints that are taken in passing.
    assert max(nearest_m) < 4.0, nearest_m
    assert read_flight_folder(flight).summary is not None


def test_a_real_autopilot_tells_its_state_in_the_missions_frame(tmp_path):
    mission = planned(tmp_path).mission
    link = Link.connect(ADDRESS, mission.site.origin.point())
    try:
        seen = [timed.event for _ in range(50) for timed in link.events(0.1)]
        states = [event for event in seen if isinstance(event, VehicleState)]
        assert states
        assert states[-1].home_enu_m is not None
        position, home = np.asarray(states[-1].position_enu_m), np.asarray(states[-1].home_enu_m)
        # It stands where it calls home, which is near to where the mission begins.
        assert np.linalg.norm(position - home) < 3.0
        assert np.linalg.norm(home - np.asarray(mission.home_enu_m)) < 30.0
    finally:
        link.close()
