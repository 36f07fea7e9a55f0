"""What both autopilots answer to what is seldom asked, and to whom it was not addressed."""

import pytest

from tests.sim_bridge import test_ardupilot as copter
from tests.sim_bridge import test_ardupilot_plans as copter_plans
from tests.sim_bridge import test_px4_plans as px4
from tests.sim_bridge.ground_station import OFFBOARD, GroundStation, mavlink

ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
FAILED, REJECTED = mavlink.MAV_RESULT_FAILED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED
MISSIONS, FENCES, RALLIES = 0, 1, 2
NO_SUCH_MESSAGE, VERSION = 11_999, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION


def kinds(replies) -> list[str]:
    return [reply.get_type() for reply in replies]


def ordered(gs: GroundStation, command: int, first: float, system: int, component: int) -> list:
    """Results of the acknowledgements of a command for somebody."""
    long = mavlink.MAVLink_command_long_message(system, component, command, 0, first, 0, 0, 0, 0, 0, 0)
    return [reply.result for reply in gs.send(long) if reply.get_type() == "COMMAND_ACK"]


# Messages.


def test_a_message_that_px4_does_not_have_is_denied_and_its_rate_fails():
    gs = px4.station()
    assert gs.command(mavlink.MAV_CMD_REQUEST_MESSAGE, NO_SUCH_MESSAGE) == DENIED
    assert gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, NO_SUCH_MESSAGE, 1e5) == FAILED


def test_a_message_that_copter_does_not_have_fails_and_its_rate_is_denied_with_a_text():
    gs = copter.station()
    assert gs.command(mavlink.MAV_CMD_REQUEST_MESSAGE, NO_SUCH_MESSAGE) == FAILED
    assert gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, NO_SUCH_MESSAGE, 1e5) == DENIED
    assert "No ap_message for mavlink id (11999)" in gs.said


@pytest.mark.parametrize("station", [px4.station, copter.station], ids=["px4", "ardupilot"])
def test_both_tell_how_the_estimator_is(station):
    gs = station()
    assert gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS, 1e5) == ACCEPTED
    gs.forget()
    gs.wait(1.05)
    assert len(gs.all("ESTIMATOR_STATUS")) >= 9
    assert gs.last("ESTIMATOR_STATUS").flags & mavlink.ESTIMATOR_POS_HORIZ_ABS


# Plans.


def test_copter_clears_nothing_during_an_upload_and_not_all_kinds_at_once():
    gs = copter.station()
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 2, MISSIONS))
    (ack,) = gs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, MISSIONS))
    assert ack.type == mavlink.MAV_MISSION_ERROR
    (ack,) = gs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, RALLIES))
    assert ack.type == mavlink.MAV_MISSION_ACCEPTED
    (ack,) = gs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, mavlink.MAV_MISSION_TYPE_ALL))
    assert ack.type == mavlink.MAV_MISSION_UNSUPPORTED


def test_copter_takes_a_fence_while_a_mission_is_uploaded():
    gs = copter.station()
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 2, MISSIONS))
    gs.send(mavlink.MAVLink_mission_count_message(1, 1, 1, FENCES))
    (ack,) = gs.send(px4.circle_fence(50.0)[0])
    assert (ack.type, ack.mission_type) == (mavlink.MAV_MISSION_ACCEPTED, FENCES)
    gs.send(copter_plans.item(0))
    (ack,) = (reply for reply in gs.send(copter_plans.item(1)) if reply.get_type() == "MISSION_ACK")
    assert (ack.type, ack.mission_type) == (mavlink.MAV_MISSION_ACCEPTED, MISSIONS)


