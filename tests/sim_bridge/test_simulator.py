"""The built-in vehicle in a process of its own, flown over UDP by mavsdk, a client we did not write."""

import json
import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest
from mavsdk import Configuration, Mavsdk, log_subscribe
from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.geofence import FenceType, Geofence, GeofenceData, Point, Polygon
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw
from mavsdk.plugins.offboard import AccelerationNed, Offboard, PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry

from sim_bridge.codec import mavlink
from sim_bridge.dialects import Autopilot
from sim_bridge.simulator import spawn
from sim_bridge.state import GeodeticPoint

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
SPEED = 10.0


class Client:
    """mavsdk and its plugins, connected to one vehicle."""

    def __init__(self, address: str) -> None:
        log_subscribe(lambda *_: True)
        self._sdk = Mavsdk(Configuration.create_manual(245, 190, True))
        self._sdk.add_any_connection("udpin://" + address.removeprefix("udp://"))
        system = self._sdk.first_autopilot(15.0)
        assert system is not None, "no heartbeat"
        self.action, self.telemetry, self.offboard = Action(system), Telemetry(system), Offboard(system)
        self.param, self.missions, self.fence = Param(system), MissionRaw(system), Geofence(system)
        # ArduPilot tells next to nothing until it is asked.
        self.telemetry.set_rate_position(20.0)
        self.telemetry.set_rate_position_velocity_ned(20.0)
        self.telemetry.set_rate_home(2.0)
        self.telemetry.set_rate_landed_state(5.0)
        # mavsdk has no rate for what it makes a vehicle's health of.
        interval = {"command": mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, "confirmation": 0, "param1": 1.0, "param2": 2e5}
        fields = {"target_system": 1, "target_component": 1, **interval, **{f"param{n}": 0.0 for n in range(3, 8)}}
        MavlinkDirect(system).send_command(MavlinkMessage("COMMAND_LONG", 245, 190, 1, 1, json.dumps(fields)))

    def wait_for(self, what: Callable[[], bool], wall_s: float = 20.0) -> None:
        """Poll until something is so."""
        until_s = time.monotonic() + wall_s
        while not what():
            assert time.monotonic() < until_s, "it did not come about in time"
            time.sleep(0.02)

    def arm(self, wall_s: float = 20.0) -> None:
        """Arm as soon as the vehicle allows it."""
        until_s = time.monotonic() + wall_s
        while True:
            try:
                self.action.arm()
                return
            except ActionError:
                assert time.monotonic() < until_s, "it never became ready"
                time.sleep(0.2)

    def height_m(self) -> float:
        """Above home."""
        return self.telemetry.position().relative_altitude_m

    def velocity_mps(self) -> tuple[float, float, float]:
        velocity = self.telemetry.position_velocity_ned().velocity
        return velocity.north_m_s, velocity.east_m_s, velocity.down_m_s

    def close(self) -> None:
        self._sdk.destroy()


@pytest.fixture(params=list(Autopilot), ids=lambda autopilot: autopilot.name.lower())
def autopilot(request: pytest.FixtureRequest) -> Autopilot:
    return request.param


@pytest.fixture
def client(autopilot: Autopilot) -> Iterator[Client]:
    spawned = spawn(GROUND, speed=SPEED, autopilot=autopilot)
    try:
        found = Client(spawned.address)
        yield found
        found.close()
    finally:
        spawned.stop()


def test_mavsdk_arms_takes_off_flies_a_circle_returns_and_lands(client: Client):
    client.wait_for(lambda: client.telemetry.health_all_ok() and client.telemetry.health().is_armable)
    client.action.set_takeoff_altitude(12.0)
    client.arm()
    client.action.takeoff()
    client.wait_for(lambda: client.height_m() > 11.0)
    client.wait_for(lambda: math.hypot(*client.velocity_mps()) < 0.3)

    start = client.telemetry.position_velocity_ned().position
    radius_m, rate = 10.0, 0.4

    def stream(vehicle_s: float) -> tuple[float, float]:
        angle = rate * vehicle_s
        c, s = math.cos(angle), math.sin(angle)
        north, east = start.north_m + radius_m * (c - 1.0), start.east_m + radius_m * s
        client.offboard.set_position_velocity_acceleration_ned(
            PositionNedYaw(north, east, start.down_m, 0.0),
            VelocityNedYaw(-radius_m * rate * s, radius_m * rate * c, 0.0, 0.0),
            AccelerationNed(-radius_m * rate**2 * c, -radius_m * rate**2 * s, 0.0),
        )
        return north, east

    stream(0.0)
    client.offboard.start()
    client.wait_for(lambda: client.telemetry.flight_mode() is FlightMode.OFFBOARD)
    begun_s = time.monotonic()
    offsets_m = []
    while (vehicle_s := SPEED * (time.monotonic() - begun_s)) < 2.0 * math.pi / rate:
        stream(vehicle_s)
        if vehicle_s > 4.0:
            here = client.telemetry.position_velocity_ned().position
            on_circle_m = math.hypot(here.north_m - start.north_m + radius_m, here.east_m - start.east_m)
            offsets_m.append(abs(on_circle_m - radius_m))
        time.sleep(0.05 / SPEED)
    assert client.telemetry.flight_mode() is FlightMode.OFFBOARD
    assert sum(offsets_m) / len(offsets_m) < 0.5

    client.action.return_to_launch()
    client.wait_for(lambda: client.telemetry.flight_mode() is FlightMode.RETURN_TO_LAUNCH)
    client.wait_for(lambda: not client.telemetry.armed(), wall_s=60.0)
    client.wait_for(lambda: client.telemetry.landed_state() is LandedState.ON_GROUND)
    home, here = client.telemetry.home(), client.telemetry.position()
    assert math.dist((here.latitude_deg, here.longitude_deg), (home.latitude_deg, home.longitude_deg)) < 2e-5


