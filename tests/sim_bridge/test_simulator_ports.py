"""Who hears a built-in vehicle over real sockets."""

import json
import socket
import subprocess
import sys
import threading

import pytest

from sim_bridge.codec import Codec
from sim_bridge.px4.vehicle import Px4
from sim_bridge.simulator import Simulator
from sim_bridge.state import GeodeticPoint
from sim_bridge.station import Station
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import mavlink

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)


def stations(count: int) -> list[Station]:
    return [Station(Px4(VehicleConfig(GROUND, system=1 + index))) for index in range(count)]


def listener() -> socket.socket:
    own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    own.bind(("127.0.0.1", 0))
    own.settimeout(5.0)
    return own


def heard(own: socket.socket, kind: str) -> tuple[object, tuple[str, int]]:
    """The next message of a type, and where it came from."""
    reader = Codec(255)
    while True:
        data, sender = own.recvfrom(65536)
        for message in reader.decode(data):
            if message.get_type() == kind:
                return message, sender


def neighbours() -> tuple[socket.socket, socket.socket]:
    """Sockets on two ports, one behind the other."""
    while True:
        first, second = listener(), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            second.bind(("127.0.0.1", first.getsockname()[1] + 1))
        except OSError:
            first.close()
            second.close()
            continue
        second.settimeout(5.0)
        return first, second


def test_vehicle_i_speaks_to_the_port_i_behind_the_first_and_all_to_the_ground_stations():
    first, second = neighbours()
    with first, second, listener() as ground_station:
        simulator = Simulator(stations(2), first.getsockname()[1], 5.0, ground_station.getsockname()[1])
        over = threading.Event()
        thread = threading.Thread(target=simulator.run, args=(over.is_set,))
        thread.start()
        try:
            assert [heard(own, "HEARTBEAT")[0].get_srcSystem() for own in (first, second)] == [1, 2]
            both = {heard(ground_station, "HEARTBEAT")[0].get_srcSystem() for _ in range(10)}
            assert both == {1, 2}
        finally:
            over.set()
            thread.join()
            simulator.close()


def test_the_first_port_is_14540():
    command = [sys.executable, "-m", "sim_bridge", "--vehicles", "3", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["ports"] == [14540, 14541, 14542]
        process.terminate()


def test_a_client_and_a_ground_station_hear_the_same_vehicle_and_both_are_answered():
    with listener() as client, listener() as ground_station:
        simulator = Simulator(stations(1), client.getsockname()[1], 5.0, ground_station.getsockname()[1])
        over = threading.Event()
        thread = threading.Thread(target=simulator.run, args=(over.is_set,))
        thread.start()
        try:
            for own in (client, ground_station):
                _, vehicle = heard(own, "HEARTBEAT")
                own.sendto(Codec(245).encode(mavlink.MAVLink_ping_message(0, 77, 0, 0)), vehicle)
                pong, _ = heard(own, "PING")
                assert pong.seq == 77
        finally:
            over.set()
            thread.join()
            simulator.close()


@pytest.mark.parametrize(("port", "ground_station"), [(14550, 14550), (14549, 14550), (0, None), (65535, None)])
def test_ports_that_collide_or_are_none_are_refused(port, ground_station):
    with pytest.raises(ValueError, match="a UDP port of their own"):
        Simulator(stations(2), port, 1.0, ground_station)


def test_a_vehicle_whose_program_fails_is_silent_and_the_others_fly_on(capfd):
    simulator = Simulator(stations(2), 0xBFFE, 5.0)
    broken, sound = (plug.station.autopilot for plug in simulator._plugs)
    broken.tick = lambda now_s: 1 / 0
    try:
        simulator.run(lambda: sound.body.time_s > 2.0)
        assert simulator.failed == [1]
        said = capfd.readouterr().err
        assert "vehicle 1 has failed" in said
        assert "ZeroDivisionError" in said
        sound.tick = lambda now_s: 1 / 0
        with pytest.raises(ZeroDivisionError):
            simulator.run(lambda: False)
    finally:
        simulator.close()
