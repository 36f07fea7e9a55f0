"""A whole flight in virtual time: the executive of real flights, the built-in vehicle, a line between them, faults."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.faults.pillar import along_corners, clearance_m, mission, outside_fence_m, problem
from benchmarks.faults.pushed import ObstaclePushed, Pushed
from benchmarks.faults.virtual_link import VirtualLink
from benchmarks.faults.witness import LATE_S, Witness
from mission.executive.course import Course
from mission.executive.events import (
    Assignment,
    Checked,
    Connected,
    Entered,
    FindWay,
    FlightEnd,
    FlightMethod,
    NewCourse,
    Order,
    RunChecks,
    Say,
    Stream,
    WayFound,
    Withdraw,
)
from mission.executive.executive import Executive
from mission.executive.phases import FINAL, STREAMING, Phase
from mission.flying.belief import Belief
from mission.flying.clock import FlightClock
from mission.flying.flight_rules import energy_of, monitors_of
from mission.flying.ground import Ground
from mission.flying.return_settings import own_return_of
from planner import gate
from planner.gate import ProvenTrajectory
from planner.trajectory import Trajectory
from sim_bridge.ardupilot import defaults as ardupilot_defaults
from sim_bridge.ardupilot.vehicle import ArduCopter
from sim_bridge.dialects import Autopilot
from sim_bridge.faults import AnyFault
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.px4 import defaults as px4_defaults
from sim_bridge.px4.vehicle import Px4
from sim_bridge.state import GeodeticPoint, VehicleState
from sim_bridge.station import Station
from sim_bridge.vehicle.body import VehicleConfig

_PARAMETERS = {
    # As docs/flying.md tells a team to set them: hold when the stream ends, return above everything that stands around.
    Autopilot.PX4: (("COM_OBL_RC_ACT", 5.0), ("RTL_RETURN_ALT", 45.0)),
    Autopilot.ARDUPILOT: (("RTL_ALT", 4500.0),),
}
_SET = {
    Autopilot.PX4: px4_defaults.PARAMETERS | dict(_PARAMETERS[Autopilot.PX4]),
    Autopilot.ARDUPILOT: ardupilot_defaults.PARAMETERS | dict(_PARAMETERS[Autopilot.ARDUPILOT]),
}
TICK_S = 0.01
STREAM_S = 0.05
LONGEST_S = 600.0
WATCHED_S = 90.0
ALONE_S = 400.0
FENCE_TOLERANCE_M = 2.0
BOX_TOLERANCE_M = 1.0
ESTIMATE_TOLERANCE_M = 1.0
STREAM_GAP_S = 0.25
JUDGED_EVERY_S = 0.1
REPLAN_EVERY_S = 6.0
REPLAN_TAKES_S = 1.0
REPLAN_LEAD_S = 2.0
ASIDE_M = 2.0


@dataclasses.dataclass(frozen=True)
class Rehearsed:
    """What a rehearsal came to.

    Attributes:
        ended: In which phase the flight ended.
        left: What the vehicle was left doing, where that is neither to stand on the ground nor safe; empty otherwise.
        phases: Phases entered, with the moment and the reason.
        said: What was told, with the moment.
        faults: What went wrong with the flight itself; empty: nothing.
        replans: New courses flown.
    """

    ended: Phase
    left: str
    phases: tuple[tuple[float, Phase, str], ...]
    said: tuple[tuple[float, str], ...]
    faults: tuple[str, ...]
    replans: int


class Rehearsal:
    """One flight.

    Args:
        autopilot: Of the vehicle.
        faults: What goes wrong.
        seed: Of everything random.
    """

    def __init__(self, autopilot: Autopilot, faults: Sequence[AnyFault | ObstaclePushed] = (), seed: int = 0) -> None:
        asked, known = mission(), problem()
        origin = asked.site.origin.point()
        of_vehicle = [fault for fault in faults if not isinstance(fault, ObstaclePushed)]
        self._station, self.witness = _station(autopilot, origin, of_vehicle, seed)
        self._link = VirtualLink(self._station, autopilot, origin)
        self._belief = Belief(known)
        self._pushed = [Pushed(fault, asked, self._belief) for fault in faults if isinstance(fault, ObstaclePushed)]
        energy = energy_of(asked, known).told(own_return_of(autopilot, _SET[autopilot].get))
        limits = known.limits
        assignment = Assignment(
            exploration=along_corners(),
            takeoff_altitude_m=asked.takeoff_altitude_m,
            end=FlightEnd.RETURN,
            method=FlightMethod.OFFBOARD,
            max_acceleration_mps2=limits.max_acceleration_mps2,
            max_yaw_rate_radps=limits.max_yaw_rate_radps,
            max_climb_mps=limits.max_climb_mps,
        )
        self.executive = Executive(assignment, monitors_of(asked, self._belief, energy), lambda: self._belief.problem)
        # Only the finding of ways is used, which needs no vehicle.
        self._ground = Ground(asked, self._belief, None, energy, None, assignment, lambda _: (), lambda: True)  # pyright: ignore[reportArgumentType]
        self._clock = FlightClock(0.0)
        self._course: Course | None = None
        self._answers: list = []
        self._random = np.random.default_rng(seed)
        self._replan_s: float | None = None
        self._planned: tuple[float, ProvenTrajectory] | None = None
        self._streamed_s = -1.0
        self._judged_s = -1.0
        self.now_s = 0.0
        self.replans = 0
        self.phases: list[tuple[float, Phase, str]] = []
        self.said: list[tuple[float, str]] = []
        self.broken: dict[str, str] = {}

    def fly(self, watch: Callable[[Rehearsal], None] = lambda _: None) -> Rehearsed:
        """Fly until the flight has ended, and then until the vehicle is safe."""
        self._act(self.executive.receive(Connected(), 0.0), 0.0)
        while not self._over() and self.now_s < LONGEST_S:
            self._step()
            watch(self)
        if not self._over():
            self.broken.setdefault("end", f"still {self.executive.phase.value} after {LONGEST_S:.0f} s")
        self._everything_told()
        left = self.witness.left_alone(self._station, self.now_s, ALONE_S)
        return Rehearsed(
            self.executive.phase,
            left,
            tuple(self.phases),
            tuple(self.said),
            (*self.broken.values(), *self.witness.broken.values()),
            self.replans,
        )

    def _over(self) -> bool:
        """Whether the flight has ended, or whoever took over has had it for a while."""
        taken_over = self.executive.phase is Phase.OVERRIDDEN and self.now_s - self.phases[-1][0] > WATCHED_S
        return self.executive.finished or taken_over

    def _step(self) -> None:
        self.now_s += TICK_S
        flight_s = self._clock.now(self.now_s)
        if self._course is not None and self.now_s - self._streamed_s >= STREAM_S - 1e-9:
            self._streamed_s = self.now_s
            # A setpoint that is not finite raises here.
            self._link.stream(self._course.at(flight_s + 0.5 * STREAM_S).setpoint(), self.now_s)
        for event in self._link.advance(self.now_s):
            if isinstance(event, VehicleState):
                self._clock.hear(event.time_s, self.now_s)
                at_s = self._clock.of(event.time_s)
                self._judge(event)
                self._act(self.executive.receive(event, at_s), at_s)
            else:
                self._act(self.executive.receive(event, flight_s), flight_s)
        for pushed in self._pushed:
            for event in pushed.events(self.executive, self.now_s, flight_s):
                self._act(self.executive.receive(event, flight_s), flight_s)
        answers, self._answers = self._answers, []
        for answer in answers:
            self._act(self.executive.receive(answer, flight_s), flight_s)
        if round(self.now_s / TICK_S) % 2 == 0:
            self._act(self.executive.tick(flight_s), flight_s)
            self._replan(flight_s)
        self._judge_stream()

    def _act(self, actions, flight_s: float) -> None:
        for action in actions:
            match action:
                case Stream(course):
                    self._course = course
                    if course is None:
                        self._link.close_stream()
                case Order(command, altitude_m):
                    self._link.request(command, altitude_m, self.now_s)
                case Withdraw():
                    self._link.withdraw()
                case RunChecks():
                    self._answers.append(Checked(()))
                case FindWay():
                    self._answers.append(self._way(action))
                case Entered(phase, why):
                    self.phases.append((self.now_s, phase, why))
                case Say(text):
                    self.said.append((self.now_s, text))

    def _way(self, wanted: FindWay) -> WayFound:
        try:
            return WayFound(wanted, self._ground.find_way(wanted))
        except ValueError as error:
            return WayFound(wanted, None, str(error))

    # Replans: another proven curve now and then, as a solver would give it.

    def _replan(self, flight_s: float) -> None:
        course = self.executive.course
        if self._planned is not None and self.now_s >= self._planned[0]:
            trajectory, self._planned = self._planned[1], None
            before = self.executive.exploration
            self._act(self.executive.receive(NewCourse(trajectory), flight_s), flight_s)
            self.replans += self.executive.exploration is not before
        flowing = course is not None and self.executive.phase is Phase.FOLLOWING and course.pace.target_rate > 0.0
        due = self._replan_s is None or self.now_s - self._replan_s >= REPLAN_EVERY_S
        if flowing and due and course is not None and course.at(flight_s).rate == 1.0:
            self._replan_s = self.now_s
            trajectory = self._another(course, course.at(flight_s).curve_s + REPLAN_LEAD_S)
            if trajectory is not None:
                self._planned = (self.now_s + REPLAN_TAKES_S, trajectory)

    def _another(self, course: Course, from_s: float) -> ProvenTrajectory | None:
        current = course.trajectory
        knot = int(np.ceil((from_s - current.start_s) / current.knot_interval_s))
        rest = current.control_points_m[max(knot, 0) :].copy()
        if len(rest) < 30:
            return None
        swing = np.sin(np.pi * np.linspace(0.0, 1.0, len(rest) - 6)) ** 2
        rest[3:-3, :2] += self._random.uniform(-ASIDE_M, ASIDE_M, 2) * swing[:, None]
        start_s = current.start_s + max(knot, 0) * current.knot_interval_s
        other = Trajectory(rest, current.knot_interval_s, start_s)
        asked = dataclasses.replace(
            problem(), start=other.motion_at(start_s), duration_s=other.duration_s, end_position_m=None
        )
        try:
            return gate.prove(other, asked)
        except gate.GateRefused:
            return None

    # What must never be.

    def _judge(self, state: VehicleState) -> None:
        """Hold the flight against where the vehicle believes to be, and where it truly is while the two agree."""
        if self.now_s - self._judged_s < JUDGED_EVERY_S:
            return
        self._judged_s = self.now_s
        believed = np.asarray(state.position_enu_m)
        places = {"": believed}
        if self.witness.estimate_error_m < ESTIMATE_TOLERANCE_M:
            places[", in truth"] = self.witness.place_enu_m()
        workspace = problem().workspace
        for how, place in places.items():
            if not self.witness.armed:
                continue
            if outside_fence_m(place) > FENCE_TOLERANCE_M:
                self.broken.setdefault("fence" + how, f"outside the fence at {self.now_s:.1f} s{how}")
            if clearance_m(place) < 0.0:
                self.broken.setdefault("clearance" + how, f"into an obstacle at {self.now_s:.1f} s{how}")
            for pushed in self._pushed:
                if wrong := pushed.judge(place, self.now_s):
                    self.broken.setdefault("pushed" + how, wrong + how)
            outside_m = float(np.maximum(workspace.box_min_m - place, place - workspace.box_max_m).max())
            if self.executive.phase is Phase.FOLLOWING and outside_m > BOX_TOLERANCE_M:
                self.broken.setdefault("box" + how, f"{outside_m:.1f} m outside the box at {self.now_s:.1f} s{how}")

    def _judge_stream(self) -> None:
        """Setpoints reach the wire while they fly the vehicle, and none does once they must not."""
        phase = self.executive.phase
        entered_s = self.phases[-1][0] if self.phases else 0.0
        streaming = phase in STREAMING and self.now_s - entered_s > STREAM_GAP_S
        if streaming and self.now_s - self._link.setpoint_s > STREAM_GAP_S:
            self.broken.setdefault("silence", f"no setpoints while {phase.value} at {self.now_s:.1f} s")
        ended = phase in (Phase.OVERRIDDEN, *FINAL)
        if ended and self._link.setpoint_s > entered_s:
            self.broken.setdefault("stream", f"a setpoint left while {phase.value} at {self.now_s:.1f} s")
        if ended and self.witness.setpoint_s > entered_s + LATE_S:
            self.broken.setdefault("late", f"a setpoint was heard while {phase.value} at {self.now_s:.1f} s")

    def _everything_told(self) -> None:
        """Whatever the vehicle said, the flight's log has it."""
        told = {text for _, text in self.said}
        missing = [text for _, text in self._link.texts if f"vehicle: {text}" not in told]
        if missing:
            self.broken.setdefault("told", f"not told: {missing[0]}")


def _station(
    autopilot: Autopilot, origin: GeodeticPoint, faults: Sequence[AnyFault], seed: int
) -> tuple[Station, Witness]:
    config = VehicleConfig(
        geodetic_from_enu(mission().home_enu_m, origin),
        ready_after_s=3.0,
        parameters=_PARAMETERS[autopilot],
        wander_m=0.3,
        seed=seed,
    )
    vehicle = Px4(config) if autopilot is Autopilot.PX4 else ArduCopter(config)
    witness = Witness(vehicle, origin)
    return Station(vehicle, seed=seed, faults=faults, record=witness.record), witness
