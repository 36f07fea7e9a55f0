"""The parts of the link that need no vehicle: addresses, and the guard of what comes in and goes out."""

import os
import random

import pytest

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.frames import VehicleFrame
from sim_bridge.link.address import Serial, Tcp, UdpListen, UdpSend, parse_address
from sim_bridge.link.guard import Guard
from sim_bridge.link.telemetry import Telemetry
from sim_bridge.signing import read_key
from tests.sim_bridge.vehicle_messages import ORIGIN, heartbeat, position

KEY = bytes(range(32))


class Sender:
    """Packs messages as a vehicle would."""

    def __init__(self, system: int = 1, component: int = 1, key: bytes | None = None) -> None:
        self.mav = mavlink.MAVLink(None, system, component)
        if key is not None:
            self.mav.signing.secret_key = key
            self.mav.signing.sign_outgoing = True
            self.mav.signing.timestamp = 1000

    def pack(self, message) -> bytes:
        frame = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return bytes(frame)


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("udp://:14540", UdpListen("127.0.0.1", 14540)),
        ("udp://0.0.0.0:14541", UdpListen("0.0.0.0", 14541)),
        ("udpin://127.0.0.1", UdpListen("127.0.0.1", 14540)),
        ("udpout://192.168.1.10:14550", UdpSend("192.168.1.10", 14550)),
        ("tcp://localhost:5760", Tcp("localhost", 5760)),
        ("serial:///dev/ttyUSB0:57600", Serial("/dev/ttyUSB0", 57600)),
        ("serial:///dev/ttyACM0", Serial("/dev/ttyACM0", 57600)),
    ],
)
def test_addresses_are_read(text, address):
    assert parse_address(text) == address


@pytest.mark.parametrize(
    "text", ["", "udp", "http://x", "udpout://", "tcp://", "udp://h:99999", "serial://", "serial:///dev/x:7"]
)
def test_what_is_no_address_is_refused_with_examples(text):
    with pytest.raises(ValueError, match="udp://:14540"):
        parse_address(text)


def test_only_the_vehicle_and_its_autopilot_are_heard():
    guard = Guard(245, 190, 1)
    mine, other_system, other_component = Sender(), Sender(system=7), Sender(component=100)
    data = mine.pack(heartbeat()) + other_system.pack(heartbeat()) + other_component.pack(heartbeat())
    assert len(list(guard.accept(data))) == 1
    assert guard.refused == {"from another system": 1, "from another component": 1}


def test_what_is_accepted_is_passed_on_byte_by_byte():
    frame = Sender().pack(heartbeat())
    accepted = list(Guard(245, 190, 1).accept(frame))
    assert accepted[0].frame == frame


def test_with_a_key_unsigned_wrongly_signed_and_repeated_messages_are_refused():
    guard = Guard(245, 190, 1, KEY)
    signed = Sender(key=KEY).pack(heartbeat())
    assert list(guard.accept(Sender().pack(heartbeat()))) == []
    assert list(guard.accept(Sender(key=KEY[::-1]).pack(heartbeat()))) == []
    assert len(list(guard.accept(signed))) == 1
    assert list(guard.accept(signed)) == []
    assert sum(guard.refused.values()) == 3


def test_a_forgery_with_a_late_time_does_not_lock_the_vehicle_out():
    guard, vehicle, forger = Guard(245, 190, 1, KEY), Sender(key=KEY), Sender(key=KEY[::-1])
    forger.mav.signing.timestamp = 10**12
    assert list(guard.accept(forger.pack(heartbeat()))) == []
    assert len(list(guard.accept(vehicle.pack(heartbeat())))) == 1


def test_a_recording_from_long_ago_is_refused_on_any_link_id():
    guard = Guard(245, 190, 1, KEY, signing_time_10us=10**9)
    assert list(guard.accept(Sender(key=KEY).pack(heartbeat()))) == []
    assert list(guard.refused) == ["signed before: repeated, or from a clock far behind"]


def test_what_leaves_is_signed_so_that_the_other_end_accepts_it():
    ours, theirs = Guard(245, 190, 1, KEY, signing_time_10us=5000), mavlink.MAVLink(None, 1, 1)
    theirs.signing.secret_key = KEY
    plain = Sender(245, 190)
    for _ in range(3):
        frame = plain.pack(heartbeat())
        sealed = ours.seal(frame)
        assert len(sealed) == len(frame) + 13
        message = theirs.parse_buffer(sealed)[0]
        assert message.get_type() == "HEARTBEAT"
        assert (message.get_srcSystem(), message.get_srcComponent()) == (245, 190)


def test_without_a_key_what_leaves_is_unchanged():
    frame = Sender(245, 190).pack(heartbeat())
    assert Guard(245, 190, 1).seal(frame) is frame


@pytest.mark.parametrize("content", [KEY, KEY.hex().encode(), KEY.hex().encode() + b"\n"])
def test_a_key_is_read_from_a_private_file(tmp_path, content):
    path = tmp_path / "key"
    path.write_bytes(content)
    path.chmod(0o600)
    assert read_key(path) == KEY


def test_a_key_that_others_can_read_is_refused(tmp_path):
    path = tmp_path / "key"
    path.write_bytes(KEY)
    path.chmod(0o644)
    with pytest.raises(ValueError, match="chmod 600"):
        read_key(path)


def test_a_key_of_another_size_is_refused_without_telling_it(tmp_path):
    path = tmp_path / "key"
    path.write_text("secret!")
    path.chmod(0o600)
    with pytest.raises(ValueError, match="32 bytes") as caught:
        read_key(path)
    assert "secret!" not in str(caught.value)


@pytest.mark.parametrize(("datagrams", "lost"), [(True, 0), (False, 20)], ids=["datagrams", "a stream"])
def test_damaged_and_foreign_bytes_never_raise_and_leave_nothing_behind(datagrams, lost):
    random.seed(1)
    guard = Guard(245, 190, 1, datagrams=datagrams)
    telemetry, sender = Telemetry(VehicleFrame(ORIGIN)), Sender()
    good = [
        sender.pack(message)
        for message in (
            heartbeat(),
            position(1),
            mavlink.MAVLink_statustext_message(4, b"text \xff\xfe", 7, 1),
            mavlink.MAVLink_extended_sys_state_message(0, 200),
        )
    ]
    for _ in range(20_000):
        frame = bytearray(random.choice(good))
        for _ in range(random.randrange(4)):
            frame[random.randrange(len(frame))] = random.randrange(256)
        for accepted in guard.accept(bytes(frame[: random.randrange(1, len(frame) + 1)])):
            telemetry.receive(accepted.message)
    # In a stream the announced rest of a damaged frame is waited for, and what comes meanwhile is lost.
    heard = [len(list(guard.accept(good[0]))) for _ in range(lost + 1)]
    assert heard[-1] >= 1


def test_a_datagram_that_is_cut_off_takes_nothing_from_the_next():
    guard, sender = Guard(245, 190, 1), Sender()
    assert list(guard.accept(b"\xfd\xff\x00")) == []
    for _ in range(20):
        assert len(list(guard.accept(sender.pack(heartbeat())))) == 1
    assert guard.refused == {"not MAVLink, or damaged": 1}


def test_what_a_stream_cuts_is_put_together():
    guard, frame = Guard(245, 190, 1, datagrams=False), Sender().pack(heartbeat())
    assert list(guard.accept(frame[:5])) == []
    assert [accepted.frame for accepted in guard.accept(frame[5:] + frame)] == [frame, frame]
