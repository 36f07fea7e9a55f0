"""The flight executive: a state machine without clocks, sockets or threads.

Events come in with the moment they happened; actions come out. `mission.phases.TABLE` says which phase follows
which, `mission.monitors` what telemetry alarms at, `mission.readings` what it means; this file turns what is heard
into triggers, takes the table's rows, and says what is done on entering a phase. All times are seconds of the flight
clock: the vehicle's time, made continuous.
"""

from __future__ import annotations

from mission import readings
from mission.course import Course, vector
from mission.events import (
    Action,
    Assignment,
    Checked,
    Connected,
    CourseBlocked,
    Entered,
    Event,
    FindWay,
    FlightEnd,
    FlightMethod,
    Goal,
    NewCourse,
    Operator,
    Order,
    RunChecks,
    Say,
    Stalled,
    Stream,
    WayFound,
)
from mission.monitors import Alarm, Consumption, Monitors
from mission.phases import AIRBORNE, FINAL, LIMIT_S, ON_COURSE, STREAMING, Phase, Trigger, next_phase, order_of
from planner.trajectory import Trajectory
from sim_bridge.state import (
    Command,
    CommandDone,
    FlightMode,
    LandedState,
    MissionProgress,
    StatusText,
    Vector,
    VehicleState,
    Waiting,
)

LINK_LOST_S = 1.5
LINK_GIVEN_UP_S = 10.0
LINK_GONE_S = 60.0
STREAM_FIRST_S = 1.0
"""A vehicle must hear setpoints for this long before it is asked to follow them."""
RETRY_S = 2.0
ANSWER_S = 15.0
"""A command is answered within this, one way or the other; after it, it is asked again."""
RECOVERED_S = 2.0
RECOVERIES = 3
REJOINS = 3
DISARM_AFTER_S = 5.0
BLOCKED_RESERVE_S = 1.0
ALARM_INTERVAL_S = 0.1

_ALARM_TRIGGER = {
    Alarm.OUTSIDE: Trigger.OUTSIDE,
    Alarm.BATTERY_LOW: Trigger.BATTERY_LOW,
    Alarm.TOO_CLOSE: Trigger.TOO_CLOSE,
    Alarm.OFF_TRACK: Trigger.OFF_TRACK,
}

_GOAL = {
    Phase.ENTERING: Goal.EXPLORATION,
    Phase.TAKING_BACK: Goal.HOME,
    Phase.TURNING_BACK: Goal.HOME,
}
"""Where the way leads that is sought in a phase."""

_PASSES = (Trigger.TOO_CLOSE, Trigger.OFF_TRACK, Trigger.STALLED)
"""What may pass by itself while holding."""


