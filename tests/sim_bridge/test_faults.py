"""Faults on demand, each driven through raw bytes in virtual time, on both personalities."""

import math

import pytest

from sim_bridge.channel import HELD_BACK_S, Channel, Quality
from sim_bridge.dialects import Autopilot
from sim_bridge.faults import (
    ArmingRefused,
    BadLine,
    BatteryDrop,
    EstimatorJump,
    GpsGlitch,
    GpsLoss,
    HeartbeatFrozen,
    LinkCut,
    MotorDerating,
    PilotSwitch,
    Reboot,
    SecondStation,
    WindChange,
)
from sim_bridge.state import FlightMode
from tests.sim_bridge.ground_station import mavlink
from tests.sim_bridge.line_client import GROUND, HEIGHT_M, Client

both = pytest.mark.parametrize("autopilot", Autopilot, ids=lambda one: one.name.lower())


@both
def test_on_a_line_that_loses_doubles_delays_and_reorders_a_take_off_and_a_hold_still_succeed(autopilot):
    fault = BadLine(begin_s=0.0, loss=0.2, duplication=0.1, reordering=0.1, delay_s=0.2, jitter_s=0.1)
    client = Client(autopilot, [fault])
    client.fly()
    client.wait(10.0)
    assert client.mode is FlightMode.EXTERNAL
    stamps = [message.time_boot_ms for message in client.all("LOCAL_POSITION_NED")]
    assert stamps != sorted(stamps)


@both
def test_a_bad_line_is_good_again_when_its_time_is_over(autopilot):
    client = Client(autopilot, [BadLine(begin_s=2.0, duration_s=4.0, loss=1.0)])
    client.wait(10.0)
    beats = [at for at, message in client.heard if message.get_type() == "HEARTBEAT"]
    assert not [at for at in beats if 2.0 < at < 6.0]
    assert len([at for at in beats if at > 6.0]) >= 4


@both
def test_a_cut_link_is_a_lost_stream_and_the_vehicle_acts_by_its_own_rule(autopilot):
    client = Client(
        autopilot,
        [LinkCut(begin_s=60.0, duration_s=20.0)],
        [("COM_OBL_RC_ACT", 5)] if autopilot is Autopilot.PX4 else [],
    )
    client.fly()
    client.wait(62.5 - client.now_s)
    place = client.vehicle.body.rotor.position_ned_m
    client.wait(17.0)
    assert not [at for at, _ in client.heard if 60.1 < at < 80.0]
    assert math.dist(client.vehicle.body.rotor.position_ned_m, place) < 2.0
    client.wait(3.0)
    # Both fly on by themselves once setpoints come again.
    assert client.mode is FlightMode.EXTERNAL


@both
def test_a_reboot_in_the_air_starts_the_clock_anew_and_the_vehicle_lands_by_itself(autopilot):
    client = Client(autopilot, [Reboot(begin_s=60.0, outage_s=0.5)])
    client.fly()
    client.wait(59.0 - client.now_s)
    before_ms = client.all("LOCAL_POSITION_NED")[-1].time_boot_ms
    height_m = client.height_m
    client.wait(5.0)
    assert client.height_m < height_m - 0.5
    if autopilot is Autopilot.ARDUPILOT:
        # A vehicle that was restarted tells nothing again until it is asked.
        client.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 1e5)
    assert client.all("LOCAL_POSITION_NED")[-1].time_boot_ms < before_ms
    assert client.mode is FlightMode.LAND
    client.wait_for(lambda: not client.vehicle.body.armed, 80.0)
    assert client.height_m == pytest.approx(0.0, abs=0.01)


@both
def test_a_reboot_puts_the_origin_where_the_vehicle_is(autopilot):
    client = Client(autopilot, [Reboot(begin_s=70.0, outage_s=0.5)])
    client.fly()
    client.hold_ned_m = (80.0, 0.0, client.hold_ned_m[2])
    client.wait(69.5 - client.now_s)
    before, home = client.vehicle.body.geodetic(), client.vehicle.body.geodetic(client.vehicle.body.home_ned_m)
    client.hold_ned_m = None
    client.wait(2.0)
    command = mavlink.MAV_CMD_REQUEST_MESSAGE
    assert client.command(command, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN) == mavlink.MAV_RESULT_ACCEPTED
    origin = client.all("GPS_GLOBAL_ORIGIN")[-1]
    assert origin.latitude * 1e-7 == pytest.approx(before.latitude_deg, abs=2e-5)
    assert origin.altitude * 1e-3 == pytest.approx(before.altitude_amsl_m, abs=3.0)
    body = client.vehicle.body
    assert body.geodetic().latitude_deg == pytest.approx(before.latitude_deg, abs=2e-5)
    assert body.geodetic(body.home_ned_m).latitude_deg == pytest.approx(home.latitude_deg, abs=1e-6)
    assert body.rotor.height_m < HEIGHT_M
    client.wait(60.0)
    assert body.rotor.height_m == pytest.approx(0.0, abs=0.01)
    assert body.geodetic().altitude_amsl_m == pytest.approx(GROUND.altitude_amsl_m, abs=1.0)


