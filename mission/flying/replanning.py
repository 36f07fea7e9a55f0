"""Replanning beside the flight: a process of its own, so that no solve can ever stall a setpoint.

The flight asks with the problem of what is left and the candidates to start from; the answer is a plan and what staying
on the course is worth. Whether the plan is taken is decided here too, but on the flight's side: it must pass the gate
against what the flight knows *now*, continue the course exactly, at a moment that still lies ahead, be no worse, and
leave the charge that the way home needs from everywhere on it.
"""

from __future__ import annotations

import dataclasses
import multiprocessing
import os
import queue
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from jaxtyping import Float

from mission.executive.course import Course
from mission.executive.lookout import blocks
from mission.flying.belief import after
from planner import gate
from planner.gate import ProvenTrajectory
from planner.plan import Plan
from planner.problem import Options, Problem
from planner.trajectory import Trajectory

_NICE = 15
"""The flight comes first: with it the other process gets a thirtieth of a core that both want."""
# A solve takes as long as the last ones did, and sometimes longer.
_LEAD_SHARE = 1.5
_LEAD_RESERVE_HOST_S = 0.3
_REMEMBERED = 4
_FIRST_LEAD_HOST_S = 2.0
_CONTINUES = 1e-4
_CHARGE_TOLD_TO = 0.01
HUNG_HOST_S = 180.0
"""A solve has its own time limit of seconds; only a compiler on a busy machine takes minutes."""


@dataclasses.dataclass(frozen=True)
class Request:
    """What the other process is asked.

    Attributes:
        number: Counts the requests; 0: the answer is not needed, only that the solver has compiled what it takes.
        problem: What is left, as if nothing had been flown.
        flown_m: What was flown, and will be until the switch: `belief.INTERVAL_S` each.
        options: How to solve it.
        warm_start: Curves to start from.
        staying: The course from the switch on; None: there is none to stay on.
        switch_s: Curve time at which the new plan takes over.
        time_limit_s: Time for the solve.
        flown_yaw_rad: Headings where it was flown; None: they do not count.
    """

    number: int
    problem: Problem
    flown_m: Float[np.ndarray, "time 3"]
    options: Options
    warm_start: tuple[Trajectory, ...]
    staying: Trajectory | None
    switch_s: float
    time_limit_s: float
    flown_yaw_rad: Float[np.ndarray, "time"] | None = None


@dataclasses.dataclass(frozen=True)
class Reply:
    """What came of it.

    Attributes:
        request: What was asked.
        plan: The set; None: the solver could not be used.
        staying_objective: `Candidate.objective` of the whole flight when nothing changes; infinite where it cannot.
        solve_s: Host time it took.
        failure: Why there is no plan.
    """

    request: Request
    plan: Plan | None
    staying_objective: float
    solve_s: float
    failure: str = ""


Solve = Callable[[Request], Reply]


def answer(request: Request) -> Reply:
    """Solve a request; runs in the other process."""
    from planner.judging import Judge
    from planner.solver import solve

    began_s = time.monotonic()
    deadline_s = began_s + request.time_limit_s
    try:
        problem = after(request.problem, request.flown_m, request.options.modes, request.flown_yaw_rad)
        plan = solve(
            problem,
            request.options,
            warm_start=request.warm_start,
            time_left_s=lambda: deadline_s - time.monotonic(),
        )
    except (ValueError, FloatingPointError) as error:
        return Reply(request, None, float("inf"), time.monotonic() - began_s, str(error))
    staying = float("inf")
    if request.staying is not None:
        curve = request.staying
        count = 4 * curve.segments
        middles = request.switch_s + (np.arange(count) + 0.5) / count * (curve.end_s - request.switch_s)
        judge = Judge(problem, request.options)
        staying = judge.objective(curve.sample(middles).position_m, curve.headings_at(middles))
    return Reply(request, plan, staying, time.monotonic() - began_s)


