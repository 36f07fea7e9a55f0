"""The parts of the link that need no vehicle: addresses, the guard, telemetry."""

import math
import os
import random

import pytest

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.dialects import Autopilot, flight_mode
from sim_bridge.frames import VehicleFrame
from sim_bridge.link.address import Serial, Tcp, UdpListen, UdpSend, parse_address
from sim_bridge.link.guard import Guard
from sim_bridge.link.telemetry import READY_BIT, Telemetry
from sim_bridge.signing import read_key
from sim_bridge.state import (
    GRAVITY_MPS2,
    FlightMode,
    GeodeticPoint,
    LandedState,
    MissionProgress,
    StatusText,
    VehicleState,
    Waiting,
)

ORIGIN = GeodeticPoint(47.3977, 8.5456, 488.0)
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


def heartbeat(custom_mode: int = 4 << 16 | 3 << 24, armed: bool = False, status: int = 3, autopilot: int = 12):
    base = 1 | (128 if armed else 0)
    return mavlink.MAVLink_heartbeat_message(2, autopilot, base, custom_mode, status, 3)


def position(time_ms: int, x: float = 0.0, y: float = 0.0, z: float = 0.0):
    return mavlink.MAVLink_local_position_ned_message(time_ms, x, y, z, 1.0, 2.0, 3.0)


def complete(telemetry: Telemetry) -> None:
    for message in (
        heartbeat(),
        mavlink.MAVLink_gps_global_origin_message(473977000, 85456000, 488000),
        mavlink.MAVLink_home_position_message(473977000, 85456000, 489500, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0),
        mavlink.MAVLink_attitude_message(900, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0),
        mavlink.MAVLink_sys_status_message(READY_BIT, READY_BIT, READY_BIT, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_extended_sys_state_message(0, 2),
        position(1000),
    ):
        telemetry.receive(message)


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


def test_nothing_is_told_before_everything_is_known_and_what_is_missing_is_named():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    (waiting,) = telemetry.receive(heartbeat())
    assert isinstance(waiting, Waiting)
    assert "its local position estimate" in waiting.waiting_for
    complete(telemetry)
    (state,) = telemetry.receive(position(1033, 3.0, 4.0, -5.0))
    assert isinstance(state, VehicleState)
    assert state.ready
    assert state.time_s == pytest.approx(1.033)
    assert state.position_enu_m == pytest.approx((4.0, 3.0, 5.0), abs=0.02)
    assert state.velocity_enu_mps == (2.0, 1.0, -3.0)
    assert state.yaw_enu_rad == pytest.approx(1.5707963 - 0.5)
    assert state.battery_fraction == 0.77
    assert state.landed is LandedState.IN_AIR
    assert state.home_enu_m == pytest.approx((0.0, 0.0, 1.5), abs=1e-3)


def test_failing_pre_arm_checks_are_named_by_their_sensors():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    gps = mavlink.MAV_SYS_STATUS_SENSOR_GPS
    everything = READY_BIT | gps
    telemetry.receive(mavlink.MAVLink_sys_status_message(everything, everything, 0, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0))
    assert telemetry.waiting_for() == ("its pre-arm checks (GPS)",)


def status(present: int, health: int):
    return mavlink.MAVLink_sys_status_message(present, present, health, 0, 16000, 0, 77, 0, 0, 0, 0, 0, 0)


def test_px4_does_not_say_that_it_has_pre_arm_checks_and_is_waited_for_all_the_same():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(status(0, 0))
    assert telemetry.waiting_for() == ("its pre-arm checks",)
    telemetry.receive(status(0, READY_BIT))
    assert telemetry.waiting_for() == ()


def test_px4_that_stands_in_offboard_passes_no_checks_there_and_is_not_waited_for():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(status(0, 0))
    telemetry.receive(heartbeat(custom_mode=6 << 16))
    assert telemetry.waiting_for() == ()
    telemetry.receive(heartbeat(custom_mode=3 << 16))
    assert telemetry.waiting_for() == ("its pre-arm checks (in a mode that needs a transmitter)",)


def test_whether_it_stands_or_flies_is_waited_for():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(mavlink.MAVLink_extended_sys_state_message(0, 0))
    assert telemetry.waiting_for() == ("whether it stands or flies",)


def test_positions_that_come_late_or_twice_are_dropped():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    assert len(telemetry.receive(position(1100))) == 1
    assert telemetry.receive(position(1100)) == []
    assert telemetry.receive(position(1066)) == []


def test_positions_that_are_no_numbers_are_dropped():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    assert telemetry.receive(position(1100, float("nan"))) == []


def test_a_clock_that_starts_anew_is_a_reboot():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(position(60_000))
    telemetry.receive(position(100))
    assert telemetry.reboots == 1
    assert not telemetry.complete


def test_a_restarted_autopilot_is_told():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(position(60_000))
    assert [event.text for event in telemetry.receive(position(100)) if isinstance(event, StatusText)] == [
        "the autopilot was restarted"
    ]
    assert telemetry.receive(position(133)) == []


def test_positions_without_heartbeats_are_warned_of_once():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(heartbeat())
    heard = [event for moment in range(1100, 9000, 100) for event in telemetry.receive(position(moment))]
    assert [event.text for event in heard if isinstance(event, StatusText)] == [
        "no heartbeat for 4 s: which mode it is in is not known"
    ]


def test_what_a_lost_link_took_of_positions_and_heartbeats_alike_is_no_missing_heartbeat():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(heartbeat())
    assert not any(isinstance(event, StatusText) for event in telemetry.receive(position(40_000)))


def test_without_positions_the_heartbeat_still_tells_the_mode():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(mavlink.MAVLink_attitude_message(5000, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0))
    (state,) = telemetry.receive(heartbeat(custom_mode=4 << 16 | 6 << 24))
    assert isinstance(state, VehicleState)
    assert state.mode is FlightMode.LAND
    assert state.position_age_s == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("roll_deg", "pitch_deg", "yaw_deg", "east", "north"),
    [
        # Nose down and to the right, seen from a vehicle that looks north, east and south-west.
        (0.0, -45.0, 0.0, 0.0, 1.0),
        (45.0, 0.0, 0.0, 1.0, 0.0),
        (0.0, -45.0, 90.0, 1.0, 0.0),
        (45.0, 0.0, 90.0, 0.0, -1.0),
        (0.0, -45.0, 225.0, -math.sqrt(0.5), -math.sqrt(0.5)),
        (45.0, -45.0, 0.0, math.sqrt(2.0), 1.0),
    ],
)
def test_the_tilt_is_told_as_what_it_accelerates(roll_deg, pitch_deg, yaw_deg, east, north):
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    roll, pitch, yaw = map(math.radians, (roll_deg, pitch_deg, yaw_deg))
    telemetry.receive(mavlink.MAVLink_attitude_message(1000, roll, pitch, yaw, 0.0, 0.0, 0.0))
    (state,) = telemetry.receive(position(1200))
    assert isinstance(state, VehicleState)
    assert state.tilt_enu_mps2 == pytest.approx((GRAVITY_MPS2 * east, GRAVITY_MPS2 * north))


