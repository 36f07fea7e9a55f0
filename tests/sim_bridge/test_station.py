"""A vehicle behind its line: the codec against garbage, bad lines, what is news, several at once."""

import random

import pytest

from sim_bridge.channel import Channel, Quality
from sim_bridge.codec import Codec, frames, frames_in
from sim_bridge.px4.vehicle import Px4
from sim_bridge.state import GeodeticPoint
from sim_bridge.station import Station
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import POSITION_VELOCITY, mavlink

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)


def px4(system: int = 1) -> Px4:
    return Px4(VehicleConfig(GROUND, system=system, ready_after_s=1.0))


def setpoint(stamp_ms: int, north_m: float, speed_mps: float) -> bytes:
    own = mavlink.MAVLink(None, 245, 190)
    message = mavlink.MAVLink_set_position_target_local_ned_message(
        stamp_ms, 1, 1, mavlink.MAV_FRAME_LOCAL_NED, POSITION_VELOCITY, north_m, 0, -20, speed_mps, 0, 0, 0, 0, 0, 0, 0
    )
    return bytes(message.pack(own))


def heard(datagrams: list[bytes]) -> list[str]:
    return [m.get_type() for data in datagrams for m in mavlink.MAVLink(None).parse_buffer(data) or []]


def test_messages_survive_the_codec_and_carry_their_sender():
    there, here = Codec(system=7, component=1), Codec(system=245)
    message = mavlink.MAVLink_attitude_message(5, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    (got,) = here.decode(there.encode(message))
    assert (got.get_srcSystem(), got.get_srcComponent()) == (7, 1)
    assert got.yaw == pytest.approx(0.3)


def test_garbage_and_mutated_frames_are_left_out_and_what_follows_is_still_heard():
    chance = random.Random(3)
    codec, sound = Codec(1), setpoint(1, 2.0, 3.0)
    for _ in range(3000):
        data = bytearray(sound)
        for _ in range(chance.randrange(1, 4)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        codec.decode(bytes(data[: chance.randrange(1, len(data) + 1)]))
        codec.decode(chance.randbytes(chance.randrange(40)))
    for _ in range(20):
        last = codec.decode(sound)
    assert last[-1].get_type() == "SET_POSITION_TARGET_LOCAL_NED"


def test_frames_are_found_without_decoding():
    both = setpoint(1, 2.0, 3.0) + setpoint(2, 2.5, 3.0)
    found = list(frames_in(both))
    assert [message_id for message_id, _ in found] == [mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED] * 2
    assert list(frames_in(b"\xfd\x05")) == []
    assert list(frames_in(b"junk that is long enough")) == []
    assert list(frames_in(b"junk\xfd\xff\x00" + both + b"\xfd\xff\x00")) == found


def first_version(message) -> bytes:
    return bytes(message.pack(mavlink.MAVLink(None, 245, 190), force_mavlink1=True))


def test_the_first_version_of_mavlink_is_heard_recorded_and_news_as_the_second():
    kept: list[bytes] = []
    station = Station(px4(), record=lambda _, datagram: kept.extend(frames(datagram)))
    old, new = Codec(1).decode(setpoint(100, 1.0, 4.0)), setpoint(100, 1.0, 4.0)
    told = [first_version(message) for message in (*old, mavlink.MAVLink_ping_message(5, 7, 0, 0))]
    assert {frame[0] for frame in told} == {0xFE}
    assert station.put(told[0], now_s=1.0)
    assert not station.put(told[0], now_s=1.1)
    assert [number for number, _ in frames_in(told[0])] == [number for number, _ in frames_in(new)]
    station.put(told[1], now_s=1.1)
    assert "PING" in heard(station.advance(1.2))
    assert [frame for frame in kept if frame[0] == 0xFE] == [told[0], told[0], told[1]]


def test_a_datagram_that_is_cut_off_takes_nothing_from_the_next():
    station, own = Station(px4()), Codec(245, 190)
    station.put(b"\xfd\xff\x00", 0.0)
    for number in range(20):
        station.put(own.encode(mavlink.MAVLink_ping_message(1, number, 0, 0)), 0.01)
    assert heard(station.advance(0.02)).count("PING") == 20


def test_a_repeated_setpoint_is_no_news_so_that_lock_step_waits_for_the_program_behind_it():
    station = Station(px4())
    assert station.put(setpoint(100, 1.0, 4.0), now_s=1.0)
    assert not station.put(setpoint(150, 1.0, 4.0), now_s=1.1)
    assert station.news_s == 1.0
    assert station.put(setpoint(150, 1.2, 4.0), now_s=1.2)
    assert station.news_s == 1.2


def test_a_setpoint_that_stands_still_is_always_news():
    station = Station(px4())
    # Frames are turned by changing signs, so that no speed may well be −0.
    for at_s, nought in ((1.0, 0.0), (2.0, 0.0), (3.0, -0.0), (4.0, -0.0)):
        assert station.put(setpoint(100, 1.0, nought), at_s)
    assert station.news_s == 4.0


def test_everything_heard_and_sent_is_recorded():
    kept: list[tuple[float, bytes]] = []
    station = Station(px4(), record=lambda at_s, datagram: kept.append((at_s, datagram)))
    sent = setpoint(100, 1.0, 4.0)
    station.put(sent, 0.005)
    told = [data for tick in range(1, 201) for data in station.advance(0.01 * tick)]
    assert sent in [datagram for _, datagram in kept]
    assert [datagram for _, datagram in kept if datagram != sent] == told
    assert heard(told).count("HEARTBEAT") in (2, 3)


def test_two_vehicles_answer_only_to_their_own_ids():
    first, second = Station(px4(1)), Station(px4(2))
    own = mavlink.MAVLink(None, 245, 190)
    ask = bytes(mavlink.MAVLink_param_request_read_message(2, 1, b"GF_ACTION", -1).pack(own))
    for station, answers in ((first, 0), (second, 1)):
        station.put(ask, 0.0)
        assert heard(station.advance(0.01)).count("PARAM_VALUE") == answers


@pytest.mark.parametrize("share", [0.0, 0.2, 1.0])
def test_a_line_loses_its_share(share):
    channel = Channel(Quality(loss=share), seed=1)
    for index in range(5000):
        channel.put(index.to_bytes(2, "big"), 0.0)
    assert 1.0 - len(channel.arrived(0.0)) / 5000 == pytest.approx(share, abs=0.02)


def test_a_line_without_faults_delivers_all_at_once_and_in_order():
    channel = Channel(Quality())
    data = [bytes([index]) for index in range(50)]
    for one in data:
        channel.put(one, 1.0)
    assert channel.arrived(1.0) == data
    assert channel.arrived(2.0) == []


def test_delay_and_jitter_hold_back_and_reorder_and_duplicates_come_twice():
    channel = Channel(Quality(duplication=0.3, delay_s=0.2, jitter_s=0.1), seed=2)
    data = [index.to_bytes(2, "big") for index in range(1000)]
    for index, one in enumerate(data):
        channel.put(one, 0.001 * index)
    assert channel.arrived(0.099) == []
    arrived = channel.arrived(10.0)
    assert set(arrived) == set(data)
    assert len(arrived) == pytest.approx(1300, abs=60)
    assert arrived != sorted(arrived)


@pytest.mark.parametrize("faults", [{"loss": 1.5}, {"duplication": -0.1}, {"delay_s": -1.0}, {"jitter_s": -0.1}])
def test_a_line_that_cannot_be_is_refused(faults):
    with pytest.raises(ValueError, match="got"):
        Quality(**faults)


def test_lock_step_grants_a_late_line_the_time_it_needs():
    late = Station(px4(), Quality(delay_s=0.2, jitter_s=0.1))
    assert late.round_trip_s == pytest.approx(0.6)
    assert Station(px4()).round_trip_s == 0.0