@pytest.mark.parametrize(
    ("fence", "text"),
    [
        (px4.polygon_fence([(-50, -50), (-50, 50), (50, 50), (50, -50)])[:3], "Incorrect item count"),
        (px4.polygon_fence([(-50, -50), (-50, 50)]), "Invalid vertex count (2)"),
        (px4.circle_fence(0.0), "Non-positive circle radius"),
        (px4.circle_fence(float("nan")), "Non-positive circle radius"),
    ],
    ids=["a corner too few", "a line", "no radius", "NaN"],
)
def test_copter_judges_a_fence_as_a_whole(fence, text):
    gs = copter.station()
    replies = gs.send(mavlink.MAVLink_mission_count_message(1, 1, len(fence), FENCES))
    while kinds(replies) == ["MISSION_REQUEST"]:
        replies = gs.send(fence[replies[0].seq])
    assert replies[-1].type == mavlink.MAV_MISSION_ERROR
    assert text in gs.said


@pytest.mark.parametrize("target", [0.0, 3.0, 65536.0, 3e38])
def test_copter_refuses_a_jump_to_an_item_that_is_not_there(target):
    jump = mavlink.MAVLink_mission_item_int_message(1, 1, 2, 2, 177, 0, 1, target, 1, 0, 0, 0, 0, 0, MISSIONS)
    assert (
        copter_plans.upload(copter.station(), [copter_plans.item(0), copter_plans.item(1), jump])
        == mavlink.MAV_MISSION_ERROR
    )


def test_copter_takes_off_to_a_height_above_home_only():
    gs = copter.station()
    copter.set_mode(gs, copter.GUIDED)
    gs.arm()
    for frame, result in ((mavlink.MAV_FRAME_GLOBAL, DENIED), (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, ACCEPTED)):
        takeoff = (frame, mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 0, 0, 15.0)
        (ack,) = gs.send(mavlink.MAVLink_command_int_message(1, 1, *takeoff))
        assert ack.result == result


# Addresses.


@pytest.mark.parametrize(
    ("system", "component", "result"), [(1, 1, ACCEPTED), (1, 0, ACCEPTED), (1, 77, FAILED), (0, 1, FAILED)]
)
def test_px4_obeys_what_is_for_its_autopilot_or_for_all_of_it(system, component, result):
    assert ordered(px4.station(), mavlink.MAV_CMD_REQUEST_MESSAGE, VERSION, system, component) == [result]


@pytest.mark.parametrize(("system", "result"), [(0, ACCEPTED), (1, ACCEPTED), (7, FAILED)])
def test_px4_tells_its_capabilities_to_whoever_asks_anybody(system, result):
    command = mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
    assert ordered(px4.station(), command, 1.0, system, 77) == [result]


@pytest.mark.parametrize(("component", "answered"), [(0, True), (1, True), (77, False), (190, False)])
def test_px4_answers_about_parameters_to_its_own_components(component, answered):
    gs = px4.station()
    read = mavlink.MAVLink_param_request_read_message(1, component, b"MAV_SYS_ID", -1)
    assert bool(gs.send(read)) is answered


@pytest.mark.parametrize(("component", "answered"), [(0, True), (1, True), (190, True), (77, False)])
def test_px4_answers_about_missions_also_as_the_mission_planner(component, answered):
    gs = px4.station()
    assert bool(gs.send(mavlink.MAVLink_mission_request_list_message(1, component, MISSIONS))) is answered


@pytest.mark.parametrize(("component", "streams"), [(0, True), (1, True), (77, False)])
def test_px4_hears_setpoints_for_its_own_components(component, streams):
    gs = px4.station()
    gs.take_off()

    def setpoint() -> None:
        gs.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, 1, component, mavlink.MAV_FRAME_LOCAL_NED, 2552, 0, 0, -20, 0, 0, 0, 0, 0, 0, 0, 0
            )
        )

    gs.wait(1.0, do=setpoint)
    assert gs.px4_mode(OFFBOARD) == (ACCEPTED if streams else REJECTED)


def test_copter_hears_what_is_for_every_system_and_for_components_that_nobody_is():
    gs = copter.station()
    assert ordered(gs, mavlink.MAV_CMD_REQUEST_MESSAGE, VERSION, 0, 77) == [ACCEPTED]
    assert kinds(gs.send(mavlink.MAVLink_mission_request_list_message(0, 0, MISSIONS))) == ["MISSION_COUNT"]
    assert gs.send(mavlink.MAVLink_mission_request_list_message(7, 0, MISSIONS)) == []
