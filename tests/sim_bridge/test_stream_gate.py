"""The gate that setpoints pass: nothing that is no number gets out."""

import math

import pytest

from sim_bridge.codec import Codec, mavlink
from sim_bridge.link.stream import StreamGate
from sim_bridge.state import LARGEST_ON_THE_WIRE

MASK = 2048
BAD = (math.nan, math.inf, -math.inf)


def local(numbers) -> bytes:
    return Codec(245, 190).encode(mavlink.MAVLink_set_position_target_local_ned_message(5, 1, 1, 1, MASK, *numbers))


def whole_earth(latitude_e7: int, longitude_e7: int, numbers) -> bytes:
    message = mavlink.MAVLink_set_position_target_global_int_message
    return Codec(245, 190).encode(message(5, 1, 1, 5, MASK, latitude_e7, longitude_e7, *numbers))


def let_out(frame: bytes) -> bool:
    sent: list[bytes] = []
    gate = StreamGate(sent.append)
    gate.open()
    gate.send(frame)
    assert sent in ([], [frame])
    return bool(sent)


@pytest.mark.parametrize("bad", BAD)
def test_a_setpoint_with_anything_that_is_no_number_does_not_leave(bad):
    for place in range(11):
        numbers = [1.0] * 11
        numbers[place] = bad
        assert not let_out(local(numbers))
    for place in range(9):
        numbers = [1.0] * 9
        numbers[place] = bad
        assert not let_out(whole_earth(473_977_000, 85_456_000, numbers))


def test_a_setpoint_of_numbers_leaves_whatever_they_are():
    for numbers in ([0.0] * 11, [-0.0] * 11, [LARGEST_ON_THE_WIRE] * 11, [1e-45] * 11):
        assert let_out(local(numbers))
    # Half a degree west would be no number, were it read as one.
    assert let_out(whole_earth(473_977_000, -5_000_000, [0.0] * 9))


def test_what_is_no_setpoint_may_have_numbers_that_are_none():
    take_off = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_NAV_TAKEOFF, 0, *(math.nan,) * 6, 500.0)
    assert let_out(Codec(245, 190).encode(take_off))
