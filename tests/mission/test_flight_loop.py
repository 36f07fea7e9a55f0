"""The loop of a flight: what Ctrl-C means, jobs that break off, and the loop itself that does."""

import time

from types import SimpleNamespace

import pytest

from mission.executive.events import Checked, FindWay, Goal, Operator, RunChecks, WayFound, Withdraw
from mission.executive.phases import Phase
from mission.flying.clock import FlightClock
from mission.flying.flight_loop import FlightLoop
from mission.flying.flight_progress import Watcher
from sim_bridge.link.inbox import Timed
from sim_bridge.state import Command, CommandDone, FlightMode
from tests.mission.rehearsed_flight import Flight


class Broken:
    """A ground that fails in ways nobody foresaw."""

    def __init__(self, error):
        self.error = error

    def check(self, state):
        raise self.error

    def find_way(self, wanted):
        raise self.error


def loop_of(executive, ground=None):
    """A loop without a vehicle, a stream, a log and all the rest."""
    return FlightLoop(executive, *[None] * 6, ground, None)


def answer_to(action, error):
    flight = Flight().run_to(Phase.CHECKING)
    loop = loop_of(flight.executive, Broken(error))
    loop._act([action], flight.now_s)
    return loop._inbox.get(timeout=20.0)


@pytest.mark.parametrize("error", [MemoryError("12 GB"), RuntimeError("not answered"), ZeroDivisionError("none")])
def test_checks_that_break_off_are_checks_that_failed(error):
    answer = answer_to(RunChecks(), error)
    assert isinstance(answer, Checked)
    (problem,) = answer.problems
    assert problem == f"the checks broke off: {type(error).__name__}: {error}"


@pytest.mark.parametrize(
    ("error", "reason"), [(ValueError("walled in"), "walled in"), (MemoryError(), "MemoryError: ")]
)
def test_a_way_whose_search_breaks_off_is_no_way(error, reason):
    answer = answer_to(FindWay(Goal.HOME, (0.0, 0.0, 5.0), (9.0, 0.0, 5.0)), error)
    assert answer == WayFound(Goal.HOME, None, reason)


def test_ctrl_c_calls_back_then_lands_then_leaves():
    flight = Flight().exploring()
    loop = loop_of(flight.executive)
    wishes = []
    loop.tell = wishes.append
    for _ in range(3):
        loop.interrupt()
    assert wishes == [Operator.RETURN, Operator.LAND, Operator.LEAVE]


@pytest.mark.parametrize("phase", [Phase.OVERRIDDEN, Phase.LANDING])
def test_where_somebody_else_has_the_vehicle_ctrl_c_leaves_it_to_them(phase):
    flight = Flight().exploring()
    if phase is Phase.LANDING:
        flight.tell(Operator.LAND)
    else:
        flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
        flight.run_to(Phase.OVERRIDDEN)
    orders = len(flight.vehicle.orders)
    loop = loop_of(flight.executive)
    loop.tell = flight.tell
    loop.interrupt()
    assert flight.phase is Phase.ABORTED
    assert len(flight.vehicle.orders) == orders


class Vehicle:
    """Takes commands or refuses them, and answers."""

    def __init__(self, refuses=()):
        self.orders, self._refuses, self._answers = [], refuses, []

    def request(self, command, altitude_m=None):
        self.orders.append(command)
        self._answers.append(CommandDone(command, command not in self._refuses, "denied"))

    def events(self, timeout_s):
        answers, self._answers = self._answers, []
        return [Timed(time.monotonic(), answer) for answer in answers]


class Notes:
    """A stream, and a log, that only remember."""

    def __init__(self):
        self.followed, self.written = [], []

    def follow(self, course):
        self.followed.append(course)

    def write(self, kind, time_s, **fields):
        self.written.append(fields)


def broken_off(executive, error, vehicle):
    """A loop whose step fails."""
    stream, log = Notes(), Notes()
    loop = FlightLoop(executive, vehicle, FlightClock(time.monotonic()), stream, log, None, None, None, Watcher())

    def step(wait_host_s):
        raise error

    loop.step = step
    with pytest.raises(type(error)):
        loop.run()
    return stream, log


def in_phase(phase):
    flight = Flight()
    if phase is Phase.OVERRIDDEN:
        flight.exploring().vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    flight.run_to(phase)
    return flight.executive


@pytest.mark.parametrize(
    ("phase", "orders"),
    [
        (Phase.WAITING_READY, []),
        (Phase.ARMING, [Command.DISARM]),
        (Phase.TAKING_OFF, [Command.LAND]),
        (Phase.FOLLOWING, [Command.RETURN]),
        (Phase.LANDING, [Command.LAND]),
        (Phase.OVERRIDDEN, []),
    ],
)
def test_a_loop_that_fails_ends_the_stream_and_gives_the_vehicle_its_last_order(phase, orders):
    vehicle = Vehicle()
    stream, log = broken_off(in_phase(phase), KeyError("unforeseen"), vehicle)
    assert vehicle.orders == orders
    assert stream.followed[-1] is None
    assert any("KeyError: 'unforeseen'" in fields.get("text", "") for fields in log.written)


def test_where_the_last_return_is_refused_the_vehicle_lands():
    vehicle = Vehicle(refuses=(Command.RETURN,))
    broken_off(in_phase(Phase.FOLLOWING), MemoryError(), vehicle)
    assert vehicle.orders == [Command.RETURN, Command.LAND]


def test_a_log_that_fails_too_does_not_keep_the_vehicle_from_its_last_order():
    vehicle, executive = Vehicle(), in_phase(Phase.FOLLOWING)
    loop = FlightLoop(executive, vehicle, FlightClock(time.monotonic()), None, None, None, None, None, Watcher())
    with pytest.raises(AttributeError):
        loop.run()
    assert vehicle.orders == [Command.RETURN]
