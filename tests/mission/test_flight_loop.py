"""The loop of a flight: what Ctrl-C means, and jobs that break off."""

from types import SimpleNamespace

import pytest

from mission.executive.events import Checked, FindWay, Goal, Operator, RunChecks, WayFound, Withdraw
from mission.executive.phases import Phase
from mission.flying.flight_loop import FlightLoop
from sim_bridge.state import FlightMode
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


def test_what_the_executive_withdraws_is_withdrawn_from_the_link():
    called = []
    loop = FlightLoop(Flight().executive, SimpleNamespace(withdraw=lambda: called.append(True)), *[None] * 7)  # pyright: ignore[reportArgumentType]
    loop._act([Withdraw()], 0.0)
    assert called
