"""What is pushed is taken in beside the loop, kept, and answered."""

import dataclasses
import json
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from mission.executive.events import FlightMethod, Operator
from mission.executive.phases import Phase
from mission.flying.belief import Belief
from mission.flying.flight_loop import FlightLoop
from mission.flying.flight_progress import Watcher
from mission.flying.flight_rules import assignment_of, energy_of
from mission.flying.ground import Ground
from mission.flying.intake import INBOX, Intake
from mission.flying.pushes import MOST_SOLIDS, Pushes, TakenIn
from sim_bridge.dialects import Autopilot
from sim_bridge.state import FlightMode, LandedState
from tests.mission.flying_vehicle import STATE
from tests.mission.hand_made import CORNERS, MISSION, plan_by_hand
from tests.mission.rehearsed_flight import Flight

PLACE = np.array([[70.0, 35.0, 13.0]])
CRANE = {"kind": "sphere", "center_enu_m": [70.0, 35.0, 13.0], "radius_m": 5.0}
SLOW_PX4 = {
    "COM_OBL_RC_ACT": 5,
    "COM_OF_LOSS_T": 1,
    "GF_ACTION": 2,
    "GF_MAX_HOR_DIST": 0,
    "GF_MAX_VER_DIST": 0,
    "COM_LOW_BAT_ACT": 3,
    "RTL_RETURN_ALT": 60,
    "NAV_DLL_ACT": 2,
    "MPC_XY_VEL_MAX": 4.0,
}


class Inbox:
    """A flight's folder with its pushes."""

    def __init__(self, planned, folder, consequence=""):
        self.planned, self.folder = planned, folder
        self.belief = Belief(planned.problem)
        self.pushes = Pushes(planned.mission, self.belief, Intake(folder, planned.mission), lambda: consequence)

    def push(self, name, **data) -> TakenIn:
        (self.folder / INBOX / f"{name}.json").write_text(json.dumps(data))
        (taken,) = self.pushes.take_in()
        return taken

    def answer(self, name) -> dict:
        return json.loads((self.folder / INBOX / f"{name}.answer").read_text())

    def distance_m(self) -> float:
        return float(self.belief.problem.obstacles.distance(PLACE)[0])


@pytest.fixture
def planned(tmp_path):
    return plan_by_hand(MISSION, CORNERS, tmp_path)


@pytest.fixture
def inbox(planned, tmp_path):
    return Inbox(planned, tmp_path / "flight")


def test_what_is_pushed_is_known_when_it_is_answered(inbox):
    taken = inbox.push("a", obstacle=[CRANE], command="pause")
    assert taken.wish is Operator.PAUSE
    assert inbox.answer("a") == {"accepted": True, "reason": "taken in"}
    assert inbox.distance_m() == pytest.approx(-5.0)


def test_what_it_means_for_the_flight_is_answered_too(planned, tmp_path):
    inbox = Inbox(planned, tmp_path / "flight", "it will stand above home")
    taken = inbox.push("a", obstacle=[CRANE])
    assert inbox.answer("a") == {"accepted": True, "reason": "taken in; it will stand above home"}
    assert taken.said is not None
    assert taken.said.warning


def test_obstacles_that_leave_nothing_to_explore_are_known_all_the_same(inbox):
    inbox.push("a", obstacle=[{"kind": "box", "min_enu_m": [-50.0, -50.0, 0.0], "max_enu_m": [150.0, 130.0, 60.0]}])
    assert inbox.answer("a")["accepted"]
    assert inbox.distance_m() < 0.0


def test_a_pushed_no_fly_volume_is_kept_out_of(inbox):
    around = [[60.0, 25.0], [80.0, 25.0], [80.0, 45.0], [60.0, 45.0]]
    inbox.push("a", no_fly=[{"kind": "prism", "polygon_enu_m": around, "floor_m": 0.0, "ceiling_m": 60.0}])
    assert inbox.answer("a")["accepted"], inbox.answer("a")
    assert inbox.distance_m() == pytest.approx(-10.0)


def test_more_shapes_than_a_flight_can_watch_are_refused(inbox):
    many = [CRANE] * (MOST_SOLIDS // 2)
    inbox.push("a", obstacle=many)
    inbox.push("b", obstacle=many)
    inbox.push("c", obstacle=[CRANE])
    assert [inbox.answer(name)["accepted"] for name in "abc"] == [True, True, False]
    assert "1 shapes, after 1000" in inbox.answer("c")["reason"]


HOME = (15.0, 15.0, 0.0)
STANDING = dataclasses.replace(
    STATE,
    position_enu_m=HOME,
    home_enu_m=HOME,
    armed=False,
    mode=FlightMode.HOLD,
    landed=LandedState.ON_GROUND,
    battery_fraction=1.0,
)


def ground_of(planned, inbox, parameter, warm=lambda: True) -> Ground:
    link = SimpleNamespace(autopilot=Autopilot.PX4, parameter=parameter)
    energy = energy_of(planned.mission, planned.problem)
    assignment = assignment_of(planned, FlightMethod.OFFBOARD)
    return Ground(planned.mission, inbox.belief, link, energy, inbox.pushes, assignment, lambda _: (), warm)


def test_what_is_pushed_during_the_checks_is_kept(inbox, planned):
    def parameter(name):
        if name == "GF_ACTION":
            inbox.push("a", obstacle=[CRANE])
        return SLOW_PX4.get(name)

    assert ground_of(planned, inbox, parameter).check(STANDING).problems == ()
    assert inbox.distance_m() == pytest.approx(-5.0)
    assert inbox.belief.problem.limits.max_speed_mps < planned.problem.limits.max_speed_mps


def test_the_checks_of_a_flight_that_has_ended_wait_for_no_compiler(inbox, planned):
    asked = threading.Event()

    def never_warm():
        asked.set()
        return False

    ground = ground_of(planned, inbox, SLOW_PX4.get, never_warm)
    checking = threading.Thread(target=ground.check, args=(STANDING,), daemon=True)
    checking.start()
    assert asked.wait(20.0)
    ground.close()
    checking.join(20.0)
    assert not checking.is_alive()


def test_the_loop_does_not_wait_for_what_is_taken_in():
    begun, go_on = threading.Event(), threading.Event()

    class SlowGround:
        def take_in(self):
            begun.set()
            go_on.wait(20.0)
            return [TakenIn(None, Operator.PAUSE)]

    flight = Flight().exploring()
    recorder = SimpleNamespace(write=lambda *_, **__: None)
    streamer = SimpleNamespace(follow=lambda _: None, renew=lambda: None)
    link = SimpleNamespace(withdraw=lambda: None)
    loop = FlightLoop(flight.executive, link, None, streamer, recorder, None, None, SlowGround(), Watcher())
    loop._take_pushed(flight.now_s)
    assert begun.wait(20.0)
    loop._take_pushed(flight.now_s)
    assert flight.phase is Phase.FOLLOWING
    go_on.set()
    until = time.monotonic() + 20.0
    while flight.phase is Phase.FOLLOWING and time.monotonic() < until:
        loop._take_pushed(flight.now_s)
    assert flight.phase is Phase.HOLDING
