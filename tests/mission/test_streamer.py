"""The setpoint stream on its own thread, in real time for a moment."""

import itertools
import threading
import time

import numpy as np
import pytest

from mission.executive.course import Course
from mission.flying.clock import FlightClock
from mission.flying.streamer import LATE_S, STALE_S, Streamer
from mission.flying.ways import along
from planner.problem import Limits
from tests.mission.proven import proven

CURVE = proven(along(np.array([[0.0, 0.0, 10.0], [300.0, 0.0, 10.0]]), Limits(5.0, 2.0, 1.5, 3.0)))


class Wire:
    """Collects what is sent while it is let out."""

    def __init__(self):
        self.sent = []
        self.let_out = False
        self.stopped = 0
        self.enough = threading.Event()
        self.wanted = 10**9

    def send(self, setpoint):
        if not self.let_out:
            return
        self.sent.append((time.monotonic(), setpoint))
        if len(self.sent) >= self.wanted:
            self.enough.set()

    def start(self):
        self.let_out = True

    def stop(self):
        self.let_out = False
        self.stopped += 1

    def wait_for(self, count):
        self.wanted = len(self.sent) + count
        self.enough.clear()
        assert self.enough.wait(20.0)


@pytest.fixture
def stream():
    wire, clock = Wire(), FlightClock(time.monotonic())
    recorded = []
    streamer = Streamer(clock, 50.0, wire.send, wire.start, wire.stop, lambda *what: recorded.append(what))
    yield wire, streamer, clock, recorded
    streamer.close()


def course(clock, from_s=10.0):
    return Course.begin(CURVE, clock.now(time.monotonic()), 0.0, 3.0, 1.0, from_s=from_s).resuming(0.0)


def test_nothing_is_sent_without_a_course(stream):
    wire, *_ = stream
    time.sleep(0.1)
    assert wire.sent == []


def test_setpoints_follow_the_course_and_each_is_recorded(stream):
    wire, streamer, clock, recorded = stream
    streamer.follow(course(clock))
    wire.wait_for(15)
    streamer.follow(None)
    places = [setpoint.position_enu_m[0] for _, setpoint in wire.sent]
    assert all(b > a for a, b in itertools.pairwise(places))
    assert len(wire.sent) <= len(recorded) <= len(wire.sent) + 1
    for now_s, point, setpoint in recorded:
        assert setpoint.position_enu_m == point.setpoint().position_enu_m
        assert now_s > 0.0


def test_setpoints_lean_against_the_drag_they_are_given():
    wire, clock = Wire(), FlightClock(time.monotonic())
    recorded = []
    streamer = Streamer(
        clock, 50.0, wire.send, wire.start, wire.stop, lambda *what: recorded.append(what), drag_per_s=0.5
    )
    try:
        streamer.follow(course(clock))
        wire.wait_for(5)
    finally:
        streamer.close()
    _, point, setpoint = recorded[-1]
    assert point.setpoint().velocity_enu_mps[0] > 0.1
    assert setpoint == point.setpoint(0.5) != point.setpoint()


def test_after_none_not_one_setpoint_more_is_sent(stream):
    wire, streamer, clock, _ = stream
    streamer.follow(course(clock))
    wire.wait_for(5)
    streamer.follow(None)
    count = len(wire.sent)
    assert wire.stopped == 1
    time.sleep(0.15)
    assert len(wire.sent) == count


def test_a_flight_that_nobody_watches_brakes_on_its_course_and_stands_with_zero_velocity(stream):
    wire, streamer, clock, _ = stream
    streamer.follow(course(clock))
    wire.wait_for(5)
    # Nobody renews: STALE_S later it brakes, and the braking of 5 m/s takes three seconds.
    time.sleep(STALE_S + 3.5)
    last = [setpoint for _, setpoint in wire.sent[-3:]]
    assert len({setpoint.position_enu_m for setpoint in last}) == 1
    assert last[-1].velocity_enu_mps == (0.0, 0.0, 0.0)
    stalled = streamer.renew()
    assert stalled is not None
    assert stalled.stop_position() == pytest.approx(last[-1].position_enu_m)
    assert streamer.renew() is None