def _serve(connection: Connection, solve: Solve) -> None:
    """The other process: asks for a request, answers it, until the line closes."""
    from mission.planning import keep_compiled

    # Ctrl-C is for the flight, which still has a way to fly then, and so is a terminal that goes away.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    os.nice(_NICE)
    keep_compiled()
    while True:
        try:
            request = connection.recv()
        except EOFError:
            return
        if request is None:
            return
        reply = solve(request)
        try:
            # The flight knows what it asked, and would wait for megabytes of it.
            connection.send((reply.plan, reply.staying_objective, reply.solve_s, reply.failure))
        except BrokenPipeError:
            return


class Replanner:
    """The other process, from the flight's side.

    Args:
        solve: What it runs; a function of a module, as it is sent by name.
    """

    def __init__(self, solve: Solve = answer) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, solve), name="replanning", daemon=True)
        self._process.start()
        theirs.close()
        self._asked: Request | None = None
        self._asked_host_s = 0.0
        self._asking: threading.Thread | None = None
        self._answers: queue.SimpleQueue[tuple[Any, ...] | Exception] = queue.SimpleQueue()
        self._solve_times_s: list[float] = []
        self._warm = False
        self.lost = ""

    @property
    def busy(self) -> bool:
        """Whether an answer is awaited."""
        return self._asked is not None

    @property
    def warm(self) -> bool:
        """Whether it has answered once, so that its code is compiled."""
        return self._warm

    def lead_host_s(self) -> float:
        """Host time from asking until a plan can take over, going by the last answers."""
        if not self._solve_times_s:
            return _FIRST_LEAD_HOST_S
        return _LEAD_SHARE * max(self._solve_times_s) + _LEAD_RESERVE_HOST_S

    def ask(self, request: Request) -> None:
        """Ask; the answer comes by `poll`.

        Raises:
            ValueError: An answer is still awaited.
        """
        if self._asked is not None:
            raise ValueError("a replan is under way: poll until it is answered")
        self._asked, self._asked_host_s = request, time.monotonic()
        # Problem and plan have megabytes, and the pipe takes them as fast as the other side reads and writes.
        self._asking = threading.Thread(target=self._converse, args=(request,), name="asking", daemon=True)
        self._asking.start()

    def _converse(self, request: Request) -> None:
        try:
            self._connection.send(request)
            self._answers.put(self._connection.recv())
        except Exception as error:  # noqa: BLE001 (what cannot be read of an answer is as good as none)
            self._answers.put(error)

    def poll(self) -> Reply | None:
        """The answer, if it is there; a process that died or hangs is given up, which is an answer too."""
        if self._asked is not None and time.monotonic() - self._asked_host_s > HUNG_HOST_S:
            self.lost = f"the replanning process has not answered for {HUNG_HOST_S:.0f} s: it was ended"
            self._process.kill()
        if self._asked is None or (self._answers.empty() and not self.lost):
            return None
        asked, self._asked = self._asked, None
        answered = EOFError() if self.lost else self._answers.get()
        if isinstance(answered, Exception):
            self.lost = self.lost or self._ended(answered)
            return Reply(asked, None, float("inf"), 0.0, self.lost)
        reply = Reply(asked, *answered)
        if asked.number > 0:
            self._solve_times_s = [*self._solve_times_s[-(_REMEMBERED - 1) :], reply.solve_s]
        self._warm = True
        return reply

    def _ended(self, error: Exception) -> str:
        if not isinstance(error, EOFError | OSError):
            return f"the replanning process answered what cannot be read ({type(error).__name__}: {error})"
        self._process.join(0.0)
        return f"the replanning process ended with code {self._process.exitcode}"

    def close(self) -> None:
        """End the process."""
        if self._asking is not None and self._asking.is_alive():
            # It waits for somebody to read what is asked, or to answer; without anybody it gives up.
            self._process.terminate()
            self._asking.join(5.0)
        self._connection.close()
        self._process.join(0.5)
        if self._process.is_alive():
            self._process.terminate()
            self._process.join(5.0)


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Whether a replan is taken.

    Attributes:
        trajectory: The curve that is taken, on the course's time axis; None: the course stays.
        reason: Why, in words.
        objective: `Candidate.objective` of the best candidate offered; infinite where there is none.
        staying_objective: Of the course as it is.
        alternative: Which of the ranked candidates it is, from 0.
    """

    trajectory: ProvenTrajectory | None
    reason: str
    objective: float = float("inf")
    staying_objective: float = float("inf")
    alternative: int = 0


def judge(
    reply: Reply,
    course: Course,
    now_s: float,
    known: Problem,
    spare_fraction: Callable[[Trajectory, float], float],
    *,
    must_leave: bool,
) -> Verdict:
    """Decide whether a replan is taken.

    Args:
        reply: The answer.
        course: What is flown.
        now_s: Flight clock.
        known: What the flight knows now: its obstacles and limits count, not those of the request.
        spare_fraction: Charge left beyond what the way home needs, where it is least on a curve from a curve time on.
        must_leave: Whether the course is not safe to stay on, so that any proven plan is better.

    Returns:
        The verdict; the best proven candidate that meets every condition.
    """
    if reply.plan is None:
        return Verdict(None, reply.failure)
    ranked = reply.plan.ranked()
    if not ranked:
        return Verdict(None, f"nothing feasible: {reply.plan.status.value}")
    request, staying = reply.request, reply.staying_objective
    offered = ranked[0].objective
    if not must_leave and offered > staying:
        return Verdict(None, "staying on the course is better", offered, staying)
    problem = dataclasses.replace(request.problem, obstacles=known.obstacles, limits=known.limits)
    refusal = ""
    # Where the course itself comes short, what comes no shorter is as good.
    enough = -np.inf if must_leave else min(_CHARGE_TOLD_TO, spare_fraction(course.trajectory, request.switch_s))
    for place, candidate in enumerate(ranked):
        if not must_leave and candidate.objective > staying:
            break
        try:
            trajectory = gate.prove(candidate.proven, problem).starting_at(request.switch_s)
        except gate.GateRefused as error:
            refusal = refusal or f"refused by the gate: {error}"
            continue
        if spare_fraction(trajectory, request.switch_s) < enough:
            refusal = refusal or "the charge would not last to its end and home"
            continue
        if course.at(now_s).curve_s >= request.switch_s and not course.stands(now_s):
            return Verdict(None, "it came too late", candidate.objective, staying)
        if gap := discontinuity(course, trajectory):
            return Verdict(None, gap, candidate.objective, staying)
        if not course.stands(now_s) and blocks(course.curves, course.at(now_s).curve_s, request.switch_s, known):
            return Verdict(None, "the course is blocked before it", candidate.objective, staying)
        return Verdict(trajectory, "better", candidate.objective, staying, place)
    return Verdict(None, refusal, offered, staying)


def discontinuity(course: Course, trajectory: Trajectory) -> str:
    """Why a curve does not continue the course; empty: it does."""
    at_rest = course.pace.target_rate == 0.0
    old = course.motion_at(trajectory.start_s)
    new = trajectory.motion_at(trajectory.start_s)
    if at_rest:
        apart = float(np.abs(np.asarray(course.stop_position()) - new.position_m).max())
        moving = float(np.abs(new.velocity_mps).max())
        return "" if max(apart, moving) < _CONTINUES else "it does not begin where the course stands"
    gaps = (
        float(np.abs(old.position_m - new.position_m).max()),
        float(np.abs(old.velocity_mps - new.velocity_mps).max()),
        float(np.abs(old.acceleration_mps2 - new.acceleration_mps2).max()),
    )
    return "" if max(gaps) < _CONTINUES else f"it does not continue the course: gaps of {max(gaps):.2g}"
