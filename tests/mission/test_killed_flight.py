"""kill −9 in the air: the vehicle looks after itself, and the flight is taken up where it was."""

import dataclasses
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mission.flying.flight import Outcome, fly_planned
from mission.flying.flight_folder import read_flight_folder
from mission.flying.flight_log import read_flight_log
from mission.flying.flight_progress import Watcher
from mission.flying.recorder import LOG_NAME
from mission.flying.resuming import resumption
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.link.client import Link
from sim_bridge.simulator import spawn
from sim_bridge.state import FlightMode, VehicleState
from tests.mission.killed_flight import CORNERS, planned, settings

SPEED = 4.0


@pytest.fixture
def vehicle(tmp_path):
    mission = planned(tmp_path).mission
    spawned = spawn(
        geodetic_from_enu(mission.home_enu_m, mission.site.origin.point()),
        speed=SPEED,
        parameters=(("COM_OBL_RC_ACT", 5.0), ("COM_LOW_BAT_ACT", 3.0)),
        wander_m=0.1,
    )
    yield spawned
    spawned.stop()


def explores(lines: list[str]) -> bool:
    """Whether it has explored for three seconds."""
    exploring = [line for line in lines if '"phase":"exploring"' in line and '"kind":"telemetry"' in line]
    return len(exploring) > 2 and json.loads(exploring[-1])["t"] - json.loads(exploring[0])["t"] > 3.0


def returns(lines: list[str]) -> bool:
    """Whether it is on its way home."""
    return any('"phase":"returning"' in line and '"kind":"telemetry"' in line for line in lines)


def killed_once(begun: Callable[[list[str]], bool], address: str, folder: Path) -> None:
    root = Path(__file__).parents[2]
    process = subprocess.Popen([sys.executable, "-m", "tests.mission.killed_flight", address, str(folder)], cwd=root)
    log, until = folder / "flight" / LOG_NAME, time.monotonic() + 120.0
    try:
        while time.monotonic() < until:
            assert process.poll() is None, "the flight ended before it was killed"
            lines = log.read_text().splitlines()[:-1] if log.exists() else []
            if begun(lines):
                return
            time.sleep(0.1)
        raise AssertionError("it never came to that")
    finally:
        process.kill()
        process.wait()


def what_it_does_alone(address: str, folder: Path, host_s: float) -> list[VehicleState]:
    link = Link.connect(address, planned(folder).mission.site.origin.point())
    try:
        until, states = time.monotonic() + host_s, []
        while time.monotonic() < until:
            states += [timed.event for timed in link.events(0.1) if isinstance(timed.event, VehicleState)]
        return states
    finally:
        link.close()


def test_a_killed_flight_leaves_a_vehicle_that_holds_and_is_flown_on_from_the_air(vehicle, tmp_path):
    killed_once(explores, vehicle.address, tmp_path)
    alone = what_it_does_alone(vehicle.address, tmp_path, 2.0)
    assert alone[-1].mode is FlightMode.HOLD
    assert alone[-1].aloft
    assert alone[-1].position_enu_m[2] > 4.0

    left = resumption(read_flight_folder(tmp_path / "flight"))
    assert left is not None
    again = dataclasses.replace(settings(vehicle.address, tmp_path), from_s=left.from_s, flown_m=left.left.flown_m)
    flown = fly_planned(left.planned, again, Watcher())
    assert flown.outcome is Outcome.DONE, flown.summary
    assert "taking off" not in flown.summary["phases"][-6:]
    log = read_flight_log(tmp_path / "flight")
    for corner in CORNERS:
        assert np.linalg.norm(log.position_m[log.exploring()] - corner, axis=1).min() < 1.0
    assert resumption(read_flight_folder(tmp_path / "flight")) is None


def test_a_flight_that_is_killed_on_its_way_home_is_brought_home(vehicle, tmp_path):
    killed_once(returns, vehicle.address, tmp_path)
    assert what_it_does_alone(vehicle.address, tmp_path, 2.0)[-1].aloft

    left = resumption(read_flight_folder(tmp_path / "flight"))
    assert left is not None
    assert left.left.only_home
    again = dataclasses.replace(
        settings(vehicle.address, tmp_path), from_s=left.from_s, flown_m=left.left.flown_m, only_home=True
    )
    flown = fly_planned(left.planned, again, Watcher())
    assert flown.outcome is Outcome.DONE, flown.summary
    # From the air straight home: nothing is explored again.
    assert flown.summary["phases"][-4:] == ["taking over to return", "returning", "landing", "landed"]
    assert resumption(read_flight_folder(tmp_path / "flight")) is None