@pytest.mark.parametrize("roll", [math.nan, math.radians(85.0), math.radians(180.0)])
def test_what_does_not_carry_the_weight_is_no_tilt(roll):
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(mavlink.MAVLink_attitude_message(1000, roll, 0.0, 0.5, 0.0, 0.0, 0.0))
    (state,) = telemetry.receive(position(1200))
    assert isinstance(state, VehicleState)
    assert state.tilt_enu_mps2 is None


def test_a_failsafe_is_the_heartbeats_status():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(heartbeat(armed=True, status=mavlink.MAV_STATE_CRITICAL))
    (state,) = telemetry.receive(position(1200))
    assert isinstance(state, VehicleState)
    assert state.failsafe
    assert state.armed


def test_repeated_reports_of_a_reached_item_are_told_once():
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    reached = mavlink.MAVLink_mission_item_reached_message(3)
    assert telemetry.receive(reached) == [MissionProgress(3, 0)]
    assert telemetry.receive(reached) == []


@pytest.mark.parametrize(
    ("autopilot", "custom_mode", "mode"),
    [
        (Autopilot.PX4, 6 << 16, FlightMode.EXTERNAL),
        (Autopilot.PX4, 3 << 16, FlightMode.PILOT),
        (Autopilot.PX4, 4 << 16 | 2 << 24, FlightMode.TAKEOFF),
        (Autopilot.PX4, 4 << 16 | 3 << 24, FlightMode.HOLD),
        (Autopilot.PX4, 4 << 16 | 4 << 24, FlightMode.MISSION),
        (Autopilot.PX4, 4 << 16 | 5 << 24, FlightMode.RETURN),
        (Autopilot.PX4, 4 << 16 | 6 << 24, FlightMode.LAND),
        (Autopilot.PX4, 99 << 16, FlightMode.OTHER),
        (Autopilot.ARDUPILOT, 0, FlightMode.PILOT),
        (Autopilot.ARDUPILOT, 3, FlightMode.MISSION),
        (Autopilot.ARDUPILOT, 4, FlightMode.EXTERNAL),
        (Autopilot.ARDUPILOT, 5, FlightMode.PILOT),
        (Autopilot.ARDUPILOT, 6, FlightMode.RETURN),
        (Autopilot.ARDUPILOT, 9, FlightMode.LAND),
        (Autopilot.ARDUPILOT, 99, FlightMode.OTHER),
    ],
)
def test_modes_mean_the_same_on_both_autopilots(autopilot, custom_mode, mode):
    assert flight_mode(autopilot, custom_mode)[0] is mode
