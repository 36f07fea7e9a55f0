"""Telemetry logs against pymavlink's own reader of them."""

import math
import os
import socket
import time

import pytest

os.environ.setdefault("MAVLINK20", "1")
from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.simulator import spawn
from sim_bridge.state import GeodeticPoint
from sim_bridge.telemetry_log import TelemetryLog


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
    with TelemetryLog(path, 1_700_000_000.0) as log:
        log.write(1.25, attitude(0.1))
        log.write(2.5, attitude(0.2) + attitude(0.3))
        log.write(3.0, b"no frame at all")
    messages = read(path)
    assert [message.yaw for message in messages] == pytest.approx([0.1, 0.2, 0.3])
    assert {message.get_srcSystem() for message in messages} == {7}
    moments = [message._timestamp - 1_700_000_000.0 for message in messages]
    assert moments == pytest.approx([1.25, 2.5, 2.5], abs=1e-5)


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
