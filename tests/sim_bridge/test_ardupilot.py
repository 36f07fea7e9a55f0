"""ArduCopter's ways, as MAVLink bytes show them."""

import math

import pytest

from sim_bridge.dialects import Autopilot
from sim_bridge.simulator import make_autopilot
from sim_bridge.state import GeodeticPoint
from sim_bridge.vehicle.airframes import AirframeKind, airframe
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import (
    NAN,
    POSITION_ONLY,
    POSITION_VELOCITY,
    POSITION_VELOCITY_ACCELERATION,
    VELOCITY_ONLY,
    GroundStation,
    mavlink,
)

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
STABILIZE, AUTO, GUIDED, LOITER, RTL, LAND = 0, 3, 4, 5, 6, 9
ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
ASKED_FOR = (
    (mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 30.0),
    (mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 10.0),
    (mavlink.MAVLINK_MSG_ID_HOME_POSITION, 1.0),
    (mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, 1.0),
    (mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 2.0),
    (mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, 1.0),
)


def fresh(**config) -> GroundStation:
    return GroundStation(make_autopilot(Autopilot.ARDUPILOT, VehicleConfig(GROUND, **config)))


def station(**config) -> GroundStation:
    """A copter that is ready and tells what it is asked for."""
    gs = fresh(ready_after_s=3.0, **config)
    gs.wait(6.0)
    for message_id, rate_hz in ASKED_FOR:
        assert gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz) == ACCEPTED
    gs.wait(2.0)
    return gs


def mode(gs: GroundStation) -> int:
    return gs.last("HEARTBEAT").custom_mode


def set_mode(gs: GroundStation, number: int) -> int:
    return gs.command(mavlink.MAV_CMD_DO_SET_MODE, 1.0, float(number))


def take_off(gs: GroundStation, height_m: float = 20.0, wait_s: float = 25.0) -> None:
    assert set_mode(gs, GUIDED) == ACCEPTED
    assert gs.arm() == ACCEPTED
    assert gs.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height_m) == ACCEPTED
    gs.wait(wait_s)


def test_the_heartbeat_is_a_copters_and_its_mode_a_plain_number():
    gs = station()
    heartbeat = gs.last("HEARTBEAT")
    assert heartbeat.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    assert heartbeat.custom_mode == STABILIZE
    assert set_mode(gs, GUIDED) == ACCEPTED
    gs.wait(1.1)
    assert mode(gs) == GUIDED


def test_only_heartbeats_and_texts_come_until_more_is_asked_for():
    gs = fresh()
    gs.wait(60.0)
    assert {message.get_type() for _, message in gs.heard} <= {"HEARTBEAT", "STATUSTEXT"}
    gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_ATTITUDE, 100_000.0)
    gs.wait(5.0)
    assert 45 <= len(gs.all("ATTITUDE")) <= 55


def test_arming_before_it_is_ready_fails_with_a_text_and_some_forty_seconds_after_boot_it_does_not():
    gs = fresh()
    gs.wait(10.0)
    set_mode(gs, GUIDED)
    assert gs.arm() == mavlink.MAV_RESULT_FAILED
    gs.wait(0.5)
    assert gs.said.strip()
    gs.wait(24.0)
    assert gs.arm() == mavlink.MAV_RESULT_FAILED
    gs.wait(12.0)
    assert gs.arm() == ACCEPTED


def test_guided_accepted_in_the_first_two_seconds_is_silently_undone():
    gs = fresh(ready_after_s=3.0)
    gs.wait(1.0)
    assert set_mode(gs, GUIDED) == ACCEPTED
    gs.wait(4.0)
    assert mode(gs) == STABILIZE
    assert set_mode(gs, GUIDED) == ACCEPTED
    gs.wait(4.0)
    assert mode(gs) == GUIDED


def test_it_disarms_ten_seconds_after_arming_without_a_take_off():
    gs = station()
    set_mode(gs, GUIDED)
    assert gs.arm() == ACCEPTED
    gs.wait(8.5)
    assert gs.armed
    gs.wait(4.0)
    assert not gs.armed


