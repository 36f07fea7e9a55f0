"""A flight in virtual time: the executive, and a point that follows setpoints in the place of a vehicle."""

import dataclasses

import numpy as np

from mission.executive.energy import Energy
from mission.executive.events import (
    Assignment,
    Checked,
    Entered,
    FindWay,
    FlightEnd,
    FlightMethod,
    MissionPlace,
    Order,
    RunChecks,
    Say,
    Stream,
    WayFound,
    Withdraw,
)
from mission.executive.executive import Executive
from mission.executive.monitors import Monitors
from mission.executive.phases import Phase
from mission.flying.ways import along
from mission.site.descent import Descent
from planner.information import uniform
from planner.obstacles import Obstacle, ObstacleField
from planner.problem import Limits, Problem
from planner.trajectory import Motion
from planner.workspace import Workspace
from sim_bridge.state import (
    Command,
    CommandDone,
    FlightMode,
    LandedState,
    VehicleState,
)
from tests.mission.proven import proven

LIMITS = Limits(5.0, 2.0, 1.5, 3.0)
STEP_S = 0.05
CORNERS = np.array([[20.0, 0.0, 10.0], [60.0, 0.0, 10.0], [60.0, 40.0, 15.0], [20.0, 40.0, 12.0]])
HEARTBEAT_LAG_S = 0.8
FAR_AWAY = np.full(3, 1e4)
BOX = Workspace(np.array([-1000.0, -1000.0, 0.0]), np.array([1000.0, 1000.0, 100.0]))
KNOWN = Problem(
    workspace=BOX,
    information=uniform(BOX),
    obstacles=ObstacleField.of([]),
    limits=LIMITS,
    start=Motion.at_rest(np.zeros(3)),
    end_position_m=None,
    duration_s=60.0,
    vehicle_radius_m=0.5,
    clearance_margin_m=1.0,
)


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
        self.home_up_m = 0.0
        self.home_up_aloft_m: float | None = None
        self.silent = False
        self.orders: list[Command] = []

    def set_mode(self, mode: FlightMode, now_s: float) -> None:
        self.mode = mode
        self.shown.append((now_s, mode))

    def obey(self, order: Order, now_s: float) -> CommandDone:
        self.orders.append(order.command)
        if self.refuse.get(order.command):
            reason = self.refuse[order.command].pop(0)
            return CommandDone(order.command, False, reason, answered=reason != "timeout")
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
        if self.home_up_aloft_m is not None and self.position[2] > 0.05:
            self.home_up_m = self.home_up_aloft_m
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
            home_enu_m=(0.0, 0.0, self.home_up_m),
        )


class Flight:
    """An executive and a vehicle on one clock."""

    def __init__(self, **changes) -> None:
        self.vehicle = Vehicle()
        assignment = Assignment(
            exploration=proven(along(CORNERS, LIMITS)),
            takeoff_altitude_m=10.0,
            end=FlightEnd.RETURN,
            method=FlightMethod.OFFBOARD,
            max_acceleration_mps2=3.0,
            max_yaw_rate_radps=0.8,
            max_climb_mps=2.0,
        )
        assignment = dataclasses.replace(assignment, **changes)
        self.obstacle = FAR_AWAY
        self.fence_east_m = 1000.0
        monitors = Monitors(
            clearance_m=self.clearance_m,
            least_clearance_m=0.5,
            fence_distance_m=lambda p: self.fence_east_m - float(p[0]),
            fence_tolerance_m=1.0,
            max_track_error_m=3.0,
            track_margin_m=1.0,
            energy=Energy(1200.0, 0.15, 5.0, 2.0, Descent(1.5)),
            cruise_height_m=10.0,
        )
        self.known = KNOWN
        self.leaned_against_per_s = 0.0
        self.executive = Executive(assignment, monitors, lambda: self.known)
        self.now_s = 0.0
        self.course = None
        self.no_way = ""
        self.problems: tuple[str, ...] = ()
        self.checks_end = True
        self.places: tuple[MissionPlace, ...] = ()
        self.phases: list[Phase] = []
        self.said: list[str] = []
        self.withdrawn: list[Phase] = []
        self.answers = []
        self.setpoints: list[tuple[float, object]] = []
        self.push = np.zeros(3)

    @property
    def phase(self) -> Phase:
        return self.executive.phase

    def clearance_m(self, places: np.ndarray) -> np.ndarray:
        return np.linalg.norm(places - self.obstacle, axis=-1)

    def act(self, actions) -> None:
        for action in actions:
            match action:
                case Stream(course):
                    self.course = course
                case Order():
                    self.answers.append(self.vehicle.obey(action, self.now_s))
                case Withdraw():
                    self.withdrawn.append(self.phase)
                case RunChecks() if self.checks_end:
                    self.answers.append(Checked(self.problems, places=self.places))
                case FindWay(start_m=start, end_m=end):
                    if self.no_way:
                        self.answers.append(WayFound(action, None, self.no_way))
                    else:
                        way = proven(along(np.array([start, end]), LIMITS))
                        self.answers.append(WayFound(action, way))
                case Entered(phase):
                    self.phases.append(phase)
                case Say(text):
                    self.said.append(text)

    def learn(self, *obstacles: Obstacle) -> None:
        """From now on these are known, and nothing else."""
        self.known = dataclasses.replace(KNOWN, obstacles=ObstacleField.of(obstacles))

    def tell(self, event) -> None:
        self.act(self.executive.receive(event, self.now_s))

    def step(self) -> None:
        self.now_s += STEP_S
        setpoint = None
        if self.course is not None:
            setpoint = self.course.at(self.now_s).setpoint(self.leaned_against_per_s)
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
