"""The executive in virtual time, with a point that follows setpoints in the place of a vehicle."""

import dataclasses

import numpy as np
import pytest

from mission.events import (
    Assignment,
    Checked,
    CourseBlocked,
    Entered,
    FindWay,
    FlightEnd,
    FlightMethod,
    NewCourse,
    Operator,
    Order,
    RunChecks,
    Say,
    Stalled,
    Stream,
    WayFound,
)
from mission.executive import Executive
from mission.monitors import Energy, Monitors
from mission.phases import AIRBORNE, FINAL, TABLE, Phase, Trigger, next_phase
from mission.ways import along
from planner.problem import Limits
from planner.trajectory import Trajectory
from sim_bridge.state import (
    Command,
    CommandDone,
    FlightMode,
    LandedState,
    MissionProgress,
    StatusText,
    VehicleState,
)

LIMITS = Limits(5.0, 2.0, 1.5, 3.0)
STEP_S = 0.05
CORNERS = np.array([[20.0, 0.0, 10.0], [60.0, 0.0, 10.0], [60.0, 40.0, 15.0], [20.0, 40.0, 12.0]])
HEARTBEAT_LAG_S = 0.8


class Vehicle:
    """A point with modes: follows setpoints exactly, climbs, lands, and shows its mode late."""

    def __init__(self) -> None:
        self.position = np.zeros(3)
        self.velocity = np.zeros(3)
        self.armed = False
        self.mode = FlightMode.HOLD
        self.shown = [(0.0, FlightMode.HOLD)]
        self.battery = 1.0
        self.drain_per_s = 1.0 / 1200.0
        self.failsafe = False
        self.refuse: dict[Command, list[str]] = {}
        self.ready_after_s = 3.0
        self.target_up = 0.0
        self.silent = False
        self.orders: list[Command] = []

    def set_mode(self, mode: FlightMode, now_s: float) -> None:
        self.mode = mode
        self.shown.append((now_s, mode))

    def obey(self, order: Order, now_s: float) -> CommandDone:
        self.orders.append(order.command)
        if self.refuse.get(order.command):
            return CommandDone(order.command, False, self.refuse[order.command].pop(0))
        match order.command:
            case Command.ARM:
                self.armed = True
            case Command.DISARM:
                self.armed = False
            case Command.TAKE_OFF:
                assert order.altitude_m is not None
                self.target_up = order.altitude_m
                self.set_mode(FlightMode.TAKEOFF, now_s)
            case Command.FOLLOW_SETPOINTS:
                self.set_mode(FlightMode.EXTERNAL, now_s)
            case Command.HOLD:
                self.set_mode(FlightMode.HOLD, now_s)
            case Command.RETURN:
                self.set_mode(FlightMode.RETURN, now_s)
            case Command.LAND:
                self.set_mode(FlightMode.LAND, now_s)
            case Command.START_MISSION:
                self.set_mode(FlightMode.MISSION, now_s)
        return CommandDone(order.command, True)

    def step(self, setpoint, now_s: float) -> None:
        before = self.position.copy()
        if self.armed:
            self.battery -= self.drain_per_s * STEP_S
            match self.mode:
                case FlightMode.TAKEOFF:
                    self.position[2] = min(self.target_up, self.position[2] + 1.5 * STEP_S)
                    if self.position[2] >= self.target_up:
                        self.set_mode(FlightMode.HOLD, now_s)
                case FlightMode.EXTERNAL if setpoint is not None:
                    self.position = np.array(setpoint.position_enu_m)
                case FlightMode.LAND:
                    self.position[2] = max(0.0, self.position[2] - 1.0 * STEP_S)
                case FlightMode.RETURN:
                    self.position[:2] *= max(0.0, 1.0 - 5.0 * STEP_S / max(np.hypot(*self.position[:2]), 1e-6))
                    if np.hypot(*self.position[:2]) < 0.1:
                        self.position[2] = max(0.0, self.position[2] - 1.0 * STEP_S)
                case _:
                    pass
            if self.mode in (FlightMode.LAND, FlightMode.RETURN) and self.position[2] <= 0.0:
                self.armed = False
        self.velocity = (self.position - before) / STEP_S

    def state(self, now_s: float) -> VehicleState:
        shown = [mode for at, mode in self.shown if now_s - at >= HEARTBEAT_LAG_S]
        return VehicleState(
            time_s=now_s,
            position_enu_m=tuple(self.position),
            velocity_enu_mps=tuple(self.velocity),
            yaw_enu_rad=0.0,
            armed=self.armed,
            mode=shown[-1] if shown else FlightMode.HOLD,
            mode_name=(shown[-1] if shown else FlightMode.HOLD).value,
            landed=LandedState.IN_AIR if self.position[2] > 0.05 else LandedState.ON_GROUND,
            battery_fraction=round(self.battery, 2),
            waiting_for=() if now_s > self.ready_after_s else ("its pre-arm checks",),
            failsafe=self.failsafe,
            home_enu_m=(0.0, 0.0, 0.0),
        )


