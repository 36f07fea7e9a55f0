"""Where a return goes on both personalities: home, or a rally point that is nearer."""

import math

import pytest

from tests.sim_bridge import test_ardupilot as copter
from tests.sim_bridge import test_px4_plans as px4
from tests.sim_bridge.ground_station import OFFBOARD, POSITION_ONLY, RETURN, GroundStation, mavlink

RALLIES = mavlink.MAV_MISSION_TYPE_RALLY
ABOVE_HOME = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
AWAY = (80.0, 0.0, -15.0)


def rally(*places) -> list:
    """Points in metres from where the vehicle stands: north, east, height."""
    command = mavlink.MAV_CMD_NAV_RALLY_POINT
    return [
        px4.item(seq, command, north, east, height, (0.0,) * 4, RALLIES, ABOVE_HOME)
        for seq, (north, east, height) in enumerate(places)
    ]


def landed(gs: GroundStation) -> tuple[float, float]:
    """Where it has come to stand, north and east of where it stood."""
    gs.wait_for(lambda: not gs.armed, within_s=240.0)
    home = gs.last("HOME_POSITION")
    return gs.position[0] - home.x, gs.position[1] - home.y


def px4_returns(points, away=AWAY, parameters=()) -> GroundStation:
    gs = px4.station(parameters=parameters)
    assert px4.upload(gs, points, RALLIES) == mavlink.MAV_MISSION_ACCEPTED
    gs.take_off(15.0)
    gs.wait(1.0, do=lambda: gs.setpoint(away, mask=POSITION_ONLY))
    gs.px4_mode(OFFBOARD)
    gs.wait(30.0, do=lambda: gs.setpoint(away, mask=POSITION_ONLY))
    assert gs.px4_mode(RETURN) == mavlink.MAV_RESULT_ACCEPTED
    return gs


def copter_returns(points, away=AWAY, parameters=()) -> GroundStation:
    gs = copter.station(parameters=parameters)
    replies = gs.send(mavlink.MAVLink_mission_count_message(1, 1, len(points), RALLIES))
    while replies[0].get_type() != "MISSION_ACK":
        replies = gs.send(points[replies[0].seq])
    assert replies[0].type == mavlink.MAV_MISSION_ACCEPTED
    copter.take_off(gs, 15.0)
    gs.setpoint(away, mask=POSITION_ONLY)
    gs.wait(40.0)
    assert copter.set_mode(gs, copter.RTL) == copter.ACCEPTED
    return gs


both = pytest.mark.parametrize("returns", [px4_returns, copter_returns], ids=["px4", "ardupilot"])


@both
@pytest.mark.parametrize(
    ("points", "where"),
    [
        ([(100.0, 0.0, 20.0)], (100.0, 0.0)),
        ([(150.0, 0.0, 20.0), (60.0, 30.0, 20.0)], (60.0, 30.0)),
        ([(200.0, 0.0, 20.0)], (0.0, 0.0)),
    ],
    ids=["nearer than home", "the nearest of two", "farther than home"],
)
def test_a_return_goes_to_the_nearest_of_home_and_the_rally_points(returns, points, where):
    assert math.dist(landed(returns(rally(*points))), where) < 2.0


def test_px4_does_not_count_a_rally_point_beside_home():
    assert math.hypot(*landed(px4_returns(rally((9.0, 0.0, 20.0))))) < 2.0


@both
def test_the_height_of_a_return_counts_from_the_rally_point(returns):
    gs = returns(rally((100.0, 0.0, 40.0)))
    highest = [0.0]
    gs.wait_for(lambda: highest.append(-gs.position[2]) or not gs.armed, within_s=240.0)
    # PX4: 20 m above it, twice NAV_ACC_RAD, or RTL_RETURN_ALT; Copter: its height, as RTL_ALT is less.
    assert max(highest) == pytest.approx(100.0 if returns is px4_returns else 40.0, abs=2.5)


@pytest.mark.parametrize(
    ("parameters", "where"),
    [((("RALLY_LIMIT_KM", 0.01),), (0.0, 0.0)), ((("RALLY_INCL_HOME", 0),), (200.0, 0.0))],
    ids=["beyond the limit", "home does not count"],
)
def test_copters_parameters_say_which_rally_points_count(parameters, where):
    point = (100.0, 0.0, 20.0) if where == (0.0, 0.0) else (200.0, 0.0, 20.0)
    assert math.dist(landed(copter_returns(rally(point), parameters=parameters)), where) < 2.0
