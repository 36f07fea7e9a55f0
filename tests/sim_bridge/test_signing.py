"""Signatures against pymavlink's own, and a vehicle that hears only what is signed."""

import os

import pytest

from sim_bridge.link.client import Link, LinkError
from sim_bridge.px4.vehicle import Px4
from sim_bridge.signing import SIGNATURE_BYTES, Signatures, time_10us
from sim_bridge.simulator import spawn
from sim_bridge.state import GeodeticPoint
from sim_bridge.station import Station
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import TICK_S, mavlink

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
KEY = bytes(range(32))
NOW_10US = time_10us(1.8e9)


def packed(message, key: bytes | None = None, moment_10us: int = NOW_10US) -> bytes:
    """By pymavlink, signed where there is a key."""
    sender = mavlink.MAVLink(None, 245, 190)
    if key is not None:
        sender.signing.secret_key, sender.signing.sign_outgoing, sender.signing.timestamp = key, True, moment_10us
    return bytes(message.pack(sender))


def ping(number: int = 1):
    return mavlink.MAVLink_ping_message(5, number, 0, 0)


def pongs(vehicle: Station, data: bytes, now_s: float) -> list:
    """What a vehicle answers to a ping."""
    vehicle.put(data, now_s)
    reader = mavlink.MAVLink(None)
    heard = [m for d in vehicle.advance(now_s) for m in reader.parse_buffer(d) or ()]
    return [message for message in heard if message.get_type() == "PING"]


def vehicle(key: bytes | None) -> Station:
    signatures = None if key is None else Signatures(key, NOW_10US)
    return Station(Px4(VehicleConfig(GROUND)), signatures=signatures)


def test_a_signature_is_byte_for_byte_pymavlinks():
    assert Signatures(KEY, NOW_10US - 1).sign(packed(ping())) == packed(ping(), KEY)


@pytest.mark.parametrize("flip", range(1, SIGNATURE_BYTES))
def test_a_signature_with_any_bit_changed_is_not_accepted(flip):
    frame = bytearray(packed(ping(), KEY))
    assert Signatures(KEY, NOW_10US).fault(bytes(frame)) == ""
    frame[-flip] ^= 1
    assert Signatures(KEY, NOW_10US).fault(bytes(frame)) != ""


def test_a_computer_whose_clock_was_never_set_is_told_to_set_it():
    with pytest.raises(ValueError, match="clock says a year before 2015"):
        Signatures(KEY, time_10us(0.0))


def test_a_clock_that_is_years_behind_catches_up_with_what_it_hears():
    ours, theirs = Signatures(KEY, time_10us(1.5e9)), Signatures(KEY, NOW_10US)
    assert ours.fault(theirs.sign(packed(ping()))) == ""
    assert theirs.fault(ours.sign(packed(ping()))) == ""


def test_a_clock_that_jumps_changes_nothing_once_signing_has_begun(monkeypatch):
    ours, theirs = Signatures(KEY, NOW_10US), Signatures(KEY, NOW_10US)
    for moment_s in (1.9e9, 0.0, -1e9):
        monkeypatch.setattr("time.time", lambda moment_s=moment_s: moment_s)
        assert theirs.fault(ours.sign(packed(ping()))) == ""


def test_an_unknown_message_does_not_leave_unsigned():
    frame = bytearray(packed(ping()))
    frame[7:10] = (999_999).to_bytes(3, "little")
    assert Signatures(KEY, NOW_10US).sign(bytes(frame)) == b""


def test_a_vehicle_with_a_key_answers_what_is_signed_and_nothing_else():
    station = vehicle(KEY)
    assert pongs(station, packed(ping()), TICK_S) == []
    assert pongs(station, packed(ping(), KEY[::-1]), 2 * TICK_S) == []
    signed = packed(ping(7), KEY)
    (pong,) = pongs(station, signed, 3 * TICK_S)
    assert pong.seq == 7
    # Neither a repetition nor an old recording.
    assert pongs(station, signed, 4 * TICK_S) == []
    assert pongs(station, packed(ping(8), KEY, NOW_10US - 10**8), 5 * TICK_S) == []


def test_all_that_a_vehicle_with_a_key_says_is_signed_with_rising_times():
    station, theirs = vehicle(KEY), Signatures(KEY, NOW_10US)
    frames = [data for step in range(200) for data in station.advance(TICK_S * step)]
    assert len(frames) > 50
    assert all(theirs.fault(frame) == "" for frame in frames)


def test_times_of_signatures_rise_for_each_system_component_and_link():
    def signed(system: int, component: int, link: int, moment_10us: int) -> bytes:
        sender = mavlink.MAVLink(None, system, component)
        sender.signing.secret_key, sender.signing.sign_outgoing = KEY, True
        sender.signing.link_id, sender.signing.timestamp = link, moment_10us
        return bytes(ping().pack(sender))

    receiver = Signatures(KEY, NOW_10US)
    for stream in ((1, 1, 0), (1, 1, 7), (1, 190, 0), (2, 1, 0)):
        assert receiver.fault(signed(*stream, NOW_10US + 1000)) == ""
        for old_10us in (NOW_10US + 1000, NOW_10US + 999):
            assert "signed before" in receiver.fault(signed(*stream, old_10us))
        assert receiver.fault(signed(*stream, NOW_10US + 1001)) == ""


def test_a_vehicle_without_a_key_hears_signed_messages_too():
    assert len(pongs(vehicle(None), packed(ping(), KEY), TICK_S)) == 1


def test_the_link_and_the_vehicle_understand_each_other_with_the_same_key_only(tmp_path):
    right, wrong = tmp_path / "right", tmp_path / "wrong"
    for path, key in ((right, KEY), (wrong, os.urandom(32))):
        path.write_bytes(key)
        path.chmod(0o600)
    spawned = spawn(GROUND, speed=5.0, arguments=["--key-file", str(right)])
    try:
        with pytest.raises(LinkError, match="signed with another key"):
            Link.connect(spawned.address, GROUND, key_file=wrong, timeout_s=1.5)
        link = Link.connect(spawned.address, GROUND, key_file=right, timeout_s=10.0)
        assert link.parameter("MPC_XY_VEL_MAX") == pytest.approx(12.0)
        link.close()
    finally:
        spawned.stop()