class Flight:
    """An executive and a vehicle on one clock."""

    def __init__(self, **changes) -> None:
        self.vehicle = Vehicle()
        assignment = Assignment(
            exploration=along(CORNERS, LIMITS),
            takeoff_altitude_m=10.0,
            end=FlightEnd.RETURN,
            method=FlightMethod.OFFBOARD,
            max_acceleration_mps2=3.0,
            max_yaw_rate_radps=0.8,
            max_climb_mps=2.0,
        )
        assignment = dataclasses.replace(assignment, **changes)
        self.obstacle: np.ndarray | None = None
        self.fence_east_m = 1000.0
        monitors = Monitors(
            clearance_m=lambda p: 100.0 if self.obstacle is None else float(np.linalg.norm(p - self.obstacle)),
            least_clearance_m=0.5,
            fence_distance_m=lambda p: self.fence_east_m - float(p[0]),
            fence_tolerance_m=1.0,
            max_track_error_m=3.0,
            energy=Energy(1200.0, 0.15, 5.0, 2.0, 1.5),
            cruise_height_m=10.0,
        )
        self.executive = Executive(assignment, monitors)
        self.now_s = 0.0
        self.course = None
        self.no_way = ""
        self.problems: tuple[str, ...] = ()
        self.last_item: int | None = None
        self.phases: list[Phase] = []
        self.said: list[str] = []
        self.answers = []
        self.setpoints: list[tuple[float, object]] = []
        self.push = np.zeros(3)

    @property
    def phase(self) -> Phase:
        return self.executive.phase

    def act(self, actions) -> None:
        for action in actions:
            match action:
                case Stream(course):
                    self.course = course
                case Order():
                    self.answers.append(self.vehicle.obey(action, self.now_s))
                case RunChecks():
                    self.answers.append(Checked(self.problems, last_item=self.last_item))
                case FindWay(goal, start, end):
                    if self.no_way:
                        self.answers.append(WayFound(goal, None, self.no_way))
                    else:
                        way = along(np.array([start, end]), LIMITS)
                        self.answers.append(WayFound(goal, way))
                case Entered(phase):
                    self.phases.append(phase)
                case Say(text):
                    self.said.append(text)

    def tell(self, event) -> None:
        self.act(self.executive.receive(event, self.now_s))

    def step(self) -> None:
        self.now_s += STEP_S
        setpoint = None
        if self.course is not None:
            setpoint = self.course.at(self.now_s).setpoint()
            self.setpoints.append((self.now_s, setpoint))
        self.vehicle.step(setpoint, self.now_s)
        self.vehicle.position = self.vehicle.position + self.push
        if not self.vehicle.silent:
            self.tell(self.vehicle.state(self.now_s))
        answers, self.answers = self.answers, []
        for answer in answers:
            self.tell(answer)
        self.act(self.executive.tick(self.now_s))

    def run(self, until=None, limit_s: float = 1000.0) -> "Flight":
        stop_s = self.now_s + limit_s
        while not self.executive.finished and not (until and until(self)):
            assert self.now_s < stop_s, f"stuck in {self.phase} ({self.executive.why}): {self.said[-3:]}"
            self.step()
        return self

    def run_for(self, seconds: float) -> "Flight":
        stop_s = self.now_s + seconds
        return self.run(lambda flight: flight.now_s >= stop_s)

    def run_to(self, phase: Phase) -> "Flight":
        already = len(self.phases)
        self.run(lambda flight: phase in flight.phases[already:])
        assert phase in self.phases[already:]
        return self

    def exploring(self) -> "Flight":
        return self.run_to(Phase.FOLLOWING).run_for(5.0)


