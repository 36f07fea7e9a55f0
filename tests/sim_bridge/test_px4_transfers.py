"""How PX4 holds its one conversation about plans: with one partner, who hears the answers to all others too."""

import pytest

from tests.sim_bridge.ground_station import GroundStation, mavlink
from tests.sim_bridge.test_px4_plans import (
    FENCES,
    MISSIONS,
    RALLIES,
    circle_fence,
    download,
    flying_mission,
    item,
    station,
    upload,
)

ACCEPTED, ERROR = mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_ERROR


def second(gs: GroundStation) -> GroundStation:
    other = GroundStation(gs.vehicle, system=255)
    other.now_s = gs.now_s
    return other


def count(number: int, kind: int = MISSIONS):
    return mavlink.MAVLink_mission_count_message(1, 1, number, kind)


def asked_list(kind: int = MISSIONS):
    return mavlink.MAVLink_mission_request_list_message(1, 1, kind)


def asked(seq: int, kind: int = MISSIONS):
    return mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind)


def answers(replies) -> list[tuple]:
    """Type, target and result or number of each answer; texts in words."""
    return [
        reply.text
        if reply.get_type() == "STATUSTEXT"
        else (reply.get_type(), reply.target_system, getattr(reply, "type", getattr(reply, "seq", None)))
        for reply in replies
    ]


def test_a_count_before_the_first_item_is_taken_for_a_repetition_whoever_sends_it():
    gs = station()
    gs.send(count(2))
    gs.wait(0.1)
    assert answers(second(gs).send(count(7, FENCES))) == [("MISSION_REQUEST", 245, 0)]
    gs.send(item(0))
    (ack,) = gs.send(item(1))
    assert ack.type == ACCEPTED
    assert len(download(gs)) == 2


@pytest.mark.parametrize("who", ["partner", "another"])
def test_a_count_after_the_first_item_is_an_error_for_the_partner_and_the_upload_goes_on(who):
    gs = station()
    gs.send(count(2))
    gs.send(item(0))
    sender = gs if who == "partner" else second(gs)
    assert answers(sender.send(count(2))) == ["WPM: REJ. CMD: Busy", ("MISSION_ACK", 245, ERROR)]
    (ack,) = gs.send(item(1))
    assert ack.type == ACCEPTED


def test_every_count_puts_the_end_of_a_stalled_upload_off():
    gs = station()
    gs.send(count(2))
    gs.send(item(0))
    for _ in range(3):
        gs.wait(4.0)
        gs.send(count(2))
    assert "Operation timeout" not in gs.said
    gs.wait(5.2)
    assert "Operation timeout" in gs.said
    assert upload(gs, [item(0)]) == ACCEPTED


def test_an_unfinished_download_blocks_uploads_until_five_seconds_of_silence():
    gs = station()
    upload(gs, [item(0), item(1)])
    gs.send(asked_list())
    gs.send(asked(0))
    for _ in range(3):
        assert answers(gs.send(count(1))) == ["WPM: IGN MISSION_COUNT: Busy", ("MISSION_ACK", 245, ERROR)]
        gs.wait(1.5)
    gs.wait(1.0)
    assert "Operation timeout" in gs.said
    assert upload(gs, [item(0)]) == ACCEPTED


def test_who_uploads_during_a_download_of_another_hears_nothing_of_its_own():
    gs = station()
    upload(gs, [item(0), item(1)])
    gs.send(asked_list())
    assert answers(second(gs).send(count(1))) == ["WPM: IGN MISSION_COUNT: Busy", ("MISSION_ACK", 245, ERROR)]


def test_a_second_station_takes_over_a_download_of_the_same_kind_only():
    gs = station()
    upload(gs, [item(0), item(1)])
    gs.send(asked_list())
    gs.send(asked(0))
    other = second(gs)
    assert answers(other.send(asked_list(FENCES))) == ["Mission download request ignored, already active"]
    assert answers(other.send(asked_list())) == [("MISSION_COUNT", 255, None)]
    assert answers(gs.send(asked(1))) == ["WPM: REJ. CMD: partner id mismatch"]
    assert answers(other.send(asked(0))) == [("MISSION_ITEM_INT", 255, 0)]


def test_an_item_is_asked_for_again_but_none_out_of_turn():
    gs = station()
    upload(gs, [item(0), item(1), item(2)])
    gs.send(asked_list())
    assert answers(gs.send(asked(0))) == answers(gs.send(asked(0))) == [("MISSION_ITEM_INT", 245, 0)]
    assert answers(gs.send(asked(2))) == [("MISSION_ACK", 245, ERROR), "WPM: REJ. CMD: Req. WP was unexpected"]
    assert answers(gs.send(asked(0))) == []


def test_an_upload_is_not_cleared_away_and_no_item_is_set_current_meanwhile():
    gs = station()
    upload(gs, [item(0), item(1)])
    gs.send(count(2))
    gs.send(item(0, north_m=10.0))
    clear = mavlink.MAVLink_mission_clear_all_message(1, 1, MISSIONS)
    assert answers(gs.send(clear)) == ["WPM: IGN CLEAR CMD: Busy"]
    set_current = mavlink.MAVLink_mission_set_current_message(1, 1, 1)
    assert answers(gs.send(set_current)) == ["WPM: IGN WP CURR CMD: Busy"]
    (ack,) = gs.send(item(1))
    assert ack.type == ACCEPTED


def test_an_item_without_a_transfer_is_an_error_but_the_last_one_again_is_accepted_again():
    gs = station()
    upload(gs, [item(0), item(1)])
    assert answers(gs.send(item(1))) == [("MISSION_ACK", 245, ACCEPTED)]
    assert answers(gs.send(item(0))) == ["IGN MISSION_ITEM: No transfer", ("MISSION_ACK", 245, ERROR)]
    assert answers(gs.send(item(1, kind=RALLIES))) == [("MISSION_ACK", 245, ERROR)]


def test_the_same_mission_uploaded_again_in_flight_does_not_begin_again():
    gs = station()
    items = [item(0, north_m=30.0), item(1, north_m=300.0), item(2, north_m=600.0)]
    flying_mission(gs, items)
    gs.wait(20.0)
    assert upload(gs, items) == ACCEPTED
    gs.wait(1.1)
    assert gs.last("MISSION_CURRENT").seq == 1


def test_a_fence_that_is_held_already_is_not_looked_at_again():
    gs = station()
    fence = circle_fence(20.0, north_m=500.0)
    upload(gs, fence, FENCES)
    assert "invalid" in gs.said
    gs.forget()
    upload(gs, fence, FENCES)
    gs.wait(1.0)
    assert "invalid" not in gs.said