def test_take_off_is_above_home():
    gs = station()
    take_off(gs, 15.0)
    assert gs.last("GLOBAL_POSITION_INT").relative_alt * 1e-3 == pytest.approx(15.0, abs=1.0)
    assert mode(gs) == GUIDED


def test_a_setpoint_during_the_climb_cancels_the_take_off():
    gs = station()
    take_off(gs, 30.0, wait_s=6.0)
    here = gs.position
    assert -here[2] < 20.0
    gs.setpoint(here, mask=POSITION_ONLY)
    gs.wait(20.0)
    assert math.dist(gs.position, here) < 2.0


def test_a_position_target_is_held_for_ever():
    gs = station()
    take_off(gs)
    goal = (20.0, -10.0, -25.0)
    gs.setpoint(goal, mask=POSITION_ONLY)
    gs.wait(60.0)
    assert math.dist(gs.position, goal) < 1.0
    assert mode(gs) == GUIDED


@pytest.mark.parametrize(("parameters", "timeout_s"), [((), 3.0), ((("GUID_TIMEOUT", 7.0),), 7.0)])
def test_a_velocity_target_stops_after_three_seconds_and_it_stays_in_guided(parameters, timeout_s):
    gs = station(parameters=parameters)
    take_off(gs)
    gs.wait(4.0, do=lambda: gs.setpoint(velocity=(5.0, 0.0, 0.0), mask=VELOCITY_ONLY))
    gs.wait(timeout_s - 0.2)
    assert gs.velocity[0] > 3.0
    gs.wait(6.0)
    assert math.hypot(*gs.velocity) < 0.5
    assert mode(gs) == GUIDED


def test_all_three_axes_are_required_and_a_partial_mask_means_stop():
    gs = station()
    take_off(gs)
    gs.wait(4.0, do=lambda: gs.setpoint(velocity=(5.0, 0.0, 0.0), mask=VELOCITY_ONLY))
    without_z = VELOCITY_ONLY | 1 << 5
    gs.wait(8.0, do=lambda: gs.setpoint(velocity=(5.0, 0.0, 0.0), mask=without_z))
    assert math.hypot(*gs.velocity) < 0.5


def test_a_nan_setpoint_ends_the_flight():
    gs = station()
    take_off(gs)
    assert gs.vehicle.body.rotor.height_m > 15.0
    gs.setpoint((NAN, NAN, NAN), mask=POSITION_ONLY)
    gs.forget()
    gs.wait(20.0)
    assert gs.vehicle.body.rotor.height_m == pytest.approx(0.0, abs=0.01)
    # It says nothing any more, and answers nothing.
    assert gs.heard == []
    assert gs.send(mavlink.MAVLink_ping_message(0, 1, 0, 0)) == []


def test_land_and_return_end_on_the_ground_disarmed():
    for number in (LAND, RTL):
        gs = station()
        take_off(gs)
        assert set_mode(gs, number) == ACCEPTED
        gs.wait(1.1)
        assert mode(gs) == number
        gs.wait_for(lambda gs=gs: not gs.armed, within_s=180.0)
        assert gs.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND


def test_its_map_scales_degrees():
    gs = station()
    take_off(gs)
    gs.setpoint((1500.0, 1100.0, -20.0), mask=POSITION_ONLY)
    gs.wait(220.0)
    assert math.dist(gs.position, (1500.0, 1100.0, -20.0)) < 1.0
    origin, here = gs.last("GPS_GLOBAL_ORIGIN"), gs.last("GLOBAL_POSITION_INT")
    # PX4's map of so far away is 1.7 m longer to the north.
    shrink = math.cos(math.radians(0.5e-7 * (here.lat + origin.latitude)))
    north = (here.lat - origin.latitude) * 0.011131884502145034
    east = (here.lon - origin.longitude) * 0.011131884502145034 * shrink
    assert (north, east) == (pytest.approx(gs.position[0], abs=0.3), pytest.approx(gs.position[1], abs=0.3))