def largest_jump_mps(flight: Flight) -> float:
    """The fastest that consecutive setpoints move."""
    pairs = zip(flight.setpoints, flight.setpoints[1:], strict=False)
    return max(
        float(np.linalg.norm(np.subtract(b.position_enu_m, a.position_enu_m))) / (after - before)
        for (before, a), (after, b) in pairs
        if after - before < 1.5 * STEP_S
    )


def test_a_flight_explores_everything_returns_and_lands():
    flight = Flight().run()
    assert flight.phases == [
        Phase.WAITING_READY,
        Phase.CHECKING,
        Phase.ARMING,
        Phase.TAKING_OFF,
        Phase.ENTERING,
        Phase.TRANSIT,
        Phase.FOLLOWING,
        Phase.TURNING_BACK,
        Phase.RETURNING,
        Phase.LANDING,
        Phase.LANDED,
    ]
    assert flight.executive.explored
    assert flight.executive.offboard_lost == 0
    assert np.hypot(*flight.vehicle.position[:2]) < 0.1
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_it_says_what_it_waits_for():
    flight = Flight().run_to(Phase.CHECKING)
    assert "waiting for its pre-arm checks" in flight.said


def test_a_failed_check_ends_before_anything_is_armed():
    flight = Flight()
    flight.problems = ("COM_OBL_RC_ACT is 0: set it to 5",)
    flight.run()
    assert flight.phase is Phase.ABORTED
    assert flight.vehicle.orders == []
    assert flight.problems[0] in flight.said


def test_arming_is_tried_again_and_the_refusal_is_shown_once():
    flight = Flight()
    flight.vehicle.refuse[Command.ARM] = ['denied ("Preflight Fail: compass")'] * 3
    flight.run_to(Phase.TAKING_OFF)
    assert flight.vehicle.orders.count(Command.ARM) == 4
    assert sum("compass" in text for text in flight.said) == 1


def test_arming_that_is_always_refused_aborts():
    flight = Flight()
    flight.vehicle.refuse[Command.ARM] = ["denied"] * 100
    flight.run()
    assert flight.phase is Phase.ABORTED
    assert Command.TAKE_OFF not in flight.vehicle.orders


def test_a_pause_stands_on_the_course_and_a_resume_goes_on_from_there():
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run_for(10.0)
    assert flight.phase is Phase.HOLDING
    stood = flight.vehicle.position.copy()
    assert np.linalg.norm(flight.vehicle.velocity) < 1e-9
    flight.tell(Operator.RESUME)
    flight.run_for(0.2)
    assert np.linalg.norm(flight.vehicle.position - stood) < 0.2
    flight.run()
    assert flight.phase is Phase.LANDED
    assert flight.executive.explored
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


@pytest.mark.parametrize("phase", [Phase.TRANSIT, Phase.FOLLOWING, Phase.RETURNING])
def test_whatever_is_interrupted_is_taken_up_again(phase):
    flight = Flight().run_to(phase).run_for(2.0)
    flight.tell(Operator.PAUSE)
    flight.run_for(5.0)
    assert flight.phase is Phase.HOLDING
    flight.tell(Operator.RESUME)
    assert flight.phase is phase
    assert flight.run().phase is Phase.LANDED


