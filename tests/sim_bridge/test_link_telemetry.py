"""What a vehicle tells, as states and events."""

import math
import os

import pytest

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.dialects import Autopilot, flight_mode
from sim_bridge.frames import VehicleFrame
from sim_bridge.link.telemetry import READY_BIT, Telemetry
from sim_bridge.state import (
    GRAVITY_MPS2,
    FlightMode,
    LandedState,
    MissionProgress,
    StatusText,
    VehicleState,
    Waiting,
)
from tests.sim_bridge.vehicle_messages import ORIGIN, complete, heartbeat, position


def test_nothing_is_told_before_everything_is_known_and_what_is_missing_is_named():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    (waiting,) = telemetry.receive(heartbeat())
    assert isinstance(waiting, Waiting)
    assert "its local position estimate" in waiting.waiting_for
    complete(telemetry)
    (state,) = telemetry.receive(position(1033, 3.0, 4.0, -5.0))
    assert isinstance(state, VehicleState)
    assert state.ready
    assert state.time_s == pytest.approx(1.033)
    assert state.position_enu_m == pytest.approx((4.0, 3.0, 5.0), abs=0.02)
    assert state.velocity_enu_mps == (2.0, 1.0, -3.0)
    assert state.yaw_enu_rad == pytest.approx(1.5707963 - 0.5)
    assert state.battery_fraction == 0.77
    assert state.landed is LandedState.IN_AIR
    assert state.home_enu_m == pytest.approx((0.0, 0.0, 1.5), abs=1e-3)


def test_failing_pre_arm_checks_are_named_by_their_sensors():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    gps = mavlink.MAV_SYS_STATUS_SENSOR_GPS
    everything = READY_BIT | gps
    telemetry.receive(mavlink.MAVLink_sys_status_message(everything, everything, 0, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0))
    assert telemetry.waiting_for() == ("its pre-arm checks (GPS)",)


def status(present: int, health: int):
    return mavlink.MAVLink_sys_status_message(present, present, health, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0)


def test_px4_does_not_say_that_it_has_pre_arm_checks_and_is_waited_for_all_the_same():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(status(0, 0))
    assert telemetry.waiting_for() == ("its pre-arm checks",)
    telemetry.receive(status(0, READY_BIT))
    assert telemetry.waiting_for() == ()


def test_px4_that_stands_in_offboard_passes_no_checks_there_and_is_not_waited_for():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(status(0, 0))
    telemetry.receive(heartbeat(custom_mode=6 << 16))
    assert telemetry.waiting_for() == ()
    telemetry.receive(heartbeat(custom_mode=3 << 16))
    assert telemetry.waiting_for() == ("its pre-arm checks (in a mode that needs a transmitter)",)


def test_whether_it_stands_or_flies_is_waited_for():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(mavlink.MAVLink_extended_sys_state_message(0, 0))
    assert telemetry.waiting_for() == ("whether it stands or flies",)


def test_positions_that_come_late_or_twice_are_dropped():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    assert len(telemetry.receive(position(1100))) == 1
    assert telemetry.receive(position(1100)) == []
    assert telemetry.receive(position(1066)) == []


def test_positions_that_are_no_numbers_are_dropped():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    assert telemetry.receive(position(1100, float("nan"))) == []


def test_a_clock_that_starts_anew_is_a_reboot():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(position(60_000))
    telemetry.receive(position(100))
    assert telemetry.reboots == 1
    assert not telemetry.complete


def test_a_restarted_autopilot_is_told():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(position(60_000))
    assert [event.text for event in telemetry.receive(position(100)) if isinstance(event, StatusText)] == [
        "the autopilot was restarted"
    ]
    assert telemetry.receive(position(133)) == []


def test_positions_without_heartbeats_are_warned_of_once():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(heartbeat())
    heard = [event for moment in range(1100, 9000, 100) for event in telemetry.receive(position(moment))]
    assert [event.text for event in heard if isinstance(event, StatusText)] == [
        "no heartbeat for 4 s: which mode it is in is not known"
    ]


def test_what_a_lost_link_took_of_positions_and_heartbeats_alike_is_no_missing_heartbeat():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(heartbeat())
    assert not any(isinstance(event, StatusText) for event in telemetry.receive(position(40_000)))


