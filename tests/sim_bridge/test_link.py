"""The flight client against the built-in vehicle, over real sockets."""

import contextlib
import socket
import time

import pytest

from sim_bridge.dialects import Autopilot
from sim_bridge.link.client import Link, LinkError
from sim_bridge.link.mission import Item, upload_fence, upload_mission, upload_rally_points
from sim_bridge.signing import SIGNATURE_BYTES
from sim_bridge.simulator import spawn
from sim_bridge.state import (
    Command,
    CommandDone,
    FlightMode,
    GeodeticPoint,
    LandedState,
    Setpoint,
    StatusText,
    VehicleState,
)

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
# The mission's origin is not where the vehicle stands, nor at its height.
ORIGIN = GeodeticPoint(47.3970, 8.5450, 480.0)


class Client:
    """A link whose events are kept."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.seen: list = []

    def wait(self, wanted, seconds=20.0):
        """The first event that is wanted, among those not looked at yet."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            for timed in self.link.events(0.05):
                self.seen.append(timed.event)
                if wanted(timed.event):
                    return timed.event
        raise AssertionError(f"not seen within {seconds} s; the last were {self.seen[-5:]}")

    def state(self, wanted=lambda state: True) -> VehicleState:
        return self.wait(lambda event: isinstance(event, VehicleState) and wanted(event))

    def do(self, command: Command, altitude_m: float | None = None) -> CommandDone:
        self.link.request(command, altitude_m)
        return self.wait(lambda event: isinstance(event, CommandDone) and event.command is command)


@contextlib.contextmanager
def flying(autopilot=Autopilot.PX4, *, ready_after_s=2.0, arguments=(), parameters=(), key_file=None, speed=10.0):
    if key_file is not None:
        arguments = (*arguments, "--key-file", str(key_file))
    vehicle = spawn(
        GROUND,
        speed=speed,
        autopilot=autopilot,
        ready_after_s=ready_after_s,
        wander_m=0.0,
        arguments=arguments,
        parameters=parameters,
    )
    try:
        link = Link.connect(vehicle.address, ORIGIN, key_file=key_file)
        try:
            yield Client(link)
        finally:
            link.close()
    finally:
        vehicle.stop()


def hover(state: VehicleState) -> Setpoint:
    east, north, up = state.position_enu_m
    return Setpoint.hold((east + 4.0, north - 3.0, up), 1.0)


@pytest.mark.parametrize("autopilot", Autopilot)
def test_a_vehicle_is_armed_flown_by_setpoints_and_landed(autopilot):
    with flying(autopilot) as client:
        start = client.state(lambda state: state.ready and state.home_enu_m is not None)
        # Where it stands, seen from the mission's origin.
        assert start.position_enu_m[1] == pytest.approx(77.8, abs=1.0)
        assert start.position_enu_m[2] == pytest.approx(8.0, abs=0.5)
        assert client.do(Command.ARM).accepted
        assert client.do(Command.TAKE_OFF, 12.0).accepted
        up = start.position_enu_m[2] + 11.5
        state = client.state(lambda state: state.position_enu_m[2] > up)
        target = hover(state)
        client.link.open_stream()
        for _ in range(60):
            client.link.stream(target)
            time.sleep(0.005)
        assert client.do(Command.FOLLOW_SETPOINTS).accepted
        until = time.monotonic() + 10.0
        arrived = None
        while arrived is None:
            assert time.monotonic() < until
            client.link.stream(target)
            for timed in client.link.events(0.005):
                event = timed.event
                if isinstance(event, VehicleState) and event.mode is FlightMode.EXTERNAL:
                    offsets = [abs(a - b) for a, b in zip(event.position_enu_m, target.position_enu_m, strict=True)]
                    arrived = event if max(offsets) < 0.3 else arrived
        assert client.link.setpoint_gaps_s()
        assert client.do(Command.LAND).accepted
        client.link.close_stream()
        client.state(lambda state: not state.armed and state.landed is LandedState.ON_GROUND)


def test_a_px4_that_stands_in_offboard_after_a_flight_is_armed_for_the_next():
    with flying() as client:
        state = client.state(lambda state: state.ready)
        client.link.open_stream()
        client.link.stream(hover(state))
        time.sleep(0.2)
        assert client.do(Command.FOLLOW_SETPOINTS).accepted
        client.link.close_stream()
        client.state(lambda state: state.mode is FlightMode.EXTERNAL and not state.armed)
        time.sleep(0.5)
        assert client.do(Command.ARM).accepted
        client.state(lambda state: state.armed and state.mode is FlightMode.HOLD)