def test_a_mode_change_by_the_pilot_stops_the_stream_at_once_and_is_never_fought():
    flight = Flight().exploring()
    flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    orders = len(flight.vehicle.orders)
    flight.run_to(Phase.OVERRIDDEN)
    sent = len(flight.setpoints)
    flight.run_for(60.0)
    assert flight.phase is Phase.OVERRIDDEN
    assert len(flight.setpoints) == sent
    assert len(flight.vehicle.orders) == orders
    assert flight.executive.offboard_lost == 1


@pytest.mark.parametrize("phase", [Phase.TAKING_OFF, Phase.TRANSIT, Phase.RETURNING, Phase.LANDING])
def test_the_pilot_wins_in_every_phase(phase):
    flight = Flight().run_to(phase).run_for(3.5)
    assert flight.phase is phase
    flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN)
    orders = len(flight.vehicle.orders)
    flight.run_for(20.0)
    assert len(flight.vehicle.orders) == orders


def test_after_an_override_the_operator_takes_over_again_and_the_rest_is_flown():
    flight = Flight().exploring()
    flown_s = flight.executive.explored_s(flight.now_s)
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN)
    flight.vehicle.position = flight.vehicle.position + np.array([5.0, -8.0, 3.0])
    flight.run_for(5.0)
    flight.tell(Operator.RESUME)
    flight.run_to(Phase.FOLLOWING)
    assert flight.executive.explored_s(flight.now_s) >= flown_s
    assert flight.run().phase is Phase.LANDED
    assert flight.executive.explored


def test_a_failsafe_of_the_vehicle_is_told_apart_from_the_pilot():
    flight = Flight().exploring()
    flight.vehicle.failsafe = True
    flight.vehicle.set_mode(FlightMode.RETURN, flight.now_s)
    flight.run()
    assert Phase.OVERRIDDEN in flight.phases
    assert "failsafe" in flight.executive.why or flight.phase is Phase.LANDED
    assert flight.phase is Phase.LANDED
    assert not flight.executive.explored


def test_a_short_silence_brakes_on_the_course_and_goes_on_when_heard_again():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run_for(5.0)
    assert flight.phase is Phase.BLIND
    assert np.linalg.norm(flight.vehicle.velocity) < 1e-9
    flight.vehicle.silent = False
    flight.run_for(0.2)
    assert flight.phase is Phase.FOLLOWING
    assert flight.run().phase is Phase.LANDED
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_a_silence_while_paused_comes_back_to_the_pause():
    flight = Flight().exploring()
    flight.tell(Operator.PAUSE)
    flight.run_for(3.0)
    flight.vehicle.silent = True
    flight.run_for(4.0)
    assert flight.phase is Phase.BLIND
    flight.vehicle.silent = False
    flight.run_for(1.0)
    assert flight.phase is Phase.HOLDING
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.FOLLOWING


def test_a_long_silence_stops_the_stream_and_tells_the_vehicle_to_return():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run_for(15.0)
    assert flight.course is None
    assert flight.vehicle.orders[-1] is Command.RETURN
    flight.vehicle.silent = False
    flight.run()
    assert Phase.VEHICLE_RETURN in flight.phases
    assert flight.phase is Phase.LANDED


def test_a_vehicle_held_by_its_failsafe_is_rejoined_with_a_proven_way():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run_for(3.0)
    flight.vehicle.failsafe = True
    flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
    flight.vehicle.position = flight.vehicle.position + np.array([0.0, 4.0, 0.0])
    flight.run_for(2.0)
    flight.vehicle.silent = False
    flight.run_for(1.0)
    assert flight.phase is Phase.ENTERING
    flight.vehicle.failsafe = False
    assert flight.run().phase is Phase.LANDED
    assert flight.executive.explored


