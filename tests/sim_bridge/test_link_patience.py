"""How long the flight client waits and how often it asks, against a vehicle that says only what a test lets it say."""

import contextlib
import math
import queue
import threading
import time
from collections.abc import Callable, Iterator

import pytest
from mavsdk.plugins.action import Action, ActionError, ActionResult
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw, MissionRawError, MissionRawResult

from sim_bridge.codec import Codec, Message, mavlink
from sim_bridge.dialects import Autopilot
from sim_bridge.link.client import Link, LinkError
from sim_bridge.link.commands import STREAMS_HZ
from sim_bridge.state import GeodeticPoint, Setpoint

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
LONGEST_S = 20.0
GIVEN_UP_S = 2.0
"""After so long a command that is not answered at all has been given up."""


class Reticent:
    """A wire to a vehicle that tells heartbeats and its origin, and answers what a test has it answer.

    It refuses all commands at once but arming, which it does not answer by itself.
    """

    datagrams = True

    def __init__(self, autopilot: Autopilot = Autopilot.PX4) -> None:
        self.sent: list[Message] = []
        self.beats = True
        self.answer: Callable[[Message], list[Message]] = refusal
        self._autopilot = autopilot
        self._codec = Codec(1, 1)
        self._heard: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def believe(self) -> None:
        """There is nobody else."""

    def receive(self, timeout_s: float) -> bytes:
        """Its answers; else that it is there."""
        with contextlib.suppress(queue.Empty):
            return self._heard.get(timeout=timeout_s)
        if not self.beats:
            return b""
        self._heard.put(self._codec.encode(mavlink.MAVLink_gps_global_origin_message(473977000, 85456000, 488000)))
        heartbeat = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_QUADROTOR, self._autopilot.value, 1, 0, 3, 3)
        return self._codec.encode(heartbeat)

    def send(self, data: bytes) -> None:
        """Note what was asked, and answer it."""
        for message in Codec(1).decode(data):
            self.sent.append(message)
            for answer in self.answer(message):
                self.say(answer)

    def say(self, message: Message) -> None:
        """Have a message heard."""
        self._heard.put(self._codec.encode(message))

    def close(self) -> None:
        """Nothing to let go of."""

    def asked(self, command: int) -> list[Message]:
        """Every time that a command was sent."""
        return [m for m in self.sent if m.get_type() == "COMMAND_LONG" and m.command == command]

    def all(self, kind: str) -> list[Message]:
        """Every message of a type that was sent."""
        return [message for message in self.sent if message.get_type() == kind]


def acknowledged(message: Message, result: int) -> list[Message]:
    peer = (message.get_srcSystem(), message.get_srcComponent())
    return [mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *peer)]


def refusal(message: Message) -> list[Message]:
    other = message.get_type() == "COMMAND_LONG" and message.command != ARM
    return acknowledged(message, mavlink.MAV_RESULT_UNSUPPORTED) if other else []


def soon(what: Callable[[], bool]) -> bool:
    """Whether something comes about."""
    until_s = time.monotonic() + LONGEST_S
    while not what() and time.monotonic() < until_s:
        time.sleep(0.01)
    return what()


@contextlib.contextmanager
def linked(wire: Reticent) -> Iterator[Link]:
    link = Link(wire, GROUND)
    try:
        link.wait_heard(LONGEST_S)
        yield link
    finally:
        link.close()


def test_a_command_that_is_not_answered_is_repeated_three_times_and_given_up():
    wire = Reticent()
    with linked(wire) as link:
        with pytest.raises(ActionError) as caught:
            Action(link.system).arm()
        assert caught.value.result is ActionResult.TIMEOUT
        assert len(wire.asked(ARM)) == 4


def test_a_command_that_is_in_progress_is_waited_for_longer():
    wire = Reticent()
    later: list[threading.Timer] = []

    def answer(message: Message) -> list[Message]:
        if message.get_type() != "COMMAND_LONG" or message.command != ARM or later:
            return refusal(message)
        (accepted,) = acknowledged(message, mavlink.MAV_RESULT_ACCEPTED)
        later.append(threading.Timer(GIVEN_UP_S + 1.5, wire.say, [accepted]))
        later[0].start()
        return acknowledged(message, mavlink.MAV_RESULT_IN_PROGRESS)

    wire.answer = answer
    with linked(wire) as link:
        Action(link.system).arm()
        # It was in progress, so it was not asked for again.
        assert len(wire.asked(ARM)) == 1
    later[0].join()


def test_an_upload_that_is_not_answered_is_begun_five_times_and_given_up():
    wire = Reticent()
    with linked(wire) as link:
        items = [MissionItem(seq, 6, 16, int(seq == 0), 1, *(0.0,) * 4, 473977000, 85456000, 20.0, 0) for seq in (0, 1)]
        with pytest.raises(MissionRawError) as caught:
            MissionRaw(link.system).upload_mission(items)
        assert caught.value.result is MissionRawResult.TIMEOUT
        assert len(wire.all("MISSION_COUNT")) == 5


def test_a_vehicle_whose_heartbeats_end_is_noticed_as_lost():
    wire = Reticent()
    with linked(wire) as link:
        assert link.system.is_connected()
        wire.beats = False
        assert soon(lambda: not link.system.is_connected())


def test_each_setpoint_leaves_when_it_is_set_and_the_last_again_and_again():
    wire = Reticent()
    with linked(wire) as link:
        assert soon(lambda: link._telemetry.origin is not None)
        link.open_stream()
        for number in range(300):
            link.stream(Setpoint((0.0, 0.0, float(number)), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0))

        def heights_m() -> list[int]:
            return [round(-message.z) for message in wire.all("SET_POSITION_TARGET_LOCAL_NED")]

        assert soon(lambda: heights_m().count(299) > 10)
        assert list(dict.fromkeys(heights_m())) == list(range(300))
        sent = wire.all("SET_POSITION_TARGET_LOCAL_NED")
        # Position, velocity, acceleration and heading, all of them whole.
        assert {message.type_mask for message in sent} == {2048}
        assert {message.coordinate_frame for message in sent} == {mavlink.MAV_FRAME_LOCAL_NED}


def test_a_copter_is_asked_for_every_stream_that_is_needed():
    wire = Reticent(Autopilot.ARDUPILOT)
    wire.answer = lambda m: acknowledged(m, mavlink.MAV_RESULT_ACCEPTED) if m.get_type() == "COMMAND_LONG" else []
    with linked(wire):
        asked = {
            round(message.param1): 1e6 / message.param2 for message in wire.asked(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL)
        }
    assert {number: asked[number] for number in STREAMS_HZ} == pytest.approx(STREAMS_HZ)


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e39])
def test_a_parameter_that_is_no_number_does_not_leave(bad):
    wire = Reticent()
    with linked(wire) as link:
        with pytest.raises(LinkError, match="finite number"):
            link.set_parameter("MPC_XY_VEL_MAX", bad)
        assert wire.all("PARAM_SET") == []