@both
def test_a_reboot_without_recovery_falls(autopilot):
    client = Client(autopilot, [Reboot(begin_s=60.0, recovers_in_air=False)])
    client.fly()
    client.wait(64.0 - client.now_s)
    assert client.height_m == pytest.approx(0.0, abs=0.01)
    assert not client.vehicle.body.armed


@both
def test_without_gps_the_vehicle_comes_down_where_it_is(autopilot):
    client = Client(autopilot, [GpsLoss(begin_s=60.0)])
    client.fly()
    client.wait(75.0 - client.now_s)
    assert (
        client.mode is FlightMode.LAND
        if autopilot is Autopilot.ARDUPILOT
        else client.mode in (FlightMode.PILOT, FlightMode.LAND)
    )
    assert client.status == mavlink.MAV_STATE_CRITICAL
    health = client.all("SYS_STATUS")[-1].onboard_control_sensors_health
    assert not health & mavlink.MAV_SYS_STATUS_SENSOR_GPS
    client.wait_for(lambda: not client.vehicle.body.armed, 90.0)


@both
def test_a_short_gps_loss_is_bridged_by_dead_reckoning(autopilot):
    client = Client(autopilot, [GpsLoss(begin_s=60.0, duration_s=2.0)])
    client.fly()
    client.wait(70.0 - client.now_s)
    assert client.mode is FlightMode.EXTERNAL


@both
def test_a_gps_glitch_drags_the_vehicle_away_while_it_believes_to_stand(autopilot):
    client = Client(autopilot, [GpsGlitch(begin_s=60.0, duration_s=30.0, offset_ned_m=(8.0, 0.0, 0.0))], wander_m=0.0)
    client.fly()
    client.wait(59.0 - client.now_s)
    true_north = client.vehicle.body.rotor.position_ned_m[0]
    client.wait(25.0)
    assert client.vehicle.body.rotor.position_ned_m[0] - true_north == pytest.approx(-8.0, abs=1.0)
    assert client.all("LOCAL_POSITION_NED")[-1].x == pytest.approx(0.0, abs=0.5)
    client.wait(25.0)
    assert client.vehicle.body.rotor.position_ned_m[0] == pytest.approx(true_north, abs=0.5)


@both
def test_an_estimator_jump_is_seen_at_once_and_stays(autopilot):
    client = Client(autopilot, [EstimatorJump(begin_s=60.0, offset_ned_m=(0.0, 5.0, -2.0))], wander_m=0.0)
    client.fly()
    client.wait(60.0 - client.now_s)
    before = client.all("LOCAL_POSITION_NED")[-1]
    client.wait(0.3)
    after = client.all("LOCAL_POSITION_NED")[-1]
    assert (after.y - before.y, after.z - before.z) == pytest.approx((5.0, -2.0), abs=0.4)
    client.wait(20.0)
    assert client.all("LOCAL_POSITION_NED")[-1].y == pytest.approx(0.0, abs=0.5)


@both
def test_wind_and_gusts_push_but_do_not_carry_away(autopilot):
    client = Client(autopilot, [WindChange(begin_s=60.0, mean_ned_mps=(8.0, 0.0, 0.0), gust_mps=3.0)], wander_m=0.0)
    client.fly()
    client.wait(60.0 - client.now_s)
    farthest = 0.0
    for _ in range(200):
        client.wait(0.1)
        farthest = max(farthest, math.hypot(*client.vehicle.body.rotor.velocity_ned_mps[:2]))
    assert farthest > 0.05
    assert client.vehicle.body.distance_home_m() < 1.0


@pytest.mark.parametrize(
    ("autopilot", "parameters", "mode"),
    [
        (Autopilot.PX4, [("COM_LOW_BAT_ACT", 0)], FlightMode.EXTERNAL),
        (Autopilot.PX4, [("COM_LOW_BAT_ACT", 2)], FlightMode.LAND),
        (Autopilot.PX4, [("COM_LOW_BAT_ACT", 3)], FlightMode.RETURN),
        (Autopilot.ARDUPILOT, [("BATT_LOW_MAH", 500), ("BATT_FS_LOW_ACT", 0)], FlightMode.EXTERNAL),
        (Autopilot.ARDUPILOT, [("BATT_LOW_MAH", 500), ("BATT_FS_LOW_ACT", 2)], FlightMode.RETURN),
        (Autopilot.ARDUPILOT, [("BATT_LOW_MAH", 500), ("BATT_FS_LOW_ACT", 1)], FlightMode.LAND),
    ],
)
def test_a_critical_battery_does_what_the_parameters_say(autopilot, parameters, mode):
    client = Client(autopilot, [BatteryDrop(begin_s=60.0, charge=0.065)], parameters)
    client.fly()
    client.wait(69.0 - client.now_s)
    assert "attery" in client.said
    assert client.mode is mode
    assert client.all("SYS_STATUS")[-1].battery_remaining in (5, 6)