def test_a_vehicle_that_is_never_heard_again_ends_the_flight():
    flight = Flight().exploring()
    flight.vehicle.silent = True
    flight.run()
    assert flight.phase is Phase.ABORTED


def test_the_way_home_is_flown_when_the_charge_is_what_it_needs():
    flight = Flight()
    flight.vehicle.battery = 0.2
    flight.run()
    assert flight.phase is Phase.LANDED
    assert not flight.executive.explored
    assert Phase.RETURNING in flight.phases
    # The reserve is still there, and was not wasted either.
    assert 0.15 <= flight.vehicle.battery <= 0.18


def test_a_hungry_vehicle_turns_back_earlier():
    lazy, hungry = Flight(), Flight()
    lazy.vehicle.battery = hungry.vehicle.battery = 0.5
    hungry.vehicle.drain_per_s = 3.0 / 1200.0
    charges = []
    for flight in (lazy, hungry):
        flight.run(lambda f: f.phase is Phase.TURNING_BACK)
        charges.append(flight.vehicle.battery)
        assert flight.run().phase is Phase.LANDED
        assert flight.vehicle.battery >= 0.14
    assert charges[1] < charges[0] or not hungry.executive.explored


def test_outside_the_fence_it_turns_back():
    flight = Flight().exploring()
    flight.fence_east_m = float(flight.vehicle.position[0]) - 2.0
    flight.run_for(0.1)
    assert flight.phase is Phase.TURNING_BACK
    assert flight.run().phase is Phase.LANDED


def test_too_close_to_an_obstacle_it_holds_and_goes_on_when_clear():
    flight = Flight().exploring()
    flight.obstacle = flight.vehicle.position.copy()
    flight.run_for(0.1)
    assert flight.phase is Phase.HOLDING
    flight.obstacle = None
    flight.run_for(8.0)
    assert flight.phase is Phase.FOLLOWING


def test_what_keeps_happening_ends_the_exploration():
    flight = Flight().exploring()
    for _ in range(4):
        flight.obstacle = flight.vehicle.position.copy()
        flight.run_for(0.1)
        flight.obstacle = None
        flight.run_for(6.0)
    assert Phase.TURNING_BACK in flight.phases
    assert flight.run().phase is Phase.LANDED


def test_blown_off_the_course_it_waits_until_it_is_back():
    flight = Flight().exploring()
    flight.push = np.array([0.0, 4.0, 0.0])
    flight.run_for(0.2)
    assert flight.phase is Phase.HOLDING
    flight.push = np.zeros(3)
    flight.run_for(8.0)
    assert flight.phase is Phase.FOLLOWING


def test_a_new_course_is_taken_at_its_start_without_a_jump():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    switch_s = course.at(flight.now_s).curve_s + 2.0
    old = flight.executive.exploration
    # The same curve from the switch on, then another end.
    first = int((switch_s - old.start_s) / old.knot_interval_s)
    switch_s = old.start_s + first * old.knot_interval_s
    points = np.vstack([old.control_points_m[first : first + 20], np.tile([40.0, 20.0, 12.0], (3, 1))])
    new = Trajectory(points, old.knot_interval_s, switch_s)
    flight.tell(NewCourse(new))
    assert flight.executive.exploration is new
    flight.run()
    assert flight.phase is Phase.LANDED
    reached = [s.position_enu_m for _, s in flight.setpoints]
    assert min(np.linalg.norm(np.subtract(p, [40.0, 20.0, 12.0])) for p in reached) < 1e-6


def test_new_courses_may_follow_each_other_before_the_first_has_begun():
    flight = Flight().exploring()
    old = flight.executive.exploration
    course = flight.executive.course
    assert course is not None
    here_s = course.at(flight.now_s).curve_s
    for ahead_s in (4.0, 6.0, 8.0, 10.0):
        knot = int((here_s + ahead_s - old.start_s) / old.knot_interval_s)
        start_s = old.start_s + knot * old.knot_interval_s
        flight.tell(NewCourse(Trajectory(old.control_points_m[knot:], old.knot_interval_s, start_s)))
    flight.run()
    assert flight.phase is Phase.LANDED
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_a_new_course_that_comes_too_late_is_dropped():
    flight = Flight().exploring()
    old = flight.executive.exploration
    flight.tell(NewCourse(dataclasses.replace(old, start_s=0.5)))
    assert flight.executive.exploration is old
    assert flight.run().phase is Phase.LANDED


