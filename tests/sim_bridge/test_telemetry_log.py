"""Telemetry logs against pymavlink's own reader of them."""

import math
import os
import socket
import time

import pytest

os.environ.setdefault("MAVLINK20", "1")
from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.signing import Signatures
from sim_bridge.simulator import spawn
from sim_bridge.state import GeodeticPoint
from sim_bridge.telemetry_log import TelemetryLog
from tests.mission.full_disk import no_file_larger_than


def attitude(yaw_rad: float) -> bytes:
    message = mavlink.MAVLink_attitude_message(5, 0.0, 0.0, yaw_rad, 0.0, 0.0, 0.0)
    return bytes(message.pack(mavlink.MAVLink(None, 7, 1)))


def read(path) -> list:
    log = mavutil.mavlogfile(str(path), robust_parsing=False)
    found = []
    while (message := log.recv_msg()) is not None:
        found.append(message)
    log.close()
    return found


def test_what_is_written_is_read_by_pymavlink_with_its_moments(tmp_path):
    path = tmp_path / "one.tlog"
    with TelemetryLog(path, 1_700_000_000.0, pytest.fail) as log:
        log.write(1.25, attitude(0.1))
        log.write(2.5, attitude(0.2) + attitude(0.3))
        log.write(3.0, b"no frame at all")
    messages = read(path)
    assert [message.yaw for message in messages] == pytest.approx([0.1, 0.2, 0.3])
    assert {message.get_srcSystem() for message in messages} == {7}
    moments = [message._timestamp - 1_700_000_000.0 for message in messages]
    assert moments == pytest.approx([1.25, 2.5, 2.5], abs=1e-5)


def test_a_signing_key_is_never_written_down(tmp_path):
    key = b"K" * 32
    setup = mavlink.MAVLink_setup_signing_message(1, 1, list(key), 5)
    path = tmp_path / "one.tlog"
    with TelemetryLog(path, 0.0, pytest.fail) as log:
        frame = bytes(setup.pack(mavlink.MAVLink(None, 245, 190)))
        log.write(1.0, attitude(0.1) + Signatures(key, 10).sign(frame) + frame + attitude(0.2))
    assert key not in path.read_bytes()
    assert [message.yaw for message in read(path)] == pytest.approx([0.1, 0.2])


def test_a_log_ends_where_it_may_not_grow_any_more_and_says_so_once(tmp_path):
    said: list[str] = []
    path = tmp_path / "one.tlog"
    frame_bytes = len(attitude(1.0)) + 8
    with TelemetryLog(path, 0.0, said.append, most_bytes=3 * frame_bytes) as log:
        for number in range(6):
            log.write(float(number), attitude(1.0 + number))
    assert [message.yaw for message in read(path)] == [1.0, 2.0, 3.0]
    assert said == [f"{path} is as large as it may grow: nothing more is recorded there"]


@pytest.mark.parametrize("frames", [10, 1000])
def test_a_full_disk_ends_the_log_and_not_what_it_records(tmp_path, frames):
    said: list[str] = []
    path = tmp_path / "one.tlog"
    with no_file_larger_than(200), TelemetryLog(path, 0.0, said.append) as log:
        for number in range(frames):
            log.write(0.01 * number, attitude(0.1))
    assert path.stat().st_size <= 200
    assert len(said) == 1
    assert "nothing more is recorded" in said[0]


def test_a_simulator_records_both_directions_of_every_vehicle(tmp_path):
    folder = tmp_path / "logs"
    ground = GeodeticPoint(47.3977, 8.5456, 488.0)
    spawned = spawn(ground, speed=10.0, arguments=["--record", str(folder), "--wind", "1,0"])
    port = int(spawned.address.rsplit(":", 1)[1])
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.bind(("127.0.0.1", port))
            client.settimeout(10.0)
            _, vehicle = client.recvfrom(65536)
            ping = mavlink.MAVLink_ping_message(42, 1, 0, 0)
            until_s = time.monotonic() + 10.0
            answered = False
            while not answered and time.monotonic() < until_s:
                client.sendto(bytes(ping.pack(mavlink.MAVLink(None, 245, 190))), vehicle)
                data, _ = client.recvfrom(65536)
                answered = any(m.get_type() == "PING" for m in mavlink.MAVLink(None).parse_buffer(data) or [])
    finally:
        spawned.stop()
    assert answered
    messages = read(folder / "vehicle-1.tlog")
    pings = {message.get_srcSystem() for message in messages if message.get_type() == "PING"}
    assert pings == {1, 245}
    positions = [message for message in messages if message.get_type() == "LOCAL_POSITION_NED"]
    assert positions
    # The log's moments run on the vehicle's time, not on the wall's.
    ahead = [message._timestamp - 1e-3 * message.time_boot_ms for message in positions]
    assert math.isclose(max(ahead), min(ahead), abs_tol=0.02)