def test_without_positions_the_heartbeat_still_tells_the_mode():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(mavlink.MAVLink_attitude_message(5000, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0))
    (state,) = telemetry.receive(heartbeat(custom_mode=4 << 16 | 6 << 24))
    assert isinstance(state, VehicleState)
    assert state.mode is FlightMode.LAND
    assert state.position_age_s == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("roll_deg", "pitch_deg", "yaw_deg", "east", "north"),
    [
        # Nose down and to the right, seen from a vehicle that looks north, east and south-west.
        (0.0, -45.0, 0.0, 0.0, 1.0),
        (45.0, 0.0, 0.0, 1.0, 0.0),
        (0.0, -45.0, 90.0, 1.0, 0.0),
        (45.0, 0.0, 90.0, 0.0, -1.0),
        (0.0, -45.0, 225.0, -math.sqrt(0.5), -math.sqrt(0.5)),
        (45.0, -45.0, 0.0, math.sqrt(2.0), 1.0),
    ],
)
def test_the_tilt_is_told_as_what_it_accelerates(roll_deg, pitch_deg, yaw_deg, east, north):
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    roll, pitch, yaw = map(math.radians, (roll_deg, pitch_deg, yaw_deg))
    telemetry.receive(mavlink.MAVLink_attitude_message(1000, roll, pitch, yaw, 0.0, 0.0, 0.0))
    (state,) = telemetry.receive(position(1200))
    assert isinstance(state, VehicleState)
    assert state.tilt_enu_mps2 == pytest.approx((GRAVITY_MPS2 * east, GRAVITY_MPS2 * north))


@pytest.mark.parametrize("roll", [math.nan, math.radians(85.0), math.radians(180.0)])
def test_what_does_not_carry_the_weight_is_no_tilt(roll):
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(mavlink.MAVLink_attitude_message(1000, roll, 0.0, 0.5, 0.0, 0.0, 0.0))
    (state,) = telemetry.receive(position(1200))
    assert isinstance(state, VehicleState)
    assert state.tilt_enu_mps2 is None


def test_a_failsafe_is_the_heartbeats_status():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(heartbeat(armed=True, status=mavlink.MAV_STATE_CRITICAL))
    (state,) = telemetry.receive(position(1200))
    assert isinstance(state, VehicleState)
    assert state.failsafe
    assert state.armed


def test_repeated_reports_of_a_reached_item_are_told_once():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    reached = mavlink.MAVLink_mission_item_reached_message(3)
    assert telemetry.receive(reached) == [MissionProgress(3, 0)]
    assert telemetry.receive(reached) == []


@pytest.mark.parametrize(
    ("autopilot", "custom_mode", "mode"),
    [
        (Autopilot.PX4, 6 << 16, FlightMode.EXTERNAL),
        (Autopilot.PX4, 3 << 16, FlightMode.PILOT),
        (Autopilot.PX4, 4 << 16 | 2 << 24, FlightMode.TAKEOFF),
        (Autopilot.PX4, 4 << 16 | 3 << 24, FlightMode.HOLD),
        (Autopilot.PX4, 4 << 16 | 4 << 24, FlightMode.MISSION),
        (Autopilot.PX4, 4 << 16 | 5 << 24, FlightMode.RETURN),
        (Autopilot.PX4, 4 << 16 | 6 << 24, FlightMode.LAND),
        (Autopilot.PX4, 99 << 16, FlightMode.OTHER),
        (Autopilot.ARDUPILOT, 0, FlightMode.PILOT),
        (Autopilot.ARDUPILOT, 3, FlightMode.MISSION),
        (Autopilot.ARDUPILOT, 4, FlightMode.EXTERNAL),
        (Autopilot.ARDUPILOT, 5, FlightMode.PILOT),
        (Autopilot.ARDUPILOT, 6, FlightMode.RETURN),
        (Autopilot.ARDUPILOT, 9, FlightMode.LAND),
        (Autopilot.ARDUPILOT, 99, FlightMode.OTHER),
    ],
)
def test_modes_mean_the_same_on_both_autopilots(autopilot, custom_mode, mode):
    assert flight_mode(autopilot, custom_mode)[0] is mode