def test_before_a_battery_failsafe_acts_px4_holds_so_that_a_pilot_can_take_over():
    client = Client(Autopilot.PX4, [BatteryDrop(begin_s=60.0, charge=0.065)], [("COM_LOW_BAT_ACT", 2)])
    client.fly()
    client.wait(63.0 - client.now_s)
    assert client.mode is FlightMode.HOLD
    assert "entering Hold for 5 seconds" in client.said


@both
def test_weak_motors_cannot_climb(autopilot):
    client = Client(autopilot, [MotorDerating(begin_s=60.0, duration_s=2.5, thrust=0.4)])
    client.fly()
    client.wait(60.0 - client.now_s)
    height_m = client.height_m
    client.wait(3.0)
    assert 0.5 < client.height_m < height_m - 3.0
    client.wait(25.0)
    assert client.height_m == pytest.approx(height_m, abs=1.0)


@both
@pytest.mark.parametrize("mode", [FlightMode.PILOT, FlightMode.RETURN])
def test_a_pilots_switch_takes_over_and_setpoints_do_not_bring_it_back(autopilot, mode):
    client = Client(autopilot, [PilotSwitch(begin_s=60.0, mode=mode)])
    client.fly()
    client.wait(68.0 - client.now_s)
    assert client.mode is mode
    if mode is FlightMode.PILOT:
        # Centred sticks hold.
        assert client.height_m == pytest.approx(HEIGHT_M, abs=2.0)


@both
def test_a_second_station_is_answered_on_the_same_line_but_to_its_own_address(autopilot):
    client = Client(autopilot, [SecondStation(begin_s=5.0, duration_s=20.0)])
    client.wait(30.0)
    foreign = [m for m in client.all("MISSION_COUNT") + client.all("COMMAND_ACK") if m.target_system == 255]
    assert 15 <= len(foreign) <= 25


@both
def test_a_second_station_that_uploads_keeps_ours_out_for_some_seconds(autopilot):
    client = Client(autopilot, [SecondStation(begin_s=5.0, duration_s=10.0, uploads=True)])
    client.wait(6.0)
    client.send(mavlink.MAVLink_mission_count_message(1, 1, 2))
    client.wait(0.5)
    # PX4 answers its partner alone.
    refusals = [] if autopilot is Autopilot.PX4 else [mavlink.MAV_MISSION_DENIED]
    assert [ack.type for ack in client.all("MISSION_ACK") if ack.target_system == 245] == refusals
    assert not [asked for asked in client.all("MISSION_REQUEST") if asked.target_system == 245]
    client.wait(10.0)
    since_s = client.now_s
    client.send(mavlink.MAVLink_mission_count_message(1, 1, 2))
    client.wait(0.2)
    assert [asked for asked in client.all("MISSION_REQUEST", since_s) if asked.target_system == 245]


@both
def test_arming_is_refused_with_the_reason_until_the_fault_is_over(autopilot):
    client = Client(autopilot, [ArmingRefused(begin_s=0.0, duration_s=10.0, reason="Compass not healthy")])
    client.wait(5.0)
    assert client.arm() != mavlink.MAV_RESULT_ACCEPTED
    assert "Compass not healthy" in client.said
    client.wait(6.0)
    assert client.arm() == mavlink.MAV_RESULT_ACCEPTED


@both
def test_a_frozen_heartbeat_stops_while_telemetry_goes_on(autopilot):
    client = Client(autopilot, [HeartbeatFrozen(begin_s=60.0, duration_s=10.0)])
    client.fly()
    client.wait(69.5 - client.now_s)
    assert not client.all("HEARTBEAT", 60.5)
    assert len(client.all("LOCAL_POSITION_NED", 60.5)) > 50
    client.wait(3.0)
    assert client.all("HEARTBEAT", 70.0)


def test_a_fault_of_another_vehicle_changes_nothing():
    client = Client(Autopilot.PX4, [LinkCut(begin_s=0.0, system=2)])
    client.wait(3.0)
    assert len(client.all("HEARTBEAT")) >= 3


def test_the_same_seed_flies_the_same_flight():
    def flown() -> tuple[float, ...]:
        client = Client(Autopilot.PX4, [WindChange(begin_s=10.0, gust_mps=3.0), BadLine(begin_s=0.0, loss=0.3)], seed=5)
        client.fly()
        client.wait(5.0)
        return (*client.vehicle.body.rotor.position_ned_m, len(client.heard))

    assert flown() == flown()


def test_what_is_held_back_is_overtaken():
    channel = Channel(Quality(reordering=0.5), seed=1)
    for number in range(100):
        channel.put(bytes([number]), 0.01 * number)
    came = [data[0] for data in channel.arrived(1.0 + HELD_BACK_S)]
    assert sorted(came) == list(range(100))
    assert came != sorted(came)
