"""Uploads over any line: the plan arrives whole, or the vehicle says so and keeps to its manners."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_bridge.ardupilot.plan_transfer import PlanTransfer as ArduPilotTransfer
from sim_bridge.ardupilot.plans import kept
from sim_bridge.channel import Channel, Quality
from sim_bridge.codec import Codec
from sim_bridge.px4.plan_transfer import PlanTransfer as Px4Transfer
from sim_bridge.vehicle.plan_items import Item
from sim_bridge.vehicle.plan_storage import PlanStorage
from tests.sim_bridge.ground_station import TICK_S, mavlink

MISSION = mavlink.MAV_MISSION_TYPE_MISSION
OLD = [Item(16, 3, (0.0, 0.0, 0.0, 0.0), 1, 2, 3.0)]
TIMEOUT_S = 1.5
RETRIES = 5


def items(count: int) -> list[Item]:
    return [Item(16, 3, (0.0, 0.0, 0.0, 0.0), 1000 * index, -1000 * index, 10.0 + index) for index in range(count)]


class Uploader:
    """A client as the protocol describes it: answers requests, and asks again when nothing comes."""

    def __init__(self, storage: PlanStorage, plan: list[Item], quality: Quality, seed: int) -> None:
        self.storage = storage
        self.storage.plans[MISSION] = list(OLD)
        self.plan = plan
        self.verdict: int | None = None
        self._there, self._back = Channel(quality, seed), Channel(quality, seed + 1)
        self._own, self._vehicle = Codec(245, 190), Codec(1)
        self._last: bytes = b""
        self._tries = 0
        self._heard_s = 0.0

    def _say(self, message, now_s: float) -> None:
        self._last = self._own.encode(message)
        self._there.put(self._last, now_s)
        self._heard_s = now_s

    def run(self, seconds: float) -> None:
        now_s = 0.0
        self._say(mavlink.MAVLink_mission_count_message(1, 1, len(self.plan)), now_s)
        while now_s < seconds and self.verdict is None and self._tries <= RETRIES:
            now_s += TICK_S
            for data in self._there.arrived(now_s):
                for message in self._vehicle.decode(data):
                    self._answer(self.storage.receive(message, now_s), now_s)
            self._answer(self.storage.tick(now_s), now_s)
            for data in self._back.arrived(now_s):
                for message in self._own.decode(data):
                    self._hear(message, now_s)
            if now_s - self._heard_s > TIMEOUT_S:
                self._tries += 1
                self._heard_s = now_s
                self._there.put(self._last, now_s)

    def _answer(self, messages, now_s: float) -> None:
        for message in messages:
            self._back.put(self._vehicle.encode(message), now_s)

    def _hear(self, message, now_s: float) -> None:
        match message.get_type():
            case "MISSION_REQUEST" | "MISSION_REQUEST_INT" if message.seq < len(self.plan):
                self._tries = 0
                self._say(self.plan[message.seq].to_message((1, 1), message.seq, MISSION, as_int=True), now_s)
            case "MISSION_ACK" if message.type != mavlink.MAV_MISSION_INVALID_SEQUENCE:
                self.verdict = message.type


lines = st.builds(
    Quality,
    loss=st.floats(0.0, 0.3),
    duplication=st.floats(0.0, 0.3),
    delay_s=st.floats(0.0, 0.1),
    jitter_s=st.floats(0.0, 0.05),
)


@settings(max_examples=60, deadline=None)
@given(lines, st.integers(1, 25), st.integers(0, 999))
def test_a_plan_that_px4_accepts_is_whole_and_one_that_it_does_not_leaves_the_old_one(quality, count, seed):
    client = Uploader(Px4Transfer(), items(count), quality, seed)
    client.run(60.0)
    stored = [(item.latitude_e7, item.longitude_e7, item.altitude_m) for item in client.storage.mission]
    sent = [(item.latitude_e7, item.longitude_e7, item.altitude_m) for item in client.plan]
    if client.verdict == mavlink.MAV_MISSION_ACCEPTED:
        assert stored == sent
    else:
        assert stored in (sent, [(1, 2, 3.0)])


@pytest.mark.parametrize("transfer", [Px4Transfer, ArduPilotTransfer], ids=["px4", "ardupilot"])
def test_on_a_good_line_every_upload_succeeds(transfer):
    chance = random.Random(0)
    for count in (1, 2, 17, 200):
        client = Uploader(transfer(), items(count), Quality(delay_s=0.02), chance.randrange(1000))
        client.run(60.0)
        assert client.verdict == mavlink.MAV_MISSION_ACCEPTED
        assert [item.altitude_m for item in client.storage.mission] == [item.altitude_m for item in client.plan]


@pytest.mark.parametrize("seed", range(10))
def test_with_a_fifth_lost_px4_still_takes_twenty_items(seed):
    client = Uploader(Px4Transfer(), items(20), Quality(loss=0.2, delay_s=0.05), seed)
    client.run(60.0)
    assert client.verdict == mavlink.MAV_MISSION_ACCEPTED


def test_an_upload_that_ardupilot_gave_up_leaves_the_first_new_items_in_the_old_plan():
    storage, codec = ArduPilotTransfer(), Codec(245, 190)
    storage.plans[MISSION] = items(3)

    def send(message, now_s: float) -> list:
        return [answer for each in codec.decode(codec.encode(message)) for answer in storage.receive(each, now_s)]

    send(mavlink.MAVLink_mission_count_message(1, 1, 3), 0.0)
    send(Item(16, 3, (0.0,) * 4, 7, 7, 99.0).to_message((1, 1), 0, MISSION, as_int=True), 0.1)
    answers = [answer for step in range(1000) for answer in storage.tick(0.1 + TICK_S * step)]
    assert answers[-1].get_type() == "MISSION_ACK"
    assert answers[-1].type == mavlink.MAV_MISSION_OPERATION_CANCELLED
    assert [item.altitude_m for item in storage.mission] == [99.0, 11.0, 12.0]


def test_of_a_waypoint_copter_keeps_the_delay_alone():
    sent = Item(mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, (3.0, 2.0, 1.0, 90.0), 1, 2, 10.0)
    assert kept(mavlink.MAV_MISSION_TYPE_MISSION, sent).params == (3.0, 0.0, 0.0, 0.0)
