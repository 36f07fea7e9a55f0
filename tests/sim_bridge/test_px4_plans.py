"""How PX4 takes, gives back and flies missions, fences and rally points: nearly anything is accepted."""

import math

import pytest

from sim_bridge.px4.vehicle import Px4
from sim_bridge.state import GeodeticPoint
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import HOLD, MISSION, NAN, OFFBOARD, VELOCITY_ONLY, GroundStation, mavlink

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
MISSIONS, FENCES, RALLIES = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)
WAYPOINT = mavlink.MAV_CMD_NAV_WAYPOINT
RELATIVE, ABSOLUTE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, mavlink.MAV_FRAME_GLOBAL_INT
METRE_DEG = 1.0 / 111_195.0


def station(**config) -> GroundStation:
    gs = GroundStation(Px4(VehicleConfig(GROUND, ready_after_s=1.0, **config)))
    gs.wait(4.0)
    return gs


def place_e7(north_m: float, east_m: float) -> tuple[int, int]:
    """Metres from where the vehicle stands as 1e-7 degrees."""
    latitude = GROUND.latitude_deg + north_m * METRE_DEG
    longitude = GROUND.longitude_deg + east_m * METRE_DEG / math.cos(math.radians(GROUND.latitude_deg))
    return round(latitude * 1e7), round(longitude * 1e7)


def item(seq, command=WAYPOINT, north_m=0.0, east_m=0.0, height_m=20.0, params=(0.0, 0.0, 0.0, NAN), kind=MISSIONS,
         frame=RELATIVE):  # fmt: skip
    return mavlink.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, 0, 1, *params, *place_e7(north_m, east_m), height_m, kind
    )


def upload(gs: GroundStation, items, kind=MISSIONS) -> int:
    """Upload as a client does; the result of the acknowledgement."""
    (reply,) = gs.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
    while reply.get_type() != "MISSION_ACK":
        assert reply.mission_type == kind
        (reply,) = (said for said in gs.send(items[reply.seq]) if said.get_type() != "STATUSTEXT")
    assert reply.mission_type == kind
    return reply.type


def download(gs: GroundStation, kind=MISSIONS) -> list:
    """Read back as a client does."""
    (count,) = gs.send(mavlink.MAVLink_mission_request_list_message(1, 1, kind))
    items = []
    for seq in range(count.count):
        items += gs.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind))
    gs.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_ACCEPTED, kind))
    return items


def circle_fence(radius_m: float, north_m: float = 0.0) -> list:
    inclusion = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION
    return [item(0, inclusion, north_m=north_m, height_m=0.0, params=(radius_m, 0.0, 0.0, 0.0), kind=FENCES)]


def polygon_fence(corners, command=mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION) -> list:
    params = (float(len(corners)), 0.0, 0.0, 0.0)
    return [
        item(seq, command, north_m=north, east_m=east, height_m=0.0, params=params, kind=FENCES)
        for seq, (north, east) in enumerate(corners)
    ]


def test_the_first_item_is_asked_for_with_mission_request_and_later_ones_with_request_int():
    gs = station()
    (first,) = gs.send(mavlink.MAVLink_mission_count_message(1, 1, 3, MISSIONS))
    assert (first.get_type(), first.seq) == ("MISSION_REQUEST", 0)
    assert (first.target_system, first.target_component) == (245, 190)
    (second,) = gs.send(item(0))
    assert (second.get_type(), second.seq) == ("MISSION_REQUEST_INT", 1)
    (third,) = gs.send(item(1))
    assert (third.get_type(), third.seq) == ("MISSION_REQUEST_INT", 2)
    (ack,) = gs.send(item(2))
    assert (ack.get_type(), ack.type) == ("MISSION_ACK", mavlink.MAV_MISSION_ACCEPTED)