class Executive:
    """Runs the table.

    Args:
        assignment: What to fly.
        monitors: What telemetry is held against.
        now_s: Flight clock at the beginning.
        from_s: Curve time at which the exploration begins, where a part of it was flown before.
        patience: Flight seconds a host second: a link lives in the host's time, however fast a simulator's runs.
    """

    def __init__(
        self,
        assignment: Assignment,
        monitors: Monitors,
        now_s: float = 0.0,
        from_s: float | None = None,
        patience: float = 1.0,
    ) -> None:
        self._patience = max(1.0, patience)
        self.assignment = assignment
        self.monitors = monitors
        self.phase = Phase.CONNECTING
        self.why = "started"
        self.state: VehicleState | None = None
        self.home_m: Vector | None = None
        self.course: Course | None = None
        self.exploration = assignment.exploration
        self.rejoin_s = assignment.exploration.start_s if from_s is None else from_s
        self.explored = False
        self.offboard_lost = 0
        self._entered_s = now_s
        self._heard_s = now_s
        self._stated_s = now_s
        self._before = Phase.CONNECTING
        self._held_from = Phase.FOLLOWING
        self._blind_from = Phase.FOLLOWING
        self._held_for: Trigger | None = None
        self._mode_before = FlightMode.OTHER
        self._ordered_s: float | None = None
        self._taken_s: float | None = None
        self._order_open = False
        self._refusal = ""
        self._way: Trajectory | None = None
        self._blocked_s: float | None = None
        self._consumption: Consumption | None = None
        self._recoveries = 0
        self._rejoins = 0
        self._calm_since_s: float | None = None
        self._alarmed_s = now_s
        self._grounded_since_s: float | None = None
        self._told_to_return = False
        self._last_item: int | None = None
        self._reached: int | None = None
        self._waiting_for: tuple[str, ...] = ()
        self._actions: list[Action] = []

    @property
    def finished(self) -> bool:
        """Whether the flight has ended."""
        return self.phase in FINAL

    @property
    def airborne(self) -> bool:
        """Whether the vehicle flies under our control."""
        return self.phase in AIRBORNE

    @property
    def held_by_block(self) -> bool:
        """Whether it holds because new information blocks the course."""
        return self.phase is Phase.HOLDING and self._held_for is Trigger.BLOCKED

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
                self._hear(event, now_s)
            case Waiting():
                self._heard_s = now_s
                self._tell_waiting(event.waiting_for)
            case StatusText():
                self._say(f"vehicle: {event.text}", warning=event.severity <= 4)
            case Connected():
                self._heard_s = now_s
                self._fire(Trigger.CONNECTED, now_s)
            case Checked():
                for problem in event.problems:
                    self._say(problem, warning=True)
                for note in event.notes:
                    self._say(note)
                if event.exploration is not None:
                    self.exploration = event.exploration
                self._last_item = event.last_item
                aloft = self.state is not None and self.state.aloft
                passed = Trigger.CHECKS_PASSED_ALOFT if aloft else Trigger.CHECKS_PASSED
                self._fire(Trigger.CHECKS_FAILED if event.problems else passed, now_s)
            case CommandDone():
                self._command_done(event, now_s)
            case WayFound():
                self._way_found(event, now_s)
            case NewCourse():
                self._new_course(event.trajectory, now_s)
            case CourseBlocked():
                self._blocked_s = event.curve_s
                self._say(f"the course is blocked ahead: {event.reason}", warning=True)
            case Stalled():
                self._stalled(event.course, now_s)
            case MissionProgress():
                self._reached, last = event.reached, self._last_item
                done = self._reached is not None and last is not None and self._reached >= last
                if self.phase is Phase.AUTO_MISSION and done:
                    self._end_exploration(now_s)
            case Operator():
                self._operate(event, now_s)
        return self._drain()

    def tick(self, now_s: float) -> list[Action]:
        """Let time pass: time-outs, ends of curves, orders that are due.

        Args:
            now_s: Flight clock.

        Returns:
            What to do, in order.
        """
        self._watch_link(now_s)
        self._watch_course(now_s)
        if now_s - self._entered_s > self._limit_s():
            self._fire(Trigger.TIMED_OUT, now_s)
        self._give_order(now_s)
        return self._drain()

    def explored_s(self, now_s: float) -> float:
        """Curve time of the exploration up to which it was flown."""
        if self.phase is Phase.FOLLOWING and self.course is not None:
            return min(self.course.at(now_s).curve_s, self.exploration.end_s)
        if self._last_item and self._reached is not None and not self.explored:
            return self.exploration.end_s * min(1.0, self._reached / self._last_item)
        return self.exploration.end_s if self.explored else self.rejoin_s

    # What is heard.

    def _hear(self, state: VehicleState, now_s: float) -> None:
        self.state = state
        self._heard_s = self._stated_s = now_s
        self._measure(state, now_s)
        match self.phase:
            case Phase.CONNECTING | Phase.WAITING_READY:
                self._fire(Trigger.CONNECTED, now_s)
                self._tell_waiting(state.waiting_for)
                if state.ready or state.aloft:
                    self._fire(Trigger.READY, now_s)
            case Phase.BLIND:
                trigger = readings.heard_again(state, self._told_to_return, self._rejoins < REJOINS)
                self._rejoins += trigger is Trigger.LINK_BACK_HOLDING
                self.offboard_lost += trigger is not Trigger.LINK_BACK
                self._fire(trigger, now_s)
            case _:
                self._watch_motors(state, now_s)
                self._watch_mode(state, now_s)
                self._watch_alarms(state, now_s)

    def _measure(self, state: VehicleState, now_s: float) -> None:
        if state.home_enu_m is not None:
            self.home_m = state.home_enu_m
        elif self.phase is Phase.ARMING and not state.armed:
            self.home_m = state.position_enu_m
        if not self.airborne or state.battery_fraction is None:
            return
        energy = self.monitors.energy
        if self._consumption is None:
            self._consumption = Consumption.begin(state.battery_fraction, now_s, energy)
        self._consumption = self._consumption.observed(state.battery_fraction, now_s, energy)

    def _watch_motors(self, state: VehicleState, now_s: float) -> None:
        grounded = state.landed is LandedState.ON_GROUND
        if not grounded:
            self._grounded_since_s = None
        elif self._grounded_since_s is None:
            self._grounded_since_s = now_s
        settled = now_s - self._entered_s > readings.MODE_GRACE_S
        if self.phase is Phase.ARMING and state.armed:
            self._fire(Trigger.ARMED, now_s)
        elif not state.armed and (settled or self.phase is not Phase.TAKING_OFF):
            self._fire(Trigger.DISARMED, now_s)

    def _climbed(self, state: VehicleState, now_s: float) -> bool:
        """Go on from the take-off, if it is done; PX4 then holds, which anywhere else is somebody else's doing."""
        if self.phase is not Phase.TAKING_OFF or now_s - self._entered_s <= STREAM_FIRST_S:
            return False
        ground_up_m = self.home_m[2] if self.home_m is not None else 0.0
        if not readings.at_altitude(state, ground_up_m, self.assignment.takeoff_altitude_m):
            return False
        by_mission = self.assignment.method is FlightMethod.MISSION
        return self._fire(Trigger.AT_ALTITUDE_MISSION if by_mission else Trigger.AT_ALTITUDE, now_s)

    def _watch_mode(self, state: VehicleState, now_s: float) -> None:
        if self._climbed(state, now_s):
            return
        # An order that was not taken yet leaves the mode as it was.
        due_s = self._taken_s if order_of(self.phase) is not None else self._entered_s
        settled = due_s is not None and now_s - due_s > readings.MODE_GRACE_S
        if not readings.mode_is_ours(self.phase, self._before, self._mode_before, settled, state):
            self.offboard_lost += readings.counts_as_lost_stream(self.phase)
            self._say(f"the mode is {state.mode_name}, which was not asked for here", warning=True)
            self._fire(readings.taken_over_by(state), now_s)
            return
        command = order_of(self.phase)
        if self.phase not in STREAMING and self.course is not None and command and readings.obeyed(command, state):
            # Setpoints go on until the vehicle has taken the mode that does without them.
            self._stop_stream()
        if self.phase is Phase.HANDING_OVER and state.mode is FlightMode.HOLD:
            self._fire(Trigger.MODE_TAKEN, now_s)

    def _watch_alarms(self, state: VehicleState, now_s: float) -> None:
        if self.phase not in AIRBORNE or self.phase is Phase.LANDING or now_s - self._alarmed_s < ALARM_INTERVAL_S:
            return
        self._alarmed_s = now_s
        point = self.course.at(now_s) if self.course is not None and self.phase in STREAMING else None
        alarms = self.monitors.alarms(state, self.home_m, self._consumption, point)
        for alarm in alarms:
            if self._fire(_ALARM_TRIGGER[alarm], now_s):
                return
        if self.phase is Phase.HOLDING and self._held_for in _PASSES:
            self._recover(bool({Alarm.TOO_CLOSE, Alarm.OFF_TRACK} & set(alarms)), now_s)

    def _recover(self, alarmed: bool, now_s: float) -> None:
        stands = self.course is not None and self.course.stands(now_s)
        if alarmed or not stands:
            self._calm_since_s = None
        elif self._calm_since_s is None:
            self._calm_since_s = now_s
        elif now_s - self._calm_since_s >= RECOVERED_S:
            self._recoveries += 1
            self._fire(Trigger.GIVEN_UP if self._recoveries > RECOVERIES else Trigger.RECOVERED, now_s)

    def _operate(self, wish: Operator, now_s: float) -> None:
        if wish is Operator.RESUME and self.held_by_block:
            self._say("the course is blocked: it goes on when a new one is proven", warning=True)
        elif not self._fire(Trigger[wish.name], now_s):
            self._say(f"{wish.value}: nothing to do while {self.phase.value}")

    def _command_done(self, done: CommandDone, now_s: float) -> None:
        if done.command in (order_of(self.phase), Command.DISARM):
            self._order_open = False
            self._ordered_s = now_s
            self._taken_s = now_s if done.accepted else None
        if done.accepted or done.reason == self._refusal:
            return
        self._refusal = done.reason
        self._say(f"the vehicle did not {done.command.value}: {done.reason}", warning=True)
        if done.command is Command.RETURN and self.phase is Phase.VEHICLE_RETURN:
            self._fire(Trigger.TIMED_OUT, now_s)

    def _way_found(self, found: WayFound, now_s: float) -> None:
        wanted = _GOAL.get(self.phase)
        if found.goal is not wanted:
            return
        if found.trajectory is None:
            self._say(f"no proven way: {found.reason}", warning=True)
            self._fire(Trigger.NO_WAY, now_s)
        self._way = found.trajectory

    def _new_course(self, trajectory: Trajectory, now_s: float) -> None:
        if self.course is None:
            return
        if self.held_by_block and self.course.stands(now_s):
            self.exploration = trajectory
            self.course = self._begin(trajectory, now_s, None)
            self._blocked_s = None
            self._fire(Trigger.UNBLOCKED, now_s)
        elif self.phase is Phase.FOLLOWING and self.course.at(now_s).curve_s < trajectory.start_s:
            self.exploration = trajectory
            self.course = self.course.continued(trajectory, now_s)
            self._blocked_s = None
            self._actions.append(Stream(self.course))
        else:
            self._say("a new plan came too late and was dropped")

    def _stalled(self, course: Course, now_s: float) -> None:
        if self.phase in ON_COURSE:
            self.course = course
            self._fire(Trigger.STALLED, now_s)
        else:
            self._actions.append(Stream(self.course))

    # What time brings.

    def _watch_link(self, now_s: float) -> None:
        silent_s = (now_s - self._stated_s) / self._patience
        if self.phase in STREAMING and silent_s > LINK_LOST_S:
            self._fire(Trigger.LINK_LOST, now_s)
        elif self.phase is Phase.BLIND and silent_s > LINK_GIVEN_UP_S and not self._told_to_return:
            self._told_to_return = True
            self._say("not heard for long: no more setpoints, and it is told to return", warning=True)
            self._stop_stream()
            self._actions.append(Order(Command.RETURN))
        elif (now_s - self._heard_s) / self._patience > LINK_GONE_S:
            self._fire(Trigger.LINK_GONE, now_s)

    def _watch_course(self, now_s: float) -> None:
        course = self.course
        if course is None:
            return
        if self.phase in (Phase.ENTERING, Phase.TAKING_BACK, Phase.TURNING_BACK):
            follows = self.state is not None and self.state.mode is FlightMode.EXTERNAL
            streamed = now_s - self._entered_s >= STREAM_FIRST_S or self.phase is Phase.TURNING_BACK
            if follows and streamed and self._way is not None and course.stands(now_s):
                self._fire(Trigger.UNDER_CONTROL, now_s)
        elif self.phase in ON_COURSE and self._blocked_s is not None and self._must_brake(course, now_s):
            self._fire(Trigger.BLOCKED, now_s)
        elif self.phase is Phase.FOLLOWING and course.finished(now_s):
            self._end_exploration(now_s)
        elif self.phase in ON_COURSE and course.finished(now_s):
            self._fire(Trigger.ARRIVED, now_s)

    def _must_brake(self, course: Course, now_s: float) -> bool:
        """Whether braking must begin now to stand well before what is blocked."""
        return self._blocked_s is not None and course.braking(now_s).stop_s() >= self._blocked_s - BLOCKED_RESERVE_S

    def _end_exploration(self, now_s: float) -> None:
        self.explored = True
        match self.assignment.end:
            case FlightEnd.RETURN:
                self._fire(Trigger.EXPLORED, now_s)
            case FlightEnd.LAND:
                self._fire(Trigger.EXPLORED_LAND, now_s)
            case FlightEnd.HOLD:
                self._fire(Trigger.EXPLORED_HOLD, now_s)

    def _limit_s(self) -> float:
        match self.phase:
            case Phase.TAKING_OFF:
                return 3.0 * self.assignment.takeoff_altitude_m / self.assignment.max_climb_mps + 60.0
            case Phase.TRANSIT | Phase.RETURNING | Phase.FOLLOWING if self.course is not None:
                return 2.0 * self.course.trajectory.duration_s + 60.0 + self.exploration.end_s
            case Phase.AUTO_MISSION:
                return 3.0 * self.exploration.duration_s + 300.0
            case Phase.WAITING_READY:
                return self.assignment.ready_timeout_s * self._patience
            case Phase.CONNECTING | Phase.CHECKING:
                return LIMIT_S[self.phase] * self._patience
            case phase:
                return LIMIT_S.get(phase, float("inf"))

    def _give_order(self, now_s: float) -> None:
        command = order_of(self.phase)
        if command is None or self.state is None:
            return
        grounded_s = 0.0 if self._grounded_since_s is None else now_s - self._grounded_since_s
        if self.phase in (Phase.LANDING, Phase.VEHICLE_RETURN) and grounded_s > DISARM_AFTER_S:
            command = Command.DISARM
        if command is Command.FOLLOW_SETPOINTS and now_s - self._entered_s < STREAM_FIRST_S:
            return
        wait_s = ANSWER_S * self._patience if self._order_open else RETRY_S
        recent = self._ordered_s is not None and now_s - self._ordered_s < wait_s
        if recent or readings.obeyed(command, self.state):
            return
        self._order_open, self._ordered_s = True, now_s
        altitude = self.assignment.takeoff_altitude_m if command is Command.TAKE_OFF else None
        self._actions.append(Order(command, altitude))

    # What a phase begins with.

    def _fire(self, trigger: Trigger, now_s: float) -> bool:
        row = next_phase(self.phase, trigger)
        if row is None:
            return False
        goto = row.goto
        if goto is None:
            goto = self._blind_from if self.phase is Phase.BLIND else self._held_from
        elif goto is Phase.BLIND:
            self._blind_from = self.phase
        elif goto is Phase.HOLDING:
            self._held_from, self._held_for = self.phase, trigger
        if self.phase is Phase.FOLLOWING and self.course is not None:
            # Where the exploration goes on: where braking from here comes to a standstill.
            self.rejoin_s = min(self.course.braking(now_s).stop_s(), self.exploration.end_s)
        self._before, self.phase, self.why = self.phase, goto, row.why
        self._entered_s = now_s
        self._mode_before = self.state.mode if self.state is not None else FlightMode.OTHER
        self._ordered_s, self._taken_s, self._order_open, self._refusal = None, None, False, ""
        self._actions.append(Entered(goto, row.why))
        self._enter(goto, now_s)
        return True

    def _enter(self, phase: Phase, now_s: float) -> None:
        match phase:
            case Phase.CHECKING:
                self._actions.append(RunChecks())
            case Phase.ENTERING:
                self._seek_way(Goal.EXPLORATION, now_s)
            case Phase.TURNING_BACK | Phase.TAKING_BACK:
                self._seek_way(Goal.HOME, now_s)
            case Phase.TRANSIT | Phase.FOLLOWING | Phase.RETURNING:
                self._go(now_s)
            case Phase.HOLDING | Phase.BLIND:
                self._calm_since_s, self._told_to_return = None, False
                self._brake(now_s)
            case Phase.LANDING | Phase.VEHICLE_RETURN | Phase.HANDING_OVER:
                self._brake(now_s)
            case Phase.OVERRIDDEN | Phase.ABORTED | Phase.LANDED | Phase.HANDED_OVER:
                self._stop_stream()
            case _:
                pass

    def _seek_way(self, goal: Goal, now_s: float) -> None:
        self._way = None
        if self.course is not None and self._before in STREAMING:
            self._brake(now_s)
        elif self.state is not None:
            self.course = Course.standing(self.state.position_enu_m, now_s, self.state.yaw_enu_rad)
            self._actions.append(Stream(self.course))
        assert self.course is not None, "a way is only sought where the vehicle has been heard"
        if goal is Goal.EXPLORATION:
            end = vector(self.exploration.motion_at(self.rejoin_s).position_m)
        elif self.home_m is not None:
            east, north, up = self.home_m
            end = (east, north, up + self.assignment.takeoff_altitude_m)
        else:
            self._say("the vehicle has not told where its home is", warning=True)
            self._fire(Trigger.NO_WAY, now_s)
            return
        self._actions.append(FindWay(goal, self.course.stop_position(), end))

    def _go(self, now_s: float) -> None:
        """Follow the way that was found, begin the exploration, or take up what was interrupted."""
        if self.phase is Phase.FOLLOWING and self._before is Phase.TRANSIT:
            self.course = self._begin(self.exploration, now_s, self.rejoin_s)
        elif self._before in _GOAL and self._way is not None:
            self.course = self._begin(self._way, now_s, None)
            self._blocked_s = None
        elif self._held_for is not Trigger.BLOCKED and self.course is not None:
            self.course = self.course.resuming(now_s)
        self._held_for = None
        self._actions.append(Stream(self.course))

    def _begin(self, trajectory: Trajectory, now_s: float, from_s: float | None) -> Course:
        yaw = self.course.at(now_s).yaw_rad if self.course is not None else 0.0
        limits = self.assignment
        return Course.begin(
            trajectory, now_s, yaw, limits.max_acceleration_mps2, limits.max_yaw_rate_radps, from_s=from_s
        )

    def _brake(self, now_s: float) -> None:
        if self.course is not None:
            self.course = self.course.braking(now_s)
            self._actions.append(Stream(self.course))

    def _stop_stream(self) -> None:
        self.course = None
        self._actions.append(Stream(None))

    def _tell_waiting(self, waiting_for: tuple[str, ...]) -> None:
        if waiting_for and waiting_for != self._waiting_for and self.phase is Phase.WAITING_READY:
            self._say("waiting for " + ", ".join(waiting_for))
            self._waiting_for = waiting_for

    def _say(self, text: str, warning: bool = False) -> None:
        self._actions.append(Say(text, warning))

    def _drain(self) -> list[Action]:
        actions, self._actions = self._actions, []
        return actions