def test_mavsdk_writes_parameters_and_reads_them_back(client: Client, autopilot: Autopilot):
    match autopilot:
        case Autopilot.PX4:
            whole, real, value = "COM_OBL_RC_ACT", "MPC_XY_VEL_MAX", 9.5
        case Autopilot.ARDUPILOT:
            whole, real, value = "FENCE_ENABLE", "WPNAV_SPEED", 950.0
    client.param.set_param_int(whole, 1)
    assert client.param.get_param_int(whole) == 1
    client.param.set_param_float(real, value)
    assert client.param.get_param_float(real) == pytest.approx(value)


def test_mavsdk_uploads_a_mission_and_a_fence_and_reads_both_back(client: Client):
    latitude_e7, longitude_e7 = round(GROUND.latitude_deg * 1e7), round(GROUND.longitude_deg * 1e7)
    items = [
        MissionItem(seq, 6, 16, int(seq == 0), 1, 0.0, 2.0, 0.0, 0.0, latitude_e7 + 1000 * seq, longitude_e7, 20.0, 0)
        for seq in range(5)
    ]
    client.missions.upload_mission(items)
    back = client.missions.download_mission()
    assert [(item.seq, item.command) for item in back] == [(item.seq, item.command) for item in items]
    # ArduPilot's item 0 is home, whatever was sent.
    for got, put in list(zip(back, items, strict=True))[1:]:
        assert (got.x, got.y, got.z) == (pytest.approx(put.x, abs=2), pytest.approx(put.y, abs=2), put.z)
    corners = ((1e-3, 0.0), (-1e-3, 1e-3), (-1e-3, -1e-3))
    around = [Point(GROUND.latitude_deg + north, GROUND.longitude_deg + east) for north, east in corners]
    client.fence.upload_geofence(GeofenceData([Polygon(around, FenceType.INCLUSION)], []))
    held = client.missions.download_geofence()
    inclusion = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    assert [(item.command, item.param1) for item in held] == [(inclusion, 3.0)] * 3
    for item, corner in zip(held, around, strict=True):
        assert (item.x, item.y) == (
            pytest.approx(corner.latitude_deg * 1e7, abs=2),
            pytest.approx(corner.longitude_deg * 1e7, abs=2),
        )


def test_mavsdk_is_told_that_a_vehicle_that_is_not_ready_cannot_be_armed():
    spawned = spawn(GROUND, ready_after_s=600.0)
    client = Client(spawned.address)
    try:
        with pytest.raises(ActionError):
            client.action.arm()
        assert not client.telemetry.armed()
    finally:
        client.close()
        spawned.stop()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_simulator_ends_cleanly_when_told_to(number):
    spawned = spawn(GROUND)
    spawned.process.send_signal(number)
    assert spawned.process.wait(10.0) == 0
    spawned.stop()


def test_a_bad_option_is_refused_with_what_to_write():
    for options, hint in (
        (["--origin", "somewhere"], "47.3977"),
        (["--autopilot", "betaflight"], "px4"),
        (["--param", "NO_SUCH=1"], "NO_SUCH"),
        (["--speed", "0"], "positive"),
    ):
        ended = subprocess.run(
            [sys.executable, "-m", "sim_bridge", *options], capture_output=True, text=True, timeout=60, check=False
        )
        assert ended.returncode == 2
        assert hint in ended.stderr
        assert "Traceback" not in ended.stderr