def test_a_lost_item_is_asked_for_every_quarter_second_for_five_seconds_then_a_text_and_no_ack():
    gs = station()
    assert upload(gs, [item(0, north_m=50.0)]) == mavlink.MAV_MISSION_ACCEPTED
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 2, MISSIONS))
    gs.forget()
    gs.wait(8.0)
    asked = sorted(gs.times("MISSION_REQUEST") + gs.times("MISSION_REQUEST_INT"))
    assert 17 <= len(asked) <= 20
    assert asked[1] - asked[0] == pytest.approx(0.26, abs=0.021)
    assert "Operation timeout" in gs.said
    assert gs.all("MISSION_ACK") == []
    # The old mission stays.
    assert [stored.x for stored in download(gs)] == [place_e7(50.0, 0.0)[0]]


def test_a_lost_item_that_comes_after_all_goes_on_with_the_upload():
    gs = station()
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 2, MISSIONS))
    gs.wait(1.0)
    gs.send(item(0))
    gs.wait(3.0)
    (ack,) = gs.send(item(1))
    assert ack.type == mavlink.MAV_MISSION_ACCEPTED


def test_a_client_that_refuses_mission_request_as_mavsdk_does_is_asked_the_other_way_at_once():
    gs = station()
    (first,) = gs.send(mavlink.MAVLink_mission_count_message(1, 1, 1, MISSIONS))
    assert first.get_type() == "MISSION_REQUEST"
    (again,) = gs.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_UNSUPPORTED, MISSIONS))
    assert (again.get_type(), again.seq) == ("MISSION_REQUEST_INT", 0)
    (ack,) = gs.send(item(0))
    assert ack.type == mavlink.MAV_MISSION_ACCEPTED


def test_a_client_can_cancel_its_upload():
    gs = station()
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 2, MISSIONS))
    gs.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED, MISSIONS))
    gs.forget()
    gs.wait(6.0)
    assert not [kind for kind in ("MISSION_REQUEST", "MISSION_REQUEST_INT", "STATUSTEXT") if gs.all(kind)]


@pytest.mark.parametrize(
    "nonsense",
    [
        item(0, north_m=50_000.0),
        item(0, height_m=NAN),
        item(0, height_m=-30.0),
        mavlink.MAVLink_mission_item_int_message(
            1, 1, 0, RELATIVE, WAYPOINT, 0, 1, 0, 0, 0, NAN, 950_000_000, 85_000_000, 20.0, MISSIONS
        ),
    ],
    ids=["50 km away", "NaN altitude", "negative altitude", "latitude 95"],
)
def test_accepted_is_no_sanity_check(nonsense):
    assert upload(station(), [nonsense]) == mavlink.MAV_MISSION_ACCEPTED


@pytest.mark.parametrize(("count", "result"), [(math.inf, 1), (3e38, 1), (NAN, 1), (65538.0, 1), (2.6, 0)])
def test_the_number_of_corners_is_what_fits_its_field(count, result):
    vertex = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    corners = [(-50, -50), (-50, 50), (50, 0)]
    fence = [
        item(seq, vertex, north, east, params=(count, 0.0, 0.0, 0.0), kind=FENCES)
        for seq, (north, east) in enumerate(corners)
    ]
    gs = station()
    assert upload(gs, fence, FENCES) == result
    gs.wait(1.0)
    assert "invalid" not in gs.said.lower()


def test_a_polygon_that_lacks_corners_holds_nothing():
    gs = station()
    fence = polygon_fence([(-50, -50), (-50, 50), (50, 50), (50, -50)])[:3]
    assert upload(gs, fence, FENCES) == mavlink.MAV_MISSION_ACCEPTED
    gs.wait(1.0)
    assert "doesn't contain Home" in gs.said


@pytest.mark.parametrize(
    ("radius_m", "holds"), [(math.inf, True), (3e38, True), (-30.0, True), (NAN, False), (0.0, False)]
)
def test_a_circle_may_have_any_radius(radius_m, holds):
    gs = station()
    assert upload(gs, circle_fence(radius_m), FENCES) == mavlink.MAV_MISSION_ACCEPTED
    gs.wait(1.0)
    assert ("doesn't contain Home" in gs.said) is not holds


