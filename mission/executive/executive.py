"""The flight executive: a state machine without clocks, sockets or threads.

Events come in with the moment they happened; actions come out. This file turns what the ground says and what time
brings into triggers, `hearing` what the vehicle says, `arrivals` what comes at the end of a curve; `phases.TABLE` says
which phase follows which, and `phase_machine` takes its rows. All times are seconds of the flight clock: the vehicle's
time, made continuous.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from mission.executive.arrivals import Arrivals
from mission.executive.course import Course
from mission.executive.course_keeper import CourseKeeper
from mission.executive.energy import ProvenHome
from mission.executive.events import (
    VEHICLE_SAYS,
    Action,
    Assignment,
    Checked,
    Connected,
    Event,
    FindWay,
    Goal,
    NewCourse,
    NoWayRound,
    Operator,
    Order,
    Stalled,
    StreamFailed,
    StreamLate,
    WayFound,
    WayHome,
)
from mission.executive.hearing import Hearing
from mission.executive.known_vehicle import KnownVehicle
from mission.executive.landing import Landing
from mission.executive.link_watch import LinkWatch, Silence
from mission.executive.lookout import blocks
from mission.executive.monitors import Monitors
from mission.executive.phase_machine import GOAL, PhaseMachine
from mission.executive.phases import FINAL, ON_COURSE, OUTWARD, Phase, Trigger
from mission.executive.standing_order import StandingOrder
from mission.executive.stay import limit_s
from mission.executive.way_watch import WayWatch
from planner.gate import ProvenTrajectory
from planner.problem import Problem
from planner.trajectory import Trajectory
from sim_bridge.state import (
    Command,
    CommandDone,
    MissionProgress,
    StatusText,
    VehicleState,
    Waiting,
)


class Executive:
    """Turns events into actions.

    Args:
        assignment: What to fly.
        monitors: What telemetry is held against.
        known: What is known now; its obstacles are another object whenever some were learned.
        now_s: Flight clock at the beginning.
        from_s: Curve time at which the exploration begins, where a part of it was flown before.
        patience: Flight seconds a host second: a link lives in the host's time, however fast a simulator's runs.
    """

    def __init__(
        self,
        assignment: Assignment,
        monitors: Monitors,
        known: Callable[[], Problem],
        now_s: float = 0.0,
        from_s: float | None = None,
        patience: float = 1.0,
    ) -> None:
        self.assignment = assignment
        self._patience = max(1.0, patience)
        self._vehicle = KnownVehicle(monitors.energy)
        self._keeper = CourseKeeper(assignment, from_s)
        self._order = StandingOrder(assignment.takeoff_altitude_m, self._patience)
        self._link = LinkWatch(now_s, self._patience)
        self._landing = Landing(known, monitors.least_clearance_m, assignment.rally_m, assignment.takeoff_altitude_m)
        self._machine = PhaseMachine(self._vehicle, self._keeper, self._order, self._landing, now_s)
        self._hearing = Hearing(
            assignment,
            monitors,
            self._vehicle,
            self._link,
            self._keeper,
            self._order,
            self._machine,
            now_s,
            self._patience,
        )
        self._known = known
        self._arrivals = Arrivals(assignment.end, self._vehicle, self._keeper, self._landing, self._machine)
        self._ways = WayWatch(known, assignment.end, self._vehicle, self._keeper, self._landing, self._machine)

    @property
    def phase(self) -> Phase:
        """What the flight is doing."""
        return self._machine.phase

    @property
    def why(self) -> str:
        """Why it does that."""
        return self._machine.why

    @property
    def monitors(self) -> Monitors:
        """What telemetry is held against."""
        return self._hearing.monitors

    @property
    def offboard_lost(self) -> int:
        """How often setpoints were not followed any more."""
        return self._hearing.offboard_lost

    @property
    def state(self) -> VehicleState | None:
        """What the vehicle told last; None: nothing yet."""
        return self._vehicle.state

    @property
    def course(self) -> Course | None:
        """What setpoints are taken from; None: none are sent."""
        return self._keeper.course

    @property
    def exploration(self) -> ProvenTrajectory:
        """The proven curve that is explored on, as replans left it."""
        return self._keeper.exploration

    @property
    def explored(self) -> bool:
        """Whether it was flown to its end."""
        return self._keeper.explored

    @property
    def finished(self) -> bool:
        """Whether the flight has ended."""
        return self.phase in FINAL

    @property
    def held_by_block(self) -> bool:
        """Whether it holds because new information blocks the course, and for no other reason."""
        return self.phase is Phase.HOLDING and self._machine.interruption.waits_for_way

    @property
    def blocked_s(self) -> float | None:
        """Curve time from which what is known blocks the course; None: nowhere, or no course is flown."""
        return self._ways.blocked_s

    def asks_home(self) -> FindWay | None:
        """The way home from here, that its length may be known before it is needed; None: it is not out there."""
        outward = self.phase in (*OUTWARD, Phase.AUTO_MISSION, Phase.AUTO_HOLD)
        home_m, state = self._vehicle.home_m, self.state
        if not outward or home_m is None or state is None:
            return None
        place_m = self._landing.place(home_m, state.position_enu_m) or home_m
        return FindWay(Goal.HOME, state.position_enu_m, self._landing.above(place_m))

    def spare_fraction(self, curve: Trajectory, from_s: float, now_s: float) -> float:
        """Charge beyond what the way home needs, where it is least on a curve that would be flown; infinite: unknown.

        Args:
            curve: On the course's time axis.
            from_s: Curve time from which on it would be flown, at or after the course's present one.
            now_s: Flight clock.
        """
        consumption, course, rate = self._vehicle.consumption, self.course, self._keeper.least_rate
        if consumption is None or course is None:
            return float("inf")
        begins_in_s = max(0.0, from_s - course.at(now_s).curve_s) / rate
        return self.monitors.spare_fraction(curve, from_s, begins_in_s, self._vehicle.home_m, consumption, rate)

    def consequence(self) -> str:
        """What becomes of the landing with what is known now, where it does not stay as it was; empty: it does."""
        if self._vehicle.home_m is None or self.state is None:
            return ""
        return self._landing.consequence(self._vehicle.home_m, self.state)

    def receive(self, event: Event, now_s: float) -> list[Action]:
        """Take in what happened.

        Args:
            event: What happened.
            now_s: When, on the flight clock.

        Returns:
            What to do about it, in order.
        """
        match event:
            case VehicleState():
                self._hearing.hear(event, now_s)
            case Waiting():
                self._link.heard(now_s)
                self._hearing.waits(event.waiting_for)
            case StatusText():
                self._machine.say(f"{VEHICLE_SAYS}{event.text}", warning=event.severity <= 4)
            case Connected():
                self._link.heard(now_s)
                self._fire(Trigger.CONNECTED, now_s)
            case Checked():
                self._checked(event, now_s)
            case CommandDone():
                self._command_done(event, now_s)
            case WayFound():
                self._way_found(event, now_s)
            case WayHome():
                self._hearing.proven_home = ProvenHome(event.from_m, event.duration_s)
            case NewCourse():
                self._new_course(event.trajectory, now_s)
            case NoWayRound():
                if self.held_by_block:
                    self._fire(Trigger.NO_WAY, now_s)
            case Stalled():
                self._stalled(event.course, now_s)
            case StreamFailed():
                self._fire(Trigger.STREAM_FAILED, now_s)
            case StreamLate():
                self._link.missed(now_s)
            case MissionProgress():
                self._ways.reached = event.reached
                if self.phase is Phase.AUTO_MISSION and self._ways.mission_done:
                    self._arrivals.end_exploration(now_s)
            case Operator():
                self._operate(event, now_s)
        # Whatever has begun now, it must not lead into what is known.
        self._ways.watch(now_s)
        return self._machine.drain()

    def tick(self, now_s: float) -> list[Action]:
        """Let time pass: silence, ends of curves, time-outs, orders that are due.

        Args:
            now_s: Flight clock.

        Returns:
            What to do, in order.
        """
        self._watch_link(now_s)
        self._ways.watch(now_s)
        self._arrivals.watch(now_s)
        keeper = self._keeper
        limit = limit_s(
            self.phase, self.assignment, keeper.exploration, keeper.course, self._patience, keeper.least_rate
        )
        if self._machine.stay.lasted_s(now_s) > limit:
            self._fire(Trigger.TIMED_OUT, now_s)
        if (order := self._order.due(self._machine.stay, self._vehicle, now_s)) is not None:
            self._machine.act(order)
        return self._machine.drain()

    def explored_s(self, now_s: float) -> float:
        """Curve time of the exploration up to which it was flown."""
        if self.phase is Phase.FOLLOWING and self.course is not None:
            return min(self.course.at(now_s).curve_s, self.exploration.end_s)
        if self.explored:
            return self.exploration.end_s
        return self._keeper.rejoin_s if (passed_s := self._passed_s()) is None else passed_s

    def _passed_s(self) -> float | None:
        """Curve time at the last item that a vehicle reached which flies an uploaded mission; None: it reached none."""
        times_s, past_the_last = self.assignment.item_times_s, self._ways.past_the_last
        if past_the_last is None or not times_s:
            return None
        index = min(max(past_the_last + len(times_s) - 1, 0), len(times_s) - 1)
        planned, flown = self.assignment.exploration, self.exploration
        slower = flown.knot_interval_s / planned.knot_interval_s
        return flown.start_s + (times_s[index] - planned.start_s) * slower

    def _fire(self, trigger: Trigger, now_s: float) -> bool:
        return self._machine.fire(trigger, now_s)

    # What is said: by the vehicle about its orders, by the operator, checks, ways, replans, the stream's own watchdog.

    def _command_done(self, done: CommandDone, now_s: float) -> None:
        if self._order.answered(done, self.phase, now_s):
            did_not = "did not" if done.answered else "has not answered to"
            self._machine.say(f"the vehicle {did_not} {done.command.value}: {done.reason}", warning=True)
        if self.phase is Phase.VEHICLE_RETURN and self._order.refused:
            self._fire(Trigger.TIMED_OUT, now_s)

    def _operate(self, wish: Operator, now_s: float) -> None:
        match wish:
            case Operator.PAUSE:
                heeded = self._machine.pause(now_s)
            case Operator.RESUME:
                heeded = self._machine.resume(now_s)
            case _:
                heeded = self._fire(Trigger[wish.name], now_s)
        if not heeded:
            self._machine.say(f"{wish.value}: nothing to do while {self.phase.value}")

    def _checked(self, checked: Checked, now_s: float) -> None:
        for problem in checked.problems:
            self._machine.say(problem, warning=True)
        for note in checked.notes:
            self._machine.say(note)
        if checked.exploration is not None:
            self._keeper.exploration = checked.exploration
        if checked.limits is not None:
            self._keeper.keep_to(checked.limits)
        if checked.energy is not None:
            self._hearing.monitors = dataclasses.replace(self.monitors, energy=checked.energy)
        self._ways.places = checked.places
        self._fire(Trigger.CHECKS_FAILED if checked.problems else Trigger.CHECKS_PASSED, now_s)

    def _way_found(self, found: WayFound, now_s: float) -> None:
        if self.phase not in GOAL or found.asked != self._machine.wanted:
            return
        if found.trajectory is None or not self._keeper.begins_here(found.trajectory):
            reason = found.reason or "the one that was found begins elsewhere"
            self._machine.say(f"no proven way: {reason}", warning=True)
            self._fire(Trigger.NO_WAY, now_s)
            return
        self._keeper.way = found.trajectory

    def _new_course(self, trajectory: ProvenTrajectory, now_s: float) -> None:
        course = self.course
        if course is None:
            return
        if self.held_by_block and course.stands(now_s) and self._keeper.begins_here(trajectory):
            self._keeper.begin_anew(trajectory, now_s)
            self._fire(Trigger.UNBLOCKED, now_s)
        elif self.phase is Phase.FOLLOWING and course.at(now_s).curve_s < trajectory.start_s:
            if blocks(course.curves, course.at(now_s).curve_s, trajectory.start_s, self._known()):
                self._machine.say("a new plan begins behind what blocks the course and was dropped")
                return
            self._keeper.go_over(course, trajectory, now_s)
            self._machine.stream()
        else:
            self._machine.say("a new plan came too late and was dropped")

    def _stalled(self, course: Course, now_s: float) -> None:
        if self.course is not None and self.course.legs is course.legs:
            # Whatever the flight did meanwhile: there the stream stands.
            self._keeper.course = course
        if self.phase in ON_COURSE:
            self._fire(Trigger.STALLED, now_s)
        elif self.phase in GOAL:
            self._machine.seek_way(now_s)
        else:
            self._machine.stream()

    # What time brings.

    def _watch_link(self, now_s: float) -> None:
        match self._link.silence(self.phase, now_s):
            case Silence.LOST:
                self._fire(Trigger.LINK_LOST, now_s)
            case Silence.GIVEN_UP:
                self._machine.say("not heard for long: no more setpoints, and it is told to return", warning=True)
                self._machine.stop_stream()
                self._machine.act(Order(Command.RETURN))
            case Silence.GONE:
                self._fire(Trigger.LINK_GONE, now_s)
            case None:
                pass