def test_a_course_that_does_not_continue_the_old_one_is_an_error():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    with pytest.raises(ValueError, match="does not continue"):
        flight.tell(NewCourse(along(CORNERS[::-1], LIMITS).__class__(CORNERS[::-1], 1.0, course.end_s - 1.0)))


def test_a_blocked_course_is_flown_up_to_the_block_and_no_further():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    blocked_s = course.at(flight.now_s).curve_s + 8.0
    place = course.motion_at(blocked_s).position_m
    flight.tell(CourseBlocked(blocked_s, "a crane"))
    flight.run_for(1.0)
    assert flight.phase is Phase.FOLLOWING
    flight.run_for(20.0)
    assert flight.phase is Phase.HOLDING
    assert np.linalg.norm(flight.vehicle.position - place) > 1.0
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.HOLDING
    stop = flight.executive.course.stop_position()
    flight.tell(NewCourse(along(np.array([stop, [20.0, 20.0, 10.0]]), LIMITS)))
    assert flight.phase is Phase.FOLLOWING
    assert flight.run().phase is Phase.LANDED


@pytest.mark.parametrize("end", [FlightEnd.LAND, FlightEnd.HOLD])
def test_the_end_is_what_the_mission_says(end):
    flight = Flight(end=end).run()
    assert flight.phase is (Phase.LANDED if end is FlightEnd.LAND else Phase.HANDED_OVER)
    assert np.allclose(flight.vehicle.position[:2], CORNERS[-1][:2], atol=0.2)
    assert flight.executive.explored


def test_without_a_proven_way_home_the_vehicle_returns_by_itself():
    flight = Flight().exploring()
    flight.no_way = "walled in"
    flight.tell(Operator.RETURN)
    flight.run()
    assert Phase.VEHICLE_RETURN in flight.phases
    assert flight.phase is Phase.LANDED


def test_without_a_proven_way_to_the_start_it_lands_where_it_took_off():
    flight = Flight()
    flight.no_way = "walled in"
    flight.run()
    assert flight.phase is Phase.LANDED
    assert Phase.TRANSIT not in flight.phases


def test_a_landing_that_is_refused_is_asked_for_again():
    flight = Flight().exploring()
    flight.vehicle.refuse[Command.LAND] = ["temporarily rejected"] * 2
    flight.tell(Operator.LAND)
    flight.run()
    assert flight.vehicle.orders.count(Command.LAND) == 3
    assert flight.phase is Phase.LANDED


def test_setpoints_go_on_until_the_landing_is_taken_and_not_one_step_longer():
    flight = Flight().exploring()
    flight.tell(Operator.LAND)
    flight.run_for(0.5)
    assert flight.course is not None
    flight.run_for(2.0)
    assert flight.course is None


def test_an_uploaded_mission_is_flown_by_the_vehicle_and_only_watched():
    flight = Flight(method=FlightMethod.MISSION)
    flight.last_item = 3
    flight.run_to(Phase.AUTO_MISSION).run_for(5.0)
    assert flight.course is None
    flight.tell(Operator.PAUSE)
    flight.run_for(3.0)
    assert flight.vehicle.mode is FlightMode.HOLD
    flight.tell(Operator.RESUME)
    flight.run_for(3.0)
    assert flight.vehicle.mode is FlightMode.MISSION
    flight.tell(MissionProgress(2, 3))
    assert flight.phase is Phase.AUTO_MISSION
    flight.tell(MissionProgress(3, 3))
    flight.run()
    assert flight.phase is Phase.LANDED
    assert flight.executive.explored