@pytest.mark.parametrize("index", [1e6, 3e38, math.inf, NAN, -5.0, 65535.0, 2.0])
def test_a_jump_to_an_item_that_is_not_there_ends_the_mission(index):
    jump = mavlink.MAVLink_mission_item_int_message(
        1, 1, 1, mavlink.MAV_FRAME_MISSION, mavlink.MAV_CMD_DO_JUMP, 0, 1, index, 5, 0, 0, 0, 0, 0, MISSIONS
    )
    gs = station()
    flying_mission(gs, [item(0), jump])
    gs.wait(10.0)
    assert gs.armed
    assert math.hypot(*gs.velocity) < 0.5


def test_what_was_uploaded_is_read_back():
    gs = station()
    sent = [item(0, mavlink.MAV_CMD_NAV_TAKEOFF), item(1, north_m=30.0, east_m=-20.0), item(2, height_m=55.5)]
    upload(gs, sent)
    fence = polygon_fence([(-50, -50), (-50, 50), (50, 50), (50, -50)])
    upload(gs, fence, FENCES)
    frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    rally = [item(0, mavlink.MAV_CMD_NAV_RALLY_POINT, north_m=10.0, kind=RALLIES, frame=frame)]
    upload(gs, rally, RALLIES)
    for kind, expected in ((MISSIONS, sent), (FENCES, fence), (RALLIES, rally)):
        for got, put in zip(download(gs, kind), expected, strict=True):
            assert (got.seq, got.command, got.x, got.y) == (put.seq, put.command, put.x, put.y)
            if kind != FENCES:
                assert got.z == pytest.approx(put.z, abs=1e-3)


def test_a_plan_is_cleared():
    gs = station()
    upload(gs, [item(0)])
    (ack,) = gs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, MISSIONS))
    assert ack.type == mavlink.MAV_MISSION_ACCEPTED
    assert download(gs) == []


def flying_mission(gs: GroundStation, items) -> None:
    upload(gs, items)
    gs.take_off()
    assert gs.px4_mode(MISSION) == ACCEPTED
    gs.wait(1.1)
    assert gs.custom_mode == MISSION


def test_a_mission_is_flown_item_after_item_and_reached_is_repeated_each_second():
    gs = station(parameters=(("NAV_ACC_RAD", 2.0),))
    corners = [(40.0, 0.0), (40.0, 40.0), (0.0, 0.0)]
    items = [item(seq, north_m=north, east_m=east) for seq, (north, east) in enumerate(corners)]
    flying_mission(gs, items)
    nearest = [math.inf] * len(corners)
    home = gs.last("HOME_POSITION")

    def watch() -> None:
        north, east, _ = gs.position
        for index, (to_north, to_east) in enumerate(corners):
            nearest[index] = min(nearest[index], math.hypot(north - home.x - to_north, east - home.y - to_east))

    gs.wait(90.0, each_s=0.1, do=watch)
    assert max(nearest) < 2.5
    reached = [message.seq for message in gs.all("MISSION_ITEM_REACHED")]
    assert list(dict.fromkeys(reached)) == [0, 1, 2]
    assert len(reached) > len(set(reached))
    assert gs.custom_mode in (HOLD, MISSION)


def test_a_new_mission_uploaded_in_flight_starts_at_item_0_at_once():
    gs = station()
    flying_mission(gs, [item(0, north_m=30.0), item(1, north_m=300.0), item(2, north_m=600.0)])
    gs.wait(20.0)
    assert gs.last("MISSION_CURRENT").seq == 1
    assert gs.velocity[0] > 2.0
    upload(gs, [item(0, north_m=-200.0), item(1, north_m=-300.0)])
    gs.wait(8.0)
    assert gs.last("MISSION_CURRENT").seq == 0
    assert gs.velocity[0] < -2.0


def test_mission_set_current_jumps():
    gs = station()
    flying_mission(gs, [item(seq, north_m=100.0 * (seq + 1)) for seq in range(4)])
    gs.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    gs.wait(1.1)
    assert gs.last("MISSION_CURRENT").seq == 2


def test_mission_set_current_for_another_system_changes_nothing():
    gs = station()
    flying_mission(gs, [item(seq, north_m=100.0 * (seq + 1)) for seq in range(4)])
    assert gs.send(mavlink.MAVLink_mission_set_current_message(7, 1, 2)) == []
    gs.wait(1.1)
    assert gs.last("MISSION_CURRENT").seq == 0


