"""A second ground station on the same line: what the line, the key and the record make of it."""

import pytest

from sim_bridge.ardupilot.vehicle import ArduCopter
from sim_bridge.channel import Quality
from sim_bridge.dialects import Autopilot
from sim_bridge.faults import AnyFault, LinkCut, SecondStation
from sim_bridge.faults.second_station import SYSTEM
from sim_bridge.px4.vehicle import Px4
from sim_bridge.signing import Signatures
from sim_bridge.station import Station
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import TICK_S, mavlink
from tests.sim_bridge.line_client import GROUND

KEY = bytes(range(32))
both = pytest.mark.parametrize("autopilot", Autopilot, ids=lambda one: one.name.lower())


class Evening:
    """Ten seconds with a second station."""

    def __init__(self, autopilot: Autopilot, *faults: AnyFault, key: bytes | None = None, loss: float = 0.0) -> None:
        config = VehicleConfig(GROUND, ready_after_s=1.0)
        self.vehicle = Px4(config) if autopilot is Autopilot.PX4 else ArduCopter(config)
        self.recorded: list = []
        signatures = None if key is None else Signatures(key, 10**12)
        station = Station(self.vehicle, Quality(loss=loss), 0, self._record, faults, signatures)
        heard = [
            message for step in range(1, 1001) for data in station.advance(TICK_S * step) for message in read(data)
        ]
        self.answers = [message for message in heard if getattr(message, "target_system", 0) == SYSTEM]

    def _record(self, _: float, datagram: bytes) -> None:
        self.recorded += [message for message in read(datagram) if message.get_srcSystem() == SYSTEM]


def read(datagram: bytes) -> list:
    return mavlink.MAVLink(None).parse_buffer(datagram) or []


@both
def test_what_a_second_station_says_is_recorded_as_all_that_is_heard(autopilot):
    evening = Evening(autopilot, SecondStation(begin_s=1.0))
    kinds = {message.get_type() for message in evening.recorded}
    assert kinds == {"HEARTBEAT", "MISSION_REQUEST_LIST", "MISSION_ACK", "COMMAND_LONG"}
    assert evening.answers


@both
def test_a_second_station_without_the_key_is_not_answered(autopilot):
    evening = Evening(autopilot, SecondStation(begin_s=1.0, uploads=True), key=KEY)
    assert evening.recorded
    assert evening.answers == []


@both
def test_a_second_station_with_the_key_is_answered(autopilot):
    evening = Evening(autopilot, SecondStation(begin_s=1.0, signed=True), key=KEY)
    assert {"MISSION_COUNT", "COMMAND_ACK"} <= {message.get_type() for message in evening.answers}


@both
def test_a_second_station_is_cut_off_with_the_line(autopilot):
    evening = Evening(autopilot, SecondStation(begin_s=1.0), LinkCut(begin_s=4.0))
    assert evening.answers
    assert evening.vehicle._commander.ground_station_s == pytest.approx(3.0, abs=0.1)


def test_a_second_station_loses_what_the_line_loses():
    sound, lossy = (Evening(Autopilot.PX4, SecondStation(begin_s=1.0), loss=loss) for loss in (0.0, 0.5))
    assert 0 < len(lossy.recorded) < 0.8 * len(sound.recorded)


def test_a_second_station_cannot_sign_where_there_is_no_key():
    with pytest.raises(ValueError, match="vehicle 1 has none"):
        Evening(Autopilot.PX4, SecondStation(begin_s=1.0, signed=True))