def test_parameters_travel_as_their_values():
    gs = station()
    (told,) = gs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"FENCE_ENABLE", -1))
    assert told.param_value in (0.0, 1.0)
    (told,) = gs.send(mavlink.MAVLink_param_set_message(1, 1, b"FENCE_ENABLE", 1.0, mavlink.MAV_PARAM_TYPE_INT8))
    assert told.param_value == 1.0


def circle_error_m(mask: int, drag: float | None = None) -> float:
    """Mean distance from a 5 m circle flown at 1.5 m/s and 20 Hz."""
    gs = station(airframe=airframe(AirframeKind.QUADROTOR, 1200.0, drag))
    take_off(gs)
    start, centre, rate = gs.now_s, gs.position, 0.3

    def at(time_s: float):
        c, s = math.cos(rate * time_s), math.sin(rate * time_s)
        position = (centre[0] + 5.0 * (c - 1.0), centre[1] + 5.0 * s, -20.0)
        return position, (-1.5 * s, 1.5 * c, 0.0), (-0.45 * c, -0.45 * s, 0.0)

    def send() -> None:
        gs.setpoint(*at(gs.now_s - start), mask=mask)

    told = [m for m in gs.wait(42.0, do=send) if m.get_type() == "LOCAL_POSITION_NED"]
    late = [(m.time_boot_ms * 1e-3 - start, (m.x, m.y, m.z)) for m in told if m.time_boot_ms * 1e-3 - start > 15.0]
    return sum(math.dist(place, at(time_s)[0]) for time_s, place in late) / len(late)


def test_velocity_and_acceleration_each_help_to_follow_a_circle():
    # On the real one: 1.72 m, 0.39 m, 0.16 m. With the drag that its simulation has this one lags as far without the
    # acceleration; without it is nearer.
    assert circle_error_m(POSITION_ONLY, drag=1.0) == pytest.approx(1.72, rel=0.15)
    assert circle_error_m(POSITION_VELOCITY, drag=1.0) == pytest.approx(0.39, rel=0.15)
    position = circle_error_m(POSITION_ONLY)
    velocity = circle_error_m(POSITION_VELOCITY)
    acceleration = circle_error_m(POSITION_VELOCITY_ACCELERATION)
    assert 1.2 < position < 1.9
    assert 1.5 * acceleration < velocity < 0.4
    assert acceleration < 0.16


@pytest.mark.parametrize(("system", "expected"), [(255, RTL), (245, GUIDED)])
def test_the_ground_station_failsafe_watches_system_255(system, expected):
    gs = station(parameters=(("FS_GCS_ENABLE", 1),))
    take_off(gs)
    watched = GroundStation(gs.vehicle, system=system)
    heartbeat = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)

    def beat() -> None:
        watched.now_s = gs.now_s
        watched.send(heartbeat)

    gs.wait(10.0, each_s=1.0, do=beat)
    assert mode(gs) == GUIDED
    gs.wait(8.0)
    assert mode(gs) == expected


def test_an_unknown_command_is_unsupported_and_an_unknown_parameter_gets_no_reply():
    gs = station()
    assert gs.command(31999) == mavlink.MAV_RESULT_UNSUPPORTED
    assert gs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"NO_SUCH", -1)) == []


def test_home_is_not_the_origin():
    gs = station()
    home, origin = gs.last("HOME_POSITION"), gs.last("GPS_GLOBAL_ORIGIN")
    assert 1.0 <= abs(home.altitude - origin.altitude) * 1e-3 <= 2.0


def test_home_is_set_here_where_no_place_is_given():
    gs = station()
    assert gs.command(mavlink.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, 47.0, 8.5, 500.0) == ACCEPTED
    assert gs.command(mavlink.MAV_CMD_DO_SET_HOME) == ACCEPTED
    gs.wait(1.1)
    assert gs.last("HOME_POSITION").latitude == pytest.approx(GROUND.latitude_deg * 1e7, abs=200)
