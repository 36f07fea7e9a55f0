"""The loop of a flight: takes what was heard, lets the executive answer, and acts.

Who runs where: the stream has a thread of its own (`streamer`), the link its own for receiving and for commands
(`sim_bridge.link.client`), replans a process (`replanning`), slow checks a thread here; everything else, the executive
above all, runs in this one loop.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import functools
import queue
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from mission.executive.course import vector
from mission.executive.events import (
    Action,
    Checked,
    Connected,
    Entered,
    Event,
    FindWay,
    NewCourse,
    NoWayRound,
    Operator,
    Order,
    RunChecks,
    Say,
    Stalled,
    Stream,
    StreamFailed,
    StreamLate,
    WayFound,
    Withdraw,
)
from mission.executive.executive import Executive
from mission.executive.phases import STREAMING, Phase
from mission.flying.belief import Belief
from mission.flying.chatter import Chatter
from mission.flying.clock import FlightClock
from mission.flying.flight_progress import Watcher
from mission.flying.ground_jobs import GroundJobs
from mission.flying.home_reckoning import HomeReckoning
from mission.flying.inbox_watch import InboxWatch
from mission.flying.last_orders import give_last_order
from mission.flying.pushes import TakenIn
from mission.flying.recorder import Kept, Recorder
from mission.flying.replan_cycle import ReplanCycle
from mission.flying.standing import Standing
from mission.flying.streamer import Streamer
from planner.gate import ProvenTrajectory
from planner.problem import Problem
from sim_bridge.link.client import Link
from sim_bridge.state import CommandDone, MissionProgress, VehicleState

_WAIT_HOST_S = 0.02


class Ground(Protocol):
    """What the loop needs done that takes longer than a tick."""

    def check(self, state: VehicleState) -> Checked:
        """Check the vehicle before arming."""
        ...

    def find_way(self, wanted: FindWay) -> ProvenTrajectory:
        """A proven way.

        Raises:
            ValueError: There is none.
        """
        ...

    def take_in(self) -> list[TakenIn]:
        """Take in what was pushed since the last call; never called twice at a time."""
        ...


class FlightLoop:
    """One flight.

    Args:
        executive: Decides.
        link: The vehicle.
        clock: The flight clock.
        streamer: The setpoint stream.
        recorder: Writes everything down.
        belief: What is known.
        cycle: Replans; None: the plan is flown as it is.
        ground: Checks, ways, and what is pushed.
        watcher: Told what happens.
    """

    def __init__(
        self,
        executive: Executive,
        link: Link,
        clock: FlightClock,
        streamer: Streamer,
        recorder: Recorder,
        belief: Belief,
        cycle: ReplanCycle | None,
        ground: Ground,
        watcher: Watcher,
    ) -> None:
        self.executive = executive
        self.replans_taken = 0
        self._link = link
        self._clock = clock
        self._streamer = streamer
        self._recorder = recorder
        self._belief = belief
        self._cycle = cycle
        self._ground = ground
        self._watcher = watcher
        self._inbox: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self._kept: queue.SimpleQueue[Callable[[float], None]] = queue.SimpleQueue()
        self._keeping = False
        self._jobs = GroundJobs(self.tell)
        self._reckoning = HomeReckoning(lambda wanted: self._ground.find_way(wanted))
        self._chatter = Chatter()
        self._standing = Standing(executive, recorder, watcher)
        self._interrupts = 0
        self._pushed = InboxWatch(lambda: self._ground.take_in())
        self._planned_for = belief.problem if belief is not None else None
        self._log_broken = False
        self._hung_up = False
        self._replans = True

    def tell(self, event: Event) -> None:
        """Give the flight an event, from any thread."""
        self._inbox.put(event)

    def interrupt(self) -> None:
        """What Ctrl-C means: come back; again: land here; once more: leave it to itself."""
        self._interrupts += 1
        in_its_own_hands = self.executive.phase in (Phase.OVERRIDDEN, Phase.VEHICLE_RETURN, Phase.LANDING)
        if self._interrupts == 1 and not in_its_own_hands:
            self.tell(Operator.RETURN)
        elif self._interrupts == 2 and not in_its_own_hands:
            self.tell(Operator.LAND)
        else:
            self.tell(Operator.LEAVE)

    def hang_up(self) -> None:
        """The terminal is gone: nobody called the flight back, so it flies on."""
        self._hung_up = True

    @property
    def interrupted(self) -> bool:
        """Whether the operator interrupted it."""
        return self._interrupts > 0

    def run(self) -> None:
        """Fly until the flight has ended; what breaks it off is raised once the vehicle has its last order."""
        try:
            self._receive(Connected(), self._clock.now(time.monotonic()))
            while not self.executive.finished:
                self.step(_WAIT_HOST_S)
        except BaseException as error:
            self._break_off(error)
            raise
        finally:
            self._jobs.close()
            self._pushed.close()
            self._reckoning.close()

    def _break_off(self, error: BaseException) -> None:
        """Nothing here is to be relied on any more: end the stream and have the vehicle look after itself."""
        now_s, phase = self._clock.now(time.monotonic()), self.executive.phase
        text = f"the flight broke off while {phase.value}: {type(error).__name__}: {error}"

        def told(done: CommandDone) -> None:
            self._record_answer(done, self._clock.now(time.monotonic()))

        for step in (
            lambda: self._streamer.follow(None),
            lambda: self._recorder.write("say", now_s, text=text, warning=True),
            lambda: self._watcher.say(text, True),
            lambda: give_last_order(self._link, phase, told),
        ):
            # What broke the flight off is raised; what fails on top of it must not keep the vehicle from its order.
            with contextlib.suppress(Exception):
                step()

    def step(self, wait_host_s: float) -> None:
        """Take in what was heard, waiting at most so long for the first of it, and let time pass."""
        self._renew()
        if self._streamer.failed:
            self._receive(StreamFailed(), self._clock.now(time.monotonic()))
        if self._streamer.was_late():
            self._receive(StreamLate(), self._clock.now(time.monotonic()))
        if self._hung_up:
            self._hung_up = False
            self._act([Say("the terminal is gone: the flight goes on", True)], self._clock.now(time.monotonic()))
        self._watch_log()
        for timed in self._link.events(wait_host_s):
            self._hear(timed.event, timed.host_s)
        now_s = self._clock.now(time.monotonic())
        while not self._inbox.empty():
            self._take_in(self._inbox.get(), now_s)
        while not self._kept.empty():
            self._kept.get()(now_s)
        self._take_pushed(now_s)
        self._renew()
        self._act(self.executive.tick(now_s), now_s)
        self._replan(now_s)
        self._reckon_home(now_s)
        self._standing.tell(now_s, self.replans_taken)

    def _renew(self) -> None:
        """Tell the stream that the flight is watched, before anything is decided by where its course would be."""
        if (stalled := self._streamer.renew()) is None:
            return
        now_s = self._clock.now(time.monotonic())
        self._recorder.write("stall", now_s)
        self._act(self.executive.receive(Stalled(stalled), now_s), now_s)

    def _hear(self, event: Event, host_s: float) -> None:
        if not isinstance(event, VehicleState):
            now_s = self._clock.now(host_s)
            if isinstance(event, CommandDone):
                self._record_answer(event, now_s)
            elif isinstance(event, MissionProgress):
                self._recorder.write("item", now_s, reached=event.reached, current=event.current)
            self._receive(event, now_s)
            return
        now_s = self._clock.of(event.time_s)
        executive = self.executive
        target = None
        if executive.course is not None and executive.phase in STREAMING:
            target = vector(executive.course.at(now_s).motion.position_m)
        self._recorder.telemetry(now_s, event, executive.phase.value, target)
        if executive.phase in (Phase.FOLLOWING, Phase.AUTO_MISSION) and event.position_age_s == 0.0:
            self._belief.fly(event.position_enu_m, now_s, event.yaw_enu_rad)
        self._receive(event, now_s)

    def _record_answer(self, done: CommandDone, now_s: float) -> None:
        self._recorder.write("answer", now_s, command=done.command.value, accepted=done.accepted, reason=done.reason)

    def _take_in(self, event: Event, now_s: float) -> None:
        """Take in what was told from another thread."""
        slowed = event.exploration if isinstance(event, Checked) else None
        if slowed is None or slowed is self.executive.exploration:
            self._receive(event, now_s)
        else:
            self._fly_once_kept(slowed, functools.partial(self._take_slowed, event))

    def _take_slowed(self, checked: Event, kept: Kept | None, error: str, now_s: float) -> None:
        if kept is None:
            checked = Checked((f"the slowed course cannot be put on the disk: {error}",))
        else:
            self._recorder.course(now_s, kept, "slowed")
        self._receive(checked, now_s)

    def _receive(self, event: Event, now_s: float) -> None:
        self._renew()
        self._act(self.executive.receive(event, now_s), now_s)

    def _fly_once_kept(self, trajectory: ProvenTrajectory, then: Callable[[Kept | None, str, float], None]) -> None:
        """Have a curve put on the disk, beside this loop; `then` is told when it is there, or why it is not."""

        def done(future: concurrent.futures.Future[Kept]) -> None:
            error = future.exception()
            kept = future.result() if error is None else None
            self._kept.put(functools.partial(then, kept, str(error)))

        self._recorder.keep(trajectory).add_done_callback(done)

    def _act(self, actions: list[Action], now_s: float) -> None:
        for action in actions:
            match action:
                case Stream(course):
                    self._streamer.follow(course)
                case Order(command, altitude_m):
                    self._recorder.write("order", now_s, command=command.value)
                    self._link.request(command, altitude_m)
                case Withdraw():
                    self._link.withdraw()
                case RunChecks():
                    self._jobs.submit(self._check, lambda why: Checked((f"the checks broke off: {why}",)))
                case FindWay():
                    seek = functools.partial(self._find_way, action)
                    self._jobs.submit(seek, functools.partial(WayFound, action, None))
                case Entered(phase, why):
                    self._recorder.write("phase", now_s, phase=phase.value, why=why)
                    self._standing.note(now_s)
                    self._watcher.say(f"{phase.value}: {why}", warning=False)
                case Say(text, warning):
                    self._recorder.write("say", now_s, text=text, warning=warning)
                    if not self._chatter.repeats(text, now_s) or warning:
                        self._watcher.say(text, warning)

    def _watch_log(self) -> None:
        """Tell once when the log cannot be written, and once when it can again; the flight goes on."""
        fault, lost = self._recorder.fault, self._recorder.lost_lines
        if (fault is not None) is self._log_broken:
            return
        self._log_broken = fault is not None
        if fault is not None:
            text = f"the log cannot be written ({fault.strerror}): the flight goes on, what it flies now is not kept"
        else:
            text = f"the log is written again; {lost} lines are lost"
        self._act([Say(text, True)], self._clock.now(time.monotonic()))

    def _check(self) -> Checked:
        state = self.executive.state
        assert state is not None, "the checks come after the vehicle has been heard"
        return self._ground.check(state)

    def _find_way(self, wanted: FindWay) -> WayFound:
        return WayFound(wanted, self._ground.find_way(wanted))

    def _reckon_home(self, now_s: float) -> None:
        """Keep knowing how long the proven way home takes: the charge that it needs is kept for it."""
        if (found := self._reckoning.answer()) is not None:
            self._receive(found, now_s)
        self._reckoning.ask(self.executive.asks_home(), self._belief.problem, now_s, self._clock.rate)

    # Replans and what is pushed.

    def _take_pushed(self, now_s: float) -> None:
        """Tell what was pushed and taken in meanwhile."""
        for one in self._pushed.taken_in():
            if one.said is not None:
                self._act([one.said], now_s)
            if one.wish is not None:
                self._recorder.write("push", now_s, what=str(one.wish))
                self._receive(one.wish, now_s)

    def _replan(self, now_s: float) -> None:
        cycle = self._cycle
        if self._keeping:
            return
        if self.executive.held_by_block and (cycle is None or cycle.hopeless):
            self._receive(NoWayRound(), now_s)
        if cycle is None:
            return
        if cycle.lost and self._replans:
            self._replans = False
            self._act([Say(f"{cycle.lost}: the flight goes on without replans", True)], now_s)
        if self._belief.problem is not self._planned_for:
            self._planned_for = self._belief.problem
            cycle.hurry()
        answered = cycle.poll(self.executive, now_s)
        if answered is not None:
            reply, verdict = answered
            self._recorder.write(
                "replan",
                now_s,
                number=reply.request.number,
                switch_s=reply.request.switch_s,
                solve_s=round(reply.solve_s, 3),
                taken=verdict.trajectory is not None,
                reason=verdict.reason,
                alternative=verdict.alternative,
                objective=_finite(verdict.objective),
                staying_objective=_finite(verdict.staying_objective),
            )
            if verdict.trajectory is not None:
                self._keeping = True
                take = functools.partial(self._take, self._belief.problem)
                self._fly_once_kept(verdict.trajectory, take)
                return
        if (request := cycle.ask(self.executive, now_s, self._clock.rate)) is not None:
            self._recorder.write("asked", now_s, number=request.number, switch_s=request.switch_s)

    def _take(self, known: Problem, kept: Kept | None, error: str, now_s: float) -> None:
        """Fly a new plan that was proven against what was known, now that it is on the disk."""
        self._keeping = False
        if kept is None:
            # What is not on the disk could not be resumed from, so it is not flown.
            self._act([Say(f"a new plan is not flown, as it cannot be put on the disk: {error}", True)], now_s)
            return
        if self._belief.problem is not known:
            self._act([Say("a new plan is not flown: something was learned while it was put on the disk")], now_s)
            return
        before = self.executive.exploration
        self._receive(NewCourse(kept.trajectory), now_s)
        if self.executive.exploration is not before:
            self._recorder.course(now_s, kept, "replan")
            self.replans_taken += 1


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