def test_words_of_the_vehicle_are_passed_on():
    flight = Flight()
    flight.tell(StatusText(4, "Preflight Fail: compass"))
    assert flight.said == ["vehicle: Preflight Fail: compass"]


def test_every_flight_phase_has_a_way_out_for_the_operator_and_the_pilot():
    for phase in AIRBORNE:
        if phase in (Phase.LANDING, Phase.VEHICLE_RETURN):
            assert next_phase(phase, Trigger.LEAVE) is not None
        else:
            assert next_phase(phase, Trigger.LAND) is not None, phase
        assert next_phase(phase, Trigger.PILOT) is not None, phase


def test_every_phase_but_the_final_ones_can_be_left_and_every_one_is_reached():
    left = {phase for row in TABLE for phase in row.phases}
    reached = {row.goto for row in TABLE}
    assert left == set(Phase) - set(FINAL)
    assert set(Phase) - reached == {Phase.CONNECTING}


def test_no_phase_and_trigger_have_two_rows():
    pairs = [(phase, row.trigger) for row in TABLE for phase in row.phases]
    assert len(pairs) == len(set(pairs))


@pytest.mark.parametrize("seed", range(30))
def test_whatever_happens_in_whatever_order_the_flight_ends(seed):
    random = np.random.default_rng(seed)
    flight = Flight()
    for _ in range(12):
        flight.run_for(float(random.uniform(0.5, 15.0)))
        if flight.executive.finished:
            break
        match random.integers(9):
            case 0:
                flight.tell(random.choice(np.array([Operator.PAUSE, Operator.RESUME], dtype=object)))
            case 1:
                flight.tell(Operator.RETURN)
            case 2:
                flight.vehicle.silent = not flight.vehicle.silent
            case 3:
                flight.obstacle = None if flight.obstacle is not None else flight.vehicle.position.copy()
            case 4:
                flight.vehicle.battery = float(random.uniform(0.1, 1.0))
            case 5:
                command = random.choice(np.array(list(Command), dtype=object))
                flight.vehicle.refuse[command] = ["denied"] * int(random.integers(1, 4))
            case 6:
                flight.no_way = "" if flight.no_way else "walled in"
            case 7:
                flight.vehicle.set_mode(FlightMode.HOLD, flight.now_s)
            case 8:
                flight.tell(CourseBlocked(float(random.uniform(0.0, 40.0)), "a crane"))
    flight.vehicle.silent = False
    flight.obstacle = None
    flight.vehicle.refuse.clear()
    for wish in (Operator.RETURN, Operator.LAND):
        flight.run_for(60.0)
        if not flight.executive.finished:
            flight.tell(wish)
    flight.run()
    assert flight.phase in FINAL
    given_up = flight.executive.why == "the vehicle was never heard again"
    assert not flight.vehicle.armed or given_up or flight.phase is Phase.HANDED_OVER
    assert flight.course is None


def test_a_stream_that_braked_by_itself_is_taken_up_where_it_stands():
    flight = Flight().exploring()
    course = flight.executive.course
    assert course is not None
    braked = course.braking(flight.now_s)
    flight.course = braked
    flight.now_s += 3.0
    flight.tell(Stalled(braked))
    assert flight.phase is Phase.HOLDING
    flight.run_for(8.0)
    assert flight.phase is Phase.FOLLOWING
    assert flight.run().phase is Phase.LANDED
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_a_vehicle_that_flies_already_is_taken_over_where_it_is():
    flight = Flight()
    flight.vehicle.armed = True
    flight.vehicle.position = np.array([30.0, 5.0, 12.0])
    flight.vehicle.ready_after_s = 1e9
    flight.run()
    assert Phase.ARMING not in flight.phases
    assert Phase.TAKING_OFF not in flight.phases
    assert flight.phase is Phase.LANDED
    assert flight.executive.explored
