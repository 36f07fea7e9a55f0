"""Commands that wait for their turn, and answers that never come."""

import threading
from types import SimpleNamespace

import pytest

from sim_bridge.dialects import Autopilot
from sim_bridge.frames import VehicleFrame
from sim_bridge.link import commands
from sim_bridge.link.client import Link
from sim_bridge.link.inbox import Inbox
from sim_bridge.link.telemetry import Telemetry
from sim_bridge.state import Command, CommandDone, GeodeticPoint
from tests.sim_bridge.test_link_answers import Hesitating, mavlink
from tests.sim_bridge.vehicle_messages import ORIGIN, complete, home, position


def test_a_withdrawn_command_is_never_given(monkeypatch):
    given, begun, go_on, done = [], threading.Event(), threading.Event(), threading.Event()

    def carry_out(_self, command, _altitude_m):
        given.append(command)
        begun.set()
        assert go_on.wait(20.0)
        if command is Command.LAND:
            done.set()

    monkeypatch.setattr(commands, "Action", lambda _: None)
    monkeypatch.setattr(commands, "MavlinkDirect", lambda _: None)
    monkeypatch.setattr(commands.Commands, "_ask_for_streams", lambda _: None)
    monkeypatch.setattr(commands.Commands, "_carry_out", carry_out)
    orders = commands.Commands(None, 1, None, SimpleNamespace(autopilot=Autopilot.PX4), Inbox())  # pyright: ignore[reportArgumentType]
    try:
        orders.request(Command.TAKE_OFF, 10.0)
        assert begun.wait(20.0)
        orders.request(Command.FOLLOW_SETPOINTS, None)
        orders.withdraw()
        orders.request(Command.LAND, None)
        go_on.set()
        assert done.wait(20.0)
    finally:
        go_on.set()
        orders.close()
    assert given == [Command.TAKE_OFF, Command.LAND]


@pytest.mark.parametrize(
    # An altitude above sea level, or a height above where it armed.
    ("autopilot", "altitude_m"),
    [(Autopilot.PX4, 488.0 - 0.5 + 12.0), (Autopilot.ARDUPILOT, 12.0)],
)
def test_a_climb_counts_from_where_the_vehicle_stands_and_not_from_an_old_home(monkeypatch, autopilot, altitude_m):
    sent = []
    telemetry = Telemetry(VehicleFrame(ORIGIN))
    complete(telemetry)
    telemetry.receive(position(2000, 3.0, 4.0, 0.5))
    # From before its estimate drifted.
    telemetry.receive(home(486.0))
    telemetry.autopilot = autopilot
    monkeypatch.setattr(commands, "Action", lambda _: None)
    monkeypatch.setattr(commands, "MavlinkDirect", lambda _: None)
    monkeypatch.setattr(commands.Commands, "_ask_for_streams", lambda _: None)
    monkeypatch.setattr(commands.Commands, "_command_long", lambda _, *params: sent.append(params))
    orders = commands.Commands(None, 1, None, telemetry, Inbox())  # pyright: ignore[reportArgumentType]
    try:
        orders._take_off(12.0)
    finally:
        orders.close()
    ((command, *params),) = sent
    assert command == mavlink.MAV_CMD_NAV_TAKEOFF
    assert params[-1] == pytest.approx(altitude_m)


@pytest.mark.parametrize(("results", "answered"), [((), False), ((mavlink.MAV_RESULT_DENIED,), True)])
def test_a_command_that_is_not_answered_is_told_apart_from_one_that_is_refused(results, answered):
    wire = Hesitating()
    link = Link(wire, GeodeticPoint(47.3977, 8.5456, 488.0))
    try:
        link.wait_heard(10.0)
        wire.results = results
        link.request(Command.RETURN)
        done = None
        while done is None:
            done = next((one.event for one in link.events(1.0) if isinstance(one.event, CommandDone)), None)
        assert not done.accepted
        assert done.answered is answered
    finally:
        link.close()
