"""The gate of the setpoints: what is repeated too long does not leave as it was, what is no number not at all."""

import math

import pytest

from sim_bridge.codec import Codec, mavlink
from sim_bridge.link.stream import FRESH_S, HELD_S, StreamGate, held
from sim_bridge.state import LARGEST_ON_THE_WIRE

POSITION = (10.0, -20.5, -12.25)
VELOCITY = (3.0, -1.0, 0.5)


def setpoint(position=POSITION, time_ms=1000):
    message = mavlink.MAVLink_set_position_target_local_ned_message(
        time_ms, 1, 1, 1, 0, *position, *VELOCITY, 0.1, 0.2, 0.3, 1.5, 0.25
    )
    return Codec(245, 190).encode(message)


def heartbeat():
    return Codec(245, 190).encode(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))


class Line:
    """Collects what leaves, on a clock of its own."""

    def __init__(self):
        self.now_s, self.sent = 100.0, []
        self.gate = StreamGate(self.sent.append, lambda: self.now_s)

    def streams(self, position=POSITION):
        self.gate.expect(position)
        self.gate.send(setpoint(position))

    def left(self):
        sent, self.sent[:] = list(self.sent), []
        return sent


@pytest.fixture
def line():
    line = Line()
    line.gate.open()
    return line


def read(frame):
    (message,) = Codec(1, 1).decode(frame)
    return message


def test_a_fresh_setpoint_is_repeated_as_it_is(line):
    line.streams()
    line.now_s += FRESH_S
    line.gate.send(setpoint(time_ms=1500))
    assert line.left() == [setpoint(), setpoint(time_ms=1500)]


def test_a_setpoint_that_nobody_renews_is_left_standing_at_its_place(line):
    line.streams()
    line.left()
    line.now_s += FRESH_S + 0.1
    line.gate.send(setpoint(time_ms=1600))
    (frame,) = line.left()
    message = read(frame)
    assert (message.x, message.y, message.z) == POSITION
    assert (message.vx, message.vy, message.vz) == (0.0, 0.0, 0.0)
    assert (message.afx, message.afy, message.afz) == (0.0, 0.0, 0.0)
    assert (message.yaw, message.yaw_rate) == (1.5, 0.0)
    assert (message.time_boot_ms, message.type_mask) == (1600, 0)


def test_after_some_seconds_it_is_silent(line):
    line.streams()
    line.left()
    line.now_s += HELD_S + 0.1
    line.gate.send(setpoint())
    assert line.left() == []
    line.streams()
    assert line.left() == [setpoint()]


def test_an_older_setpoint_does_not_pass_any_more(line):
    line.streams()
    line.left()
    places = [(10.0 + step, -20.5, -12.25) for step in range(4)]
    for place in places[1:]:
        line.gate.expect(place)
    # They are on their way: each leaves, in its turn.
    for place in (places[0], places[1], places[3]):
        line.gate.send(setpoint(place))
        assert line.left() == [setpoint(place)]
    for place in places[:3]:
        line.gate.send(setpoint(place))
    assert line.left() == []


def test_a_setpoint_that_is_set_again_and_again_stays_fresh(line):
    for _ in range(100):
        line.streams()
        line.now_s += 0.9 * FRESH_S
    assert line.left() == 100 * [setpoint()]


def test_what_was_repeated_while_it_was_closed_does_not_leave_when_it_opens(line):
    line.streams()
    line.gate.close()
    line.left()
    line.gate.send(setpoint())
    line.gate.open()
    line.gate.send(setpoint())
    assert line.left() == []


def test_everything_else_passes_closed_or_stale(line):
    line.gate.close()
    line.gate.send(heartbeat())
    assert line.left() == [heartbeat()]


def test_gaps_are_between_new_setpoints_and_not_their_repetitions(line):
    for _ in range(3):
        line.streams()
        line.now_s += 0.05
        line.gate.send(setpoint())
        line.now_s += 0.25
    assert line.gate.gaps_s() == pytest.approx([0.3, 0.3])
    line.gate.close()
    line.now_s += 60.0
    line.gate.open()
    line.streams()
    assert line.gate.gaps_s() == pytest.approx([0.3, 0.3])


def test_a_hold_is_the_same_message_with_a_checksum_of_its_own():
    assert read(held(setpoint())).get_type() == "SET_POSITION_TARGET_LOCAL_NED"


BAD = (math.nan, math.inf, -math.inf)


def local(numbers):
    return Codec(245, 190).encode(mavlink.MAVLink_set_position_target_local_ned_message(5, 1, 1, 1, 2048, *numbers))


def let_out(frame, position=(0.0, 0.0, 0.0)):
    sent = []
    gate = StreamGate(sent.append)
    gate.open()
    gate.expect(position)
    gate.send(frame)
    assert sent in ([], [frame])
    return bool(sent)


@pytest.mark.parametrize("bad", BAD)
def test_a_setpoint_with_anything_that_is_no_number_does_not_leave(bad):
    for place in range(11):
        numbers = [1.0] * 11
        numbers[place] = bad
        assert not let_out(local(numbers), tuple(numbers[:3]))


def test_a_setpoint_of_numbers_leaves_whatever_they_are():
    for numbers in ([0.0] * 11, [-0.0] * 11, [LARGEST_ON_THE_WIRE] * 11, [1e-45] * 11):
        assert let_out(local(numbers), tuple(numbers[:3]))


def test_a_setpoint_in_a_frame_that_nobody_here_uses_does_not_leave():
    message = mavlink.MAVLink_set_position_target_global_int_message
    assert not let_out(Codec(245, 190).encode(message(5, 1, 1, 5, 2048, 473_977_000, -5_000_000, *[0.0] * 9)))


def test_what_is_no_setpoint_may_have_numbers_that_are_none():
    take_off = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_NAV_TAKEOFF, 0, *(math.nan,) * 6, 500.0)
    assert let_out(Codec(245, 190).encode(take_off))