def test_a_course_that_was_braked_on_is_not_taken_up_where_it_would_be_by_now(stream):
    wire, streamer, clock, _ = stream
    flown = course(clock)
    streamer.follow(flown)
    wire.wait_for(5)
    time.sleep(STALE_S + 1.5)
    # The loop comes back, and acts before it knows that the stream braked meanwhile.
    streamer.follow(flown)
    streamer.follow(flown.braking(clock.now(time.monotonic()) - STALE_S))
    wire.wait_for(5)
    for (before_s, before), (after_s, after) in itertools.pairwise(wire.sent):
        step_m = after.position_enu_m[0] - before.position_enu_m[0]
        # A jump to where it would be by now is ten metres; a busy machine sends a setpoint some tenths late.
        assert 0.0 <= step_m <= 5.0 * (after_s - before_s + 0.4)
    assert streamer.renew() is not None
    streamer.follow(flown)
    wire.wait_for(1)
    assert wire.sent[-1][1].velocity_enu_mps[0] > 1.0


def test_a_course_that_brakes_already_is_left_to_brake(stream):
    _, streamer, clock, _ = stream
    braking = course(clock).braking(clock.now(time.monotonic()))
    streamer.follow(braking)
    time.sleep(STALE_S + 0.3)
    assert streamer.renew() is None


def test_the_stream_ends_at_once_while_a_setpoint_is_stuck_on_its_way():
    wire, clock, stuck, sending = Wire(), FlightClock(time.monotonic()), threading.Event(), threading.Event()

    def send(setpoint):
        sending.set()
        stuck.wait(20.0)
        wire.send(setpoint)

    streamer = Streamer(clock, 50.0, send, wire.start, wire.stop, lambda *_: None)
    try:
        streamer.follow(course(clock))
        assert sending.wait(20.0)
        streamer.renew()
        streamer.follow(None)
        assert wire.stopped == 1
        stuck.set()
    finally:
        streamer.close()
    assert wire.sent == []


def test_a_flight_that_is_watched_goes_on(stream):
    wire, streamer, clock, _ = stream
    streamer.follow(course(clock))
    for _ in range(20):
        time.sleep(0.05)
        assert streamer.renew() is None
    assert wire.sent[-1][1].velocity_enu_mps[0] > 1.0


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_setpoint_that_cannot_be_sent_ends_the_stream_and_is_not_repeated():
    def send(_):
        raise ValueError("a setpoint needs finite numbers")

    wire, clock = Wire(), FlightClock(time.monotonic())
    streamer = Streamer(clock, 50.0, send, wire.start, wire.stop, lambda *_: None)
    try:
        assert not streamer.failed
        streamer.follow(course(clock))
        until = time.monotonic() + 10.0
        while not streamer.failed and time.monotonic() < until:
            time.sleep(0.01)
        assert streamer.failed
        assert wire.stopped == 1
    finally:
        streamer.close()


def test_setpoints_that_came_late_are_told_of_once_and_the_beginning_of_a_stream_is_not_late(stream):
    wire, streamer, clock, _ = stream
    assert not streamer.was_late()
    time.sleep(1.2 * LATE_S)
    streamer.follow(course(clock))
    wire.wait_for(3)
    assert not streamer.was_late()
    held, send = threading.Event(), wire.send

    def slowly(setpoint):
        held.wait(1.5 * LATE_S)
        send(setpoint)

    streamer._send = slowly
    time.sleep(1.2 * LATE_S)
    # While it is late, and when it has come.
    assert streamer.was_late()
    wire.wait_for(1)
    held.set()
    assert streamer.was_late()
    wire.wait_for(3)
    assert not streamer.was_late()


def test_a_stream_that_is_closed_has_not_failed():
    wire = Wire()
    streamer = Streamer(FlightClock(time.monotonic()), 50.0, wire.send, wire.start, wire.stop, lambda *_: None)
    streamer.close()
    assert not streamer.failed
    assert wire.stopped > 0


def test_while_the_clock_waits_for_a_simulator_nothing_is_repeated_as_news():
    wire, clock = Wire(), FlightClock(time.monotonic(), 10.0)
    streamer = Streamer(clock, 20.0, wire.send, wire.start, wire.stop, lambda *what: None)
    try:
        clock.hear(100.0, time.monotonic())
        streamer.follow(course(clock))
        time.sleep(0.4)
        # A tenth of a second ahead of what was heard, and then no further.
        assert 1 <= len(wire.sent) <= 4
    finally:
        streamer.close()
