"""The loop of a flight: what Ctrl-C means, jobs that break off, and the loop itself that does."""

import concurrent.futures
import dataclasses
import time
from types import SimpleNamespace

import numpy as np
import pytest

from mission.executive.events import Checked, FindWay, Goal, Operator, RunChecks, WayFound, Withdraw
from mission.executive.phases import Phase
from mission.flying.clock import FlightClock
from mission.flying.flight_loop import FlightLoop
from mission.flying.flight_progress import Watcher
from mission.flying.recorder import Kept
from mission.flying.replanning import Verdict
from mission.flying.ways import along
from sim_bridge.link.inbox import Timed
from sim_bridge.state import Command, CommandDone, FlightMode
from tests.mission.proven import proven
from tests.mission.rehearsed_flight import LIMITS, Flight


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
    asked = FindWay(Goal.HOME, (0.0, 0.0, 5.0), (9.0, 0.0, 5.0), 7)
    assert answer_to(asked, error) == WayFound(asked, None, reason)


def test_how_long_the_way_home_takes_is_reckoned_beside_the_flight_and_again_when_something_was_learned():
    class Detour:
        def find_way(self, wanted):
            asked.append(wanted)
            corners = [wanted.start_m, (0.0, 2000.0, 10.0), wanted.end_m]
            return proven(along(np.array(corners), LIMITS))

    asked = []
    flight = Flight().exploring()
    flight.vehicle.battery = 0.6
    belief = SimpleNamespace(problem=flight.known)
    clock, stream = SimpleNamespace(rate=1.0), Notes()
    loop = FlightLoop(flight.executive, None, clock, stream, None, belief, None, Detour(), None)
    loop._act = lambda actions, _: flight.act(actions)

    def reckon():
        count, until = len(asked), time.monotonic() + 20.0
        while flight.executive._hearing.proven_home is None or len(asked) == count:
            loop._reckon_home(flight.now_s)
            assert time.monotonic() < until

    flight.run_for(1.0)
    assert flight.phase is Phase.FOLLOWING
    reckon()
    belief.problem = dataclasses.replace(flight.known)
    reckon()
    assert len(asked) == 2
    flight.run_for(1.0)
    assert flight.phase is Phase.TURNING_BACK
    assert "charge" in flight.executive.why


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
        self.withdrawn = False

    def withdraw(self):
        self.withdrawn = True

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

    def renew(self):
        return None

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
    assert vehicle.withdrawn is bool(orders)
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


class Answered:
    """A cycle that has one new plan to offer."""

    hopeless = False
    lost = ""

    def __init__(self, trajectory):
        request = SimpleNamespace(number=1, switch_s=trajectory.start_s)
        self._answers = [(SimpleNamespace(request=request, solve_s=0.1), Verdict(trajectory, "better"))]
        self.asked = 0

    def hurry(self):
        pass

    def poll(self, executive, now_s):
        return self._answers.pop() if self._answers else None

    def ask(self, executive, now_s, rate):
        self.asked += 1


class Keeping(Notes):
    """A log whose disk answers when it is told to."""

    def __init__(self):
        super().__init__()
        self.future = concurrent.futures.Future()

    def keep(self, trajectory):
        self.kept = Kept(7, trajectory)
        return self.future

    def course(self, time_s, kept, origin):
        self.written.append({"course": kept.number})


def offered_a_plan():
    """A loop to which a plan was offered that is on its way to the disk; the plan, the log and what is known."""
    flight = Flight().exploring()
    executive = flight.executive
    old = executive.exploration
    knot = int((executive.course.at(flight.now_s).curve_s + 4.0 - old.start_s) / old.knot_interval_s)
    new = proven(old.from_knot(knot))
    log, belief = Keeping(), SimpleNamespace(problem=object())
    clock = FlightClock(time.monotonic())
    loop = FlightLoop(executive, Vehicle(), clock, Notes(), log, belief, Answered(new), None, Watcher())
    loop._replan(flight.now_s)
    loop._replan(flight.now_s)
    assert executive.exploration is old
    assert loop._cycle.asked == 0
    return loop, new, log, belief, flight.now_s


def test_a_new_plan_is_flown_once_it_is_on_the_disk_and_is_recorded_then():
    loop, new, log, _, now_s = offered_a_plan()
    assert not any("course" in fields for fields in log.written)
    log.future.set_result(log.kept)
    loop._kept.get(timeout=20.0)(now_s)
    assert loop.executive.exploration is new
    assert {"course": 7} in log.written
    loop._replan(now_s)
    assert loop._cycle.asked == 1


def test_a_new_plan_that_could_not_be_kept_is_not_flown():
    loop, new, log, _, now_s = offered_a_plan()
    log.future.set_exception(OSError(28, "No space left on device"))
    loop._kept.get(timeout=20.0)(now_s)
    assert loop.executive.exploration is not new
    assert not any("course" in fields for fields in log.written)


def test_a_new_plan_is_not_flown_where_something_was_learned_while_it_was_put_on_the_disk():
    loop, new, log, belief, now_s = offered_a_plan()
    belief.problem = object()
    log.future.set_result(log.kept)
    loop._kept.get(timeout=20.0)(now_s)
    assert loop.executive.exploration is not new


def test_a_new_plan_that_the_disk_kept_for_too_long_is_dropped_and_never_recorded():
    loop, new, log, _, now_s = offered_a_plan()
    log.future.set_result(log.kept)
    loop._kept.get(timeout=20.0)(now_s + 30.0)
    assert loop.executive.exploration is not new
    assert not any("course" in fields for fields in log.written)


def test_that_nobody_replans_any_more_is_said_once():
    loop, _, log, _, now_s = offered_a_plan()
    log.future.set_exception(OSError(28, "No space left on device"))
    loop._kept.get(timeout=20.0)(now_s)
    loop._cycle.lost = "the replanning process ended with code -9"
    loop._replan(now_s)
    loop._replan(now_s)
    said = [fields["text"] for fields in log.written if "without replans" in fields.get("text", "")]
    assert said == ["the replanning process ended with code -9: the flight goes on without replans"]


def test_what_the_executive_withdraws_is_withdrawn_from_the_link():
    called = []
    loop = FlightLoop(Flight().executive, SimpleNamespace(withdraw=lambda: called.append(True)), *[None] * 7)  # pyright: ignore[reportArgumentType]
    loop._act([Withdraw()], 0.0)
    assert called
