"""The judge of the fault matrix notices what it is there to notice."""

import math

import numpy as np
import pytest

from benchmarks.faults import rehearsal
from benchmarks.faults.matrix import FAULTS, Cell, cells, fly_cell
from benchmarks.faults.pillar import clearance_m, outside_fence_m
from benchmarks.faults.rehearsal import Rehearsal
from benchmarks.faults.virtual_link import VirtualLink
from benchmarks.faults.witness import STALE_S, Witness
from mission.executive.phases import Phase
from sim_bridge.codec import mavlink
from sim_bridge.dialects import Autopilot
from sim_bridge.faults import PilotSwitch
from sim_bridge.px4.vehicle import Px4
from sim_bridge.state import FlightMode, GeodeticPoint
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.line_client import Client

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)


def setpoint(clock_ms: int, speed_mps: float, east_m: float = 5.0) -> bytes:
    message = mavlink.MAVLink_set_position_target_local_ned_message(
        clock_ms, 1, 1, 1, 2048, 1.0, east_m, -10.0, speed_mps, -0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    )
    return bytes(message.pack(mavlink.MAVLink(None, 245, 190)))


@pytest.fixture
def witness() -> Witness:
    return Witness(Px4(VehicleConfig(GROUND)), GROUND)


def test_a_moving_setpoint_heard_again_much_later_is_stale(witness):
    witness.record(1.0, setpoint(100, 4.0))
    witness.record(1.0 + STALE_S - 0.1, setpoint(200, 4.0))
    assert not witness.broken
    witness.record(1.1 + STALE_S, setpoint(300, 4.0))
    assert "stale" in witness.broken


def test_a_setpoint_that_stands_still_may_be_repeated_for_ever(witness):
    for second in range(60):
        witness.record(float(second), setpoint(1000 * second, 0.0))
    assert not witness.broken


def test_a_number_that_is_none_is_noticed(witness):
    witness.record(1.0, setpoint(100, 4.0, math.nan))
    assert "non-finite" in witness.broken


def test_a_vehicle_on_the_ground_may_be_left_alone(witness):
    client = Client(Autopilot.PX4, [])
    assert Witness(client.vehicle, GROUND).left_alone(client.station, 0.0, 5.0) == ""


def test_a_vehicle_in_a_pilots_mode_that_nobody_flies_may_not_be_left_alone():
    client = Client(Autopilot.PX4, [])
    client.fly()
    client.vehicle.pilot_switches(FlightMode.PILOT)
    seen = Witness(client.vehicle, GROUND)
    client.station._record = seen.record
    assert seen.left_alone(client.station, client.now_s, 40.0) == "left armed in pilot"


def test_a_vehicle_that_holds_by_itself_may_be_left_alone():
    client = Client(Autopilot.PX4, [])
    client.fly()
    client.vehicle.pilot_switches(FlightMode.HOLD)
    seen = Witness(client.vehicle, GROUND)
    client.station._record = seen.record
    assert seen.left_alone(client.station, client.now_s, 60.0) == ""


def test_setpoints_that_go_on_after_the_pilot_took_over_are_noticed(monkeypatch):
    monkeypatch.setattr(VirtualLink, "close_stream", lambda self: None)
    flown = Rehearsal(Autopilot.PX4, (PilotSwitch(begin_s=40.0, mode=FlightMode.PILOT),)).fly()
    assert flown.ended is Phase.OVERRIDDEN
    assert any("a setpoint left while" in fault for fault in flown.faults)
    assert any("a setpoint was heard while" in fault for fault in flown.faults)


def test_a_text_that_is_kept_from_the_log_is_noticed(monkeypatch):
    monkeypatch.setattr(rehearsal, "Say", type("Nothing", (), {"__match_args__": ("text",)}))
    flown = Rehearsal(Autopilot.PX4).fly()
    assert any("not told" in fault for fault in flown.faults)


def test_the_fence_and_the_pillar_are_where_the_mission_has_them():
    assert clearance_m(np.array([60.0, 50.0 + 5.0 + 0.4 + 2.0, 12.0])) == pytest.approx(2.0)
    assert clearance_m(np.array([60.0, 50.0, 41.4])) == pytest.approx(1.0)
    assert clearance_m(np.array([60.0, 50.0, 12.0])) < 0.0
    assert outside_fence_m(np.array([-43.0, 50.0, 12.0])) == pytest.approx(3.0)
    assert outside_fence_m(np.array([60.0, 50.0, 20.0])) < 0.0


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_breaks_nothing_in_any_phase(fault):
    seed = 1
    flown = [fly_cell(Cell(cell.fault, cell.moment, cell.autopilot, seed)) for cell in cells(1) if cell.fault == fault]
    assert [(cell, broken) for cell, _, broken in flown if broken] == []
