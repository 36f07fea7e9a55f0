"""Answers that a vehicle gives in parts, or that nobody knows: the client takes the last one, and lives."""

import queue
import time
from collections.abc import Iterator

import pytest

from sim_bridge.codec import Codec, frames_in, mavlink
from sim_bridge.link.client import Link
from sim_bridge.state import GeodeticPoint, Waiting

MODE = mavlink.MAV_CMD_DO_SET_MODE


class Hesitating:
    """A wire to a vehicle that says more than that a command is done."""

    datagrams = True

    def __init__(self) -> None:
        self.results: tuple[int, ...] = ()
        self._codec = Codec(1, 1)
        self._heard: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self.asked = 0

    def believe(self) -> None:
        """There is nobody else."""

    def receive(self, timeout_s: float) -> bytes:
        """Its answers; else a heartbeat."""
        try:
            return self._heard.get(timeout=timeout_s)
        except queue.Empty:
            return self._codec.encode(mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_PX4, 1, 0, 3, 3))

    def send(self, data: bytes) -> None:
        """Answer what asks for a mode."""
        wanted = [number for number, _ in frames_in(data)]
        if mavlink.MAVLINK_MSG_ID_COMMAND_LONG not in wanted:
            return
        (asked,) = Codec(1, 1).decode(data)
        if asked.command != MODE:
            return
        self.asked += 1
        for result in self.results:
            answer = mavlink.MAVLink_command_ack_message(MODE, result, 50, 0, asked.get_srcSystem(), 190)
            self._heard.put(self._codec.encode(answer))

    def close(self) -> None:
        """Nothing to let go of."""


@pytest.fixture(scope="module")
def wire() -> Hesitating:
    return Hesitating()


@pytest.fixture(scope="module")
def link(wire: Hesitating) -> Iterator[Link]:
    link = Link(wire, GeodeticPoint(47.3977, 8.5456, 488.0))
    try:
        link.wait_heard(10.0)
        yield link
    finally:
        link.close()


def test_of_a_vehicle_that_tells_nothing_but_that_it_lives_what_is_missing_is_named(link: Link) -> None:
    waiting = next(timed.event for timed in link.events(10.0))
    assert isinstance(waiting, Waiting)
    assert "its local position estimate" in waiting.waiting_for


def test_what_comes_before_the_last_answer_does_no_harm(link: Link, wire: Hesitating) -> None:
    assert link._commands is not None
    for count, before in enumerate((mavlink.MAV_RESULT_IN_PROGRESS, 9, 200), start=1):
        wire.results = (before, before, mavlink.MAV_RESULT_ACCEPTED, before)
        link._commands._command_long(MODE, 1.0, 4.0, 4.0)
        # A second answer would end the whole process, a moment after the first.
        time.sleep(0.5)
        assert wire.asked == count
