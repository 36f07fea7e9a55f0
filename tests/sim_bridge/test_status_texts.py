"""Texts in chunks over a line that doubles, swaps and loses them."""

import itertools

import pytest

from sim_bridge.codec import mavlink, messages
from sim_bridge.frames import VehicleFrame
from sim_bridge.link.telemetry import Telemetry
from sim_bridge.state import GeodeticPoint, StatusText
from sim_bridge.vehicle.services import status_texts

LONG = (
    "Preflight Fail: the compass is not calibrated, please calibrate it; and the battery is the one of another vehicle"
)
SEVERITY = 3


def sent(message):
    """As it arrives."""
    (received,) = messages(bytes(message.pack(mavlink.MAVLink(None, 1, 1))))
    return received


def chunks(text: str = LONG, text_id: int = 9) -> list:
    return [sent(message) for message in status_texts(SEVERITY, text, text_id)]


HEARTBEAT = sent(mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_PX4, 1, 0, 3, 3))


def told(*heard) -> list[str]:
    """The texts that come of messages, in order."""
    telemetry = Telemetry(VehicleFrame(GeodeticPoint(47.3977, 8.5456, 488.0)))
    events = [event for message in heard for event in telemetry.receive(message)]
    return [event.text for event in events if isinstance(event, StatusText)]


@pytest.mark.parametrize("text", ["short", "x" * 50, "x" * 51, "x" * 100, LONG, "é" * 25 + "tail", "→" * 60])
def test_text_in_chunks_is_put_together(text):
    assert told(*chunks(text)) == [text]


def test_chunks_in_any_order_are_one_text():
    parts = chunks()
    assert len(parts) == 3
    for order in itertools.permutations(parts):
        assert told(*order) == [LONG]


def test_chunks_that_come_twice_are_told_once():
    first, second, third = chunks()
    assert told(first, first, second, third, third, first, HEARTBEAT, HEARTBEAT, HEARTBEAT) == [LONG]


def test_texts_whose_chunks_mix_are_told_apart():
    (one, two), (three, four) = chunks("a" * 70, 9), chunks("b" * 70, 10)
    assert told(one, three, four, two) == ["b" * 70, "a" * 70]


def test_what_is_lost_of_a_text_is_marked_when_a_second_or_two_have_passed():
    first, second, third = chunks()
    assert told(first, third, HEARTBEAT) == []
    assert told(first, third, HEARTBEAT, HEARTBEAT) == [LONG[:50] + "…" + LONG[100:]]
    assert told(first, second, HEARTBEAT, HEARTBEAT) == [LONG[:100] + "…"]
    assert told(third, HEARTBEAT, HEARTBEAT, HEARTBEAT) == ["……" + LONG[100:]]


def test_the_number_of_a_text_may_be_used_again():
    (lost, _), (first, second) = chunks("a" * 70), chunks("b" * 70)
    assert told(lost, first, second) == ["a" * 50 + "…", "b" * 70]
    assert told(first, second, HEARTBEAT, HEARTBEAT, first, second) == ["b" * 70] * 2


def test_texts_without_an_end_are_told_up_to_a_length_and_keep_little():
    telemetry = Telemetry(VehicleFrame(GeodeticPoint(47.3977, 8.5456, 488.0)))
    heard = []
    for number in range(20_000):
        heard += telemetry.receive(sent(mavlink.MAVLink_statustext_message(SEVERITY, b"x" * 50, 7, number % 256)))
        heard += telemetry.receive(sent(mavlink.MAVLink_statustext_message(SEVERITY, b"y" * 50, 8 + number, 0)))
    assert max(len(event.text) for event in heard) <= 400
    assert len(telemetry._texts._texts) <= 8
