"""Our uploads where another station is in the way, or where the vehicle holds the same plan already."""

import socket

import pytest
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError, MissionRawResult

from sim_bridge.dialects import Autopilot
from sim_bridge.link import mission
from sim_bridge.link.client import LinkError
from sim_bridge.link.mission import upload_fence
from tests.sim_bridge.ground_station import mavlink
from tests.sim_bridge.test_link import flying, square


def test_a_fence_that_does_not_hold_home_is_refused_also_when_the_vehicle_holds_it_already():
    with flying(speed=2.0) as client:
        client.state(lambda state: state.home_enu_m is not None)
        for _ in range(2):
            with pytest.raises(LinkError, match="says that it does not hold"):
                upload_fence(client.link, square(20.0, east_m=300.0))


class FakeLink:
    def __init__(self, autopilot: Autopilot) -> None:
        self.autopilot = autopilot

    def last_words(self) -> str:
        return "WPM: REJ. CMD: Busy"


def tried(monkeypatch, autopilot: Autopilot, result: MissionRawResult, failures: int) -> list[float]:
    """The silences of an upload that fails so often."""
    silences: list[float] = []
    left = [None] * failures
    monkeypatch.setattr(mission.time, "sleep", silences.append)

    def send(_) -> None:
        if left:
            left.pop()
            raise MissionRawError(result, "upload_mission()")

    mission._round_trip(FakeLink(autopilot), "mission", [], send, list, mission._TRIES)
    return silences


def test_px4_is_left_in_silence_for_more_than_five_seconds_before_each_new_try(monkeypatch):
    silences = tried(monkeypatch, Autopilot.PX4, MissionRawResult.ERROR, failures=4)
    assert len(silences) == 4
    assert min(silences) > 5.0


def test_ardupilot_is_left_in_silence_for_more_than_eight_seconds_while_another_uploads(monkeypatch):
    (silence,) = tried(monkeypatch, Autopilot.ARDUPILOT, MissionRawResult.DENIED, failures=1)
    assert silence > 8.0


def test_who_is_held_up_for_good_is_told_what_may_be_in_the_way(monkeypatch):
    with pytest.raises(LinkError, match=r'error \("WPM: REJ. CMD: Busy"\), 5 times; another ground station'):
        tried(monkeypatch, Autopilot.PX4, MissionRawResult.ERROR, failures=99)


def test_what_no_further_try_can_change_is_not_tried_again(monkeypatch):
    silences: list[float] = []
    with pytest.raises(LinkError, match="too many mission items"):
        silences += tried(monkeypatch, Autopilot.PX4, MissionRawResult.TOO_MANY_MISSION_ITEMS, failures=1)
    assert silences == []


def test_an_upload_that_another_station_began_and_left_is_waited_for():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        other.settimeout(10.0)
        with flying(arguments=("--ground-station", str(other.getsockname()[1])), speed=1.0) as client:
            client.state(lambda state: state.home_enu_m is not None)
            _, vehicle = other.recvfrom(65536)
            codec = mavlink.MAVLink(None, 255, 190)
            first = mavlink.MAVLink_mission_item_int_message(
                1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 473977000, 85456000, 20, 0
            )
            for message in (mavlink.MAVLink_mission_count_message(1, 1, 3, 0), first):
                other.sendto(bytes(message.pack(codec)), vehicle)
            upload_fence(client.link, square(100.0))
            assert len(MissionRaw(client.link.system).download_geofence()) == 4