@pytest.mark.parametrize(
    ("nonsense", "goes"),
    [
        (item(0, north_m=50_000.0), (4.0, 0.0)),
        (item(0, north_m=60.0, height_m=NAN), (3.0, 0.5)),
        (item(0, north_m=60.0, height_m=-30.0), (1.0, 0.5)),
        (
            mavlink.MAVLink_mission_item_int_message(
                1, 1, 0, RELATIVE, WAYPOINT, 0, 1, 0, 0, 0, NAN, 950_000_000, 85_456_000, 20.0, MISSIONS
            ),
            (4.0, 0.0),
        ),
    ],
    ids=["50 km away", "NaN altitude", "negative altitude", "latitude 95"],
)
def test_nonsense_is_flown(nonsense, goes):
    gs = station()
    flying_mission(gs, [nonsense])
    gs.wait(5.0)
    north, down = goes
    assert gs.velocity[0] > north
    assert gs.velocity[2] == pytest.approx(0.0, abs=0.3) if down == 0.0 else gs.velocity[2] > down


def test_a_return_item_brings_the_vehicle_home_and_down():
    gs = station()
    rtl = mavlink.MAVLink_mission_item_int_message(
        1, 1, 1, mavlink.MAV_FRAME_MISSION, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, 0, 1, 0, 0, 0, 0, 0, 0, 0, MISSIONS
    )
    flying_mission(gs, [item(0, north_m=40.0), rtl])
    gs.wait_for(lambda: not gs.armed, within_s=240.0)
    home = gs.last("HOME_POSITION")
    assert math.hypot(gs.position[0] - home.x, gs.position[1] - home.y) < 1.5


@pytest.mark.parametrize(
    "fence",
    [circle_fence(20.0, north_m=500.0), polygon_fence([(400, 0), (400, 50), (450, 50), (450, 0)])],
    ids=["circle", "polygon"],
)
def test_a_fence_that_does_not_contain_home_is_accepted_then_a_text_says_it_is_invalid_and_it_is_not_enforced(fence):
    gs = station()
    assert upload(gs, fence, FENCES) == mavlink.MAV_MISSION_ACCEPTED
    gs.wait(2.0)
    assert "invalid" in gs.said.lower()
    gs.take_off()
    gs.wait(5.0)
    assert gs.custom_mode == HOLD
    assert gs.status == mavlink.MAV_STATE_ACTIVE


@pytest.mark.parametrize(
    "fence",
    [
        circle_fence(30.0),
        polygon_fence([(-30, -30), (-30, 30), (30, 30), (30, -30)]),
        polygon_fence([(31, -30), (31, 30), (90, 30), (90, -30)], mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION),
    ],
    ids=["circle", "polygon", "exclusion"],
)
def test_a_breach_in_offboard_holds_while_the_stream_runs_on(fence):
    gs = station()
    assert upload(gs, fence, FENCES) == mavlink.MAV_MISSION_ACCEPTED
    gs.wait(1.0)
    assert "invalid" not in gs.said.lower()
    gs.take_off()

    def outward() -> None:
        gs.setpoint(velocity=(4.0, 0.0, 0.0), mask=VELOCITY_ONLY)

    gs.wait(1.0, do=outward)
    assert gs.px4_mode(OFFBOARD) == ACCEPTED
    gs.wait(25.0, do=outward)
    assert gs.custom_mode == HOLD
    assert gs.status == mavlink.MAV_STATE_CRITICAL
    assert gs.position[0] < 40.0
    assert math.hypot(*gs.velocity) < 0.5


@pytest.mark.parametrize(
    ("frame", "result"),
    [
        (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_MISSION_ACCEPTED),
        (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
    ],
)
def test_rally_points_are_relative_to_home_only(frame, result):
    rally = [item(0, mavlink.MAV_CMD_NAV_RALLY_POINT, kind=RALLIES, frame=frame)]
    assert upload(station(), rally, RALLIES) == result