def test_arming_that_is_refused_says_why_in_the_vehicles_own_words():
    with flying(ready_after_s=500.0) as client:
        state = client.state()
        assert not state.ready
        assert any("pre-arm" in what for what in state.waiting_for)
        refused = client.do(Command.ARM)
        assert not refused.accepted
        said = client.wait(lambda event: isinstance(event, StatusText)) if '"' not in refused.reason else None
        assert "rejected" in refused.reason or "denied" in refused.reason
        assert said is not None or '("' in refused.reason


def test_after_the_stream_is_closed_not_one_setpoint_leaves():
    with flying() as client:
        state = client.state(lambda state: state.ready)
        sent = []
        send = client.link._wire.send
        client.link._wire.send = lambda frame: (sent.append(frame), send(frame))
        client.link.open_stream()
        client.link.stream(hover(state))
        time.sleep(0.3)
        # mavsdk repeats the last one by itself.
        assert len([frame for frame in sent if frame[7:10] == b"\x54\x00\x00"]) >= 4
        client.link.close_stream()
        sent.clear()
        time.sleep(0.3)
        assert not [frame for frame in sent if frame[7:10] == b"\x54\x00\x00"]


def test_parameters_are_read_and_written_and_unknown_ones_are_none():
    with flying() as client:
        client.state()
        assert client.link.parameter("MPC_XY_VEL_MAX") == pytest.approx(12.0)
        assert client.link.parameter("COM_OBL_RC_ACT") == 0.0
        client.link.set_parameter("COM_OBL_RC_ACT", 5)
        assert client.link.parameter("COM_OBL_RC_ACT") == 5.0
        assert client.link.parameter("NO_SUCH_THING") is None


def square(half_m: float, east_m: float = 0.0) -> list[GeodeticPoint]:
    from sim_bridge.frames import geodetic_from_enu

    corners = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)]
    return [geodetic_from_enu((east + east_m, north, 0.0), GROUND) for east, north in corners]


@pytest.mark.parametrize("autopilot", Autopilot)
def test_a_mission_a_fence_and_rally_points_are_uploaded_and_read_back(autopilot):
    with flying(autopilot, speed=2.0) as client:
        client.state(lambda state: state.home_enu_m is not None)
        upload_fence(client.link, square(100.0), [square(5.0, 50.0)])
        upload_rally_points(client.link, [GeodeticPoint(47.3978, 8.5457, 500.0)])
        places = [Item(16, (0.0, 1.0, 0.0, None), GeodeticPoint(47.3978, 8.5456 + 1e-4 * i, 510.0)) for i in range(5)]
        first = upload_mission(client.link, [Item(178, (1.0, 4.0, -1.0, 0.0)), *places])
        assert first == (1 if autopilot is Autopilot.ARDUPILOT else 0)


def test_a_fence_that_does_not_hold_home_is_refused_although_the_vehicle_accepted_it():
    with flying(speed=2.0) as client:
        client.state(lambda state: state.home_enu_m is not None)
        with pytest.raises(LinkError, match="says that it does not hold"):
            upload_fence(client.link, square(20.0, east_m=300.0))


def test_with_a_key_both_ends_hear_each_other_and_nobody_else(tmp_path):
    key = tmp_path / "key"
    key.write_bytes(bytes(range(32)))
    key.chmod(0o600)
    with flying(key_file=key) as client:
        client.state(lambda state: state.ready)
        assert client.do(Command.ARM).accepted
        frames = []
        send = client.link._wire.send
        client.link._wire.send = lambda frame: (frames.append(frame), send(frame))
        time.sleep(1.2)
        assert frames
        assert all(frame[2] & 1 for frame in frames)
        assert all(len(frame) == 12 + frame[1] + SIGNATURE_BYTES for frame in frames)


def test_a_vehicle_without_the_key_is_not_believed(tmp_path):
    key = tmp_path / "key"
    key.write_bytes(bytes(range(32)))
    key.chmod(0o600)
    vehicle = spawn(GROUND, speed=10.0)
    try:
        with pytest.raises(LinkError, match="not signed"):
            Link.connect(vehicle.address, ORIGIN, key_file=key, timeout_s=2.0)
    finally:
        vehicle.stop()


def test_where_nobody_is_heard_it_says_what_to_check():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.raises(LinkError, match=r"no vehicle with system id 1 was heard .*check that it is powered"):
        Link.connect(f"udp://127.0.0.1:{port}", ORIGIN, timeout_s=0.5)


def test_a_port_that_is_taken_is_named():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(LinkError, match=rf"{port}.*another program"):
            Link.connect(f"udp://127.0.0.1:{port}", ORIGIN)


def test_another_system_id_is_not_our_vehicle():
    vehicle = spawn(GROUND, speed=10.0)
    try:
        with pytest.raises(LinkError, match="from another system"):
            Link.connect(vehicle.address, ORIGIN, vehicle_system=9, timeout_s=2.0)
    finally:
        vehicle.stop()
