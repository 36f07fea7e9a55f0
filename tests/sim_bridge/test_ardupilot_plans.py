"""ArduCopter's plans: how it asks for items, what it takes and keeps of them, and that it flies them."""

import pytest

from tests.sim_bridge.ground_station import NAN, GroundStation, mavlink
from tests.sim_bridge.test_ardupilot import ACCEPTED, AUTO, GROUND, mode, set_mode, station, take_off

MISSIONS = mavlink.MAV_MISSION_TYPE_MISSION


def item(seq, latitude_e7=473_977_000, longitude_e7=85_456_000, height_m=20.0, command=mavlink.MAV_CMD_NAV_WAYPOINT,
         frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, params=(0.0, 0.0, 0.0, 0.0), kind=MISSIONS):  # fmt: skip
    return mavlink.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, 0, 1, *params, latitude_e7, longitude_e7, height_m, kind
    )


def upload(gs: GroundStation, items, kind=MISSIONS) -> int:
    replies = gs.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
    while True:
        # Copter asks from its main loop, not always in the same breath.
        for _ in range(100):
            asked = [r for r in replies if r.get_type() in ("MISSION_REQUEST", "MISSION_ACK", "MISSION_REQUEST_INT")]
            if asked:
                break
            replies = gs.wait(0.02)
        if asked[0].get_type() == "MISSION_ACK":
            return asked[0].type
        assert asked[0].get_type() == "MISSION_REQUEST"
        replies = gs.send(items[asked[0].seq])


def test_items_are_asked_for_only_with_mission_request():
    assert upload(station(), [item(seq) for seq in range(5)]) == mavlink.MAV_MISSION_ACCEPTED


def test_a_lost_item_is_asked_for_every_second_for_eight_seconds_then_the_upload_is_cancelled():
    gs = station()
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 3, MISSIONS))
    gs.wait(0.2)
    gs.forget()
    start_s = gs.now_s
    gs.wait(12.0)
    asked = gs.times("MISSION_REQUEST")
    assert 7 <= len(asked) <= 9
    assert asked[2] - asked[1] == pytest.approx(1.0, abs=0.1)
    (ack,) = gs.all("MISSION_ACK")
    assert ack.type == mavlink.MAV_MISSION_OPERATION_CANCELLED
    assert gs.times("MISSION_ACK")[0] - start_s == pytest.approx(8.0, abs=1.1)


def test_more_than_650_items_have_no_space():
    gs = station()
    ack, _ = gs.send(mavlink.MAVLink_mission_count_message(1, 1, 651, MISSIONS))
    assert ack.type == mavlink.MAV_MISSION_NO_SPACE
    assert "Only 650 items are supported" in gs.said
    assert upload(gs, [item(seq) for seq in range(650)]) == mavlink.MAV_MISSION_ACCEPTED


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        (item(1, height_m=NAN), mavlink.MAV_MISSION_INVALID_PARAM7),
        (item(1, latitude_e7=950_000_000), mavlink.MAV_MISSION_INVALID_PARAM5_X),
    ],
    ids=["NaN altitude", "latitude 95"],
)
def test_nonsense_is_refused_by_parameter(bad, result):
    assert upload(station(), [item(0), bad]) == result


def test_items_come_back_in_frame_3_and_item_0_is_home():
    gs = station()
    upload(gs, [item(0, height_m=99.0), item(1, latitude_e7=473_980_000)])
    (count,) = gs.send(mavlink.MAVLink_mission_request_list_message(1, 1, MISSIONS))
    assert count.count == 2
    back = [gs.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, MISSIONS))[0] for seq in range(2)]
    assert back[1].frame == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    assert back[1].x == pytest.approx(473_980_000, abs=2)
    home = gs.last("HOME_POSITION")
    assert back[0].x == pytest.approx(home.latitude, abs=20)
    assert back[0].z != pytest.approx(99.0)


def test_a_second_ground_station_that_uploads_meanwhile_is_denied():
    gs = station()
    other = GroundStation(gs.vehicle, system=255)
    other.now_s = gs.now_s
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 3, MISSIONS))
    (ack,) = other.send(mavlink.MAVLink_mission_count_message(1, 1, 2, MISSIONS))
    assert ack.type == mavlink.MAV_MISSION_DENIED


def test_auto_flies_the_mission():
    gs = station()
    north = [473_977_000 + round(metres / 111_195.0 * 1e7) for metres in (0.0, 30.0, 60.0)]
    takeoff = item(1, 0, 0, 15.0, command=mavlink.MAV_CMD_NAV_TAKEOFF)
    items = [item(0), takeoff, item(2, north[1], height_m=15.0), item(3, north[2], height_m=15.0)]
    assert upload(gs, items) == mavlink.MAV_MISSION_ACCEPTED
    take_off(gs, 15.0)
    assert set_mode(gs, AUTO) == ACCEPTED
    gs.wait(60.0)
    assert mode(gs) == AUTO
    home = gs.last("HOME_POSITION")
    assert gs.position[0] - home.x == pytest.approx(60.0, abs=2.5)
    assert [m.seq for m in gs.all("MISSION_ITEM_REACHED")][-1] == 3


@pytest.mark.parametrize(
    ("place", "result"),
    [
        ((300.0, 8.5, 488.0), mavlink.MAV_RESULT_FAILED),
        ((47.4, -181.0, 488.0), mavlink.MAV_RESULT_FAILED),
        ((3.4e38, 3.4e38, 488.0), mavlink.MAV_RESULT_FAILED),
        ((47.4, 8.5, NAN), mavlink.MAV_RESULT_DENIED),
        ((47.4, 8.5, 3.4e38), mavlink.MAV_RESULT_DENIED),
        ((47.4, 8.5, 60_000.0), mavlink.MAV_RESULT_FAILED),
        ((47.4, 8.5, 500.0), ACCEPTED),
    ],
)
def test_home_is_set_where_the_map_of_the_earth_allows_it(place, result):
    gs = station()
    upload(gs, [item(0), item(1)])
    assert gs.command(mavlink.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, *place) == result
    gs.send(mavlink.MAVLink_mission_request_list_message(1, 1, MISSIONS))
    (home,) = gs.send(mavlink.MAVLink_mission_request_int_message(1, 1, 0, MISSIONS))
    latitude, _, amsl_m = place if result == ACCEPTED else (GROUND.latitude_deg, 0.0, GROUND.altitude_amsl_m)
    assert home.x == pytest.approx(latitude * 1e7, abs=200)
    assert home.z == pytest.approx(amsl_m, abs=2.0)
