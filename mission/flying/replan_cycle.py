"""When to replan, from where, and what comes of it; without clocks, so that it is tested in virtual time.

A new plan takes over at a point of the course that still lies ahead when it arrives: as far ahead as the last solves
took, and some more. Until then the course is flown on, and what it covers on the way is counted as covered.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from jaxtyping import Float

from mission.executive.executive import Executive
from mission.executive.phases import Phase
from mission.flying.belief import INTERVAL_S, Belief, with_length_left
from mission.flying.replanning import Replanner, Reply, Request, Verdict, judge
from planner.gate import ProvenTrajectory
from planner.plan import Plan
from planner.problem import Metric, Options, Problem
from planner.scene import knots_for
from planner.trajectory import Motion, Trajectory, Turning

LEAST_REMAINING_SHARE = 0.05
LEAST_REMAINING_S = 2.0
_ALTERNATIVES = 1
_CANDIDATES = 2
_FAILURES_WHILE_HELD = 3
# A replan has as many knots as the plan, however little is left, so that what was compiled on the ground serves the
# whole flight; only where a share of the exploration is left does it make do with fewer.
_FEWER_BELOW = ((0.35, 2), (0.12, 4))
_FEWEST_SEGMENTS = 16
_SAMPLES_A_SEGMENT = 2
_WARM_UP_SHARES = (1.0, 0.3, 0.1)
# The kernel metric takes more neighbours together the nearer samples lie, which is compiled too.
_KERNEL_WARM_UP_SHARES = (1.0, 0.3, 0.1, 0.36, 0.6, 0.13, 0.2, 0.06)
WARM_UP = 0
"""Number of a request that only makes the solver compile what later ones need."""


@dataclasses.dataclass(frozen=True)
class Schedule:
    """How often, and how long.

    Attributes:
        period_s: Flight time between requests.
        time_limit_host_s: Host time for one solve.
    """

    period_s: float
    time_limit_host_s: float


class ReplanCycle:
    """Asks, waits, judges.

    Args:
        replanner: The other process.
        belief: What is known.
        options: How the mission was planned.
        schedule: How often.
        plan: The plan the flight begins with.
    """

    def __init__(self, replanner: Replanner, belief: Belief, options: Options, schedule: Schedule, plan: Plan) -> None:
        self._replanner = replanner
        self._belief = belief
        self._options = dataclasses.replace(options, candidates=min(_CANDIDATES, options.candidates))
        self._schedule = schedule
        self._alternatives = _curves(plan)
        self._course = plan.best.trajectory
        self._segments, _ = knots_for(belief.problem, options)
        self._to_warm = list(_KERNEL_WARM_UP_SHARES if options.metric is Metric.KERNEL else _WARM_UP_SHARES)
        self._answered = 0
        self._asked_s: float | None = None
        self._number = 0
        self._urgent = False
        self._failed_while_held = 0

    @property
    def warm(self) -> bool:
        """Whether the first replan will not have to wait for a compiler, or never comes."""
        return self._replanner.warm or bool(self._replanner.lost)

    @property
    def lost(self) -> str:
        """Why nobody replans any more; empty: somebody does."""
        return self._replanner.lost

    @property
    def hopeless(self) -> bool:
        """Whether no way round a block will be found: none was, time and again, or nobody seeks one any more."""
        return bool(self._replanner.lost) or self._failed_while_held >= _FAILURES_WHILE_HELD

    def hurry(self) -> None:
        """Something changed: ask as soon as the other process is free."""
        self._urgent = True

    def ask(self, executive: Executive, now_s: float, rate: float) -> Request | None:
        """Ask, if it is time to.

        Args:
            executive: Tells the course and the phase.
            now_s: Flight clock.
            rate: Flight seconds a host second.

        Returns:
            What was asked; None: it is not time.
        """
        if self._replanner.busy or self._replanner.lost:
            return None
        if self._to_warm and (self._answered > 0 or not self._flows(executive)):
            self._answered = 0
            self._replanner.ask(self._warm_up(self._to_warm.pop(0)))
            return None
        due = self._asked_s is None or now_s - self._asked_s >= self._schedule.period_s or self._urgent
        held = executive.held_by_block and executive.course is not None and executive.course.stands(now_s)
        if not due or not (held or self._flows(executive)):
            return None
        request = self._from_standstill(executive) if held else self._from_ahead(executive, now_s, rate)
        problem = None if request is None else with_length_left(request.problem, request.flown_m)
        if held and problem is None:
            self._failed_while_held += 1
        request = None if request is None or problem is None else dataclasses.replace(request, problem=problem)
        if request is not None:
            self._number = request.number
            self._asked_s, self._urgent = now_s, False
            self._replanner.ask(request)
        return request

    def poll(self, executive: Executive, now_s: float) -> tuple[Reply, Verdict] | None:
        """The answer, if it is there, and whether it is taken: any proven plan is better than a course that is blocked.

        Args:
            executive: Tells the course.
            now_s: Flight clock.
        """
        reply = self._replanner.poll()
        if reply is None or reply.request.number == WARM_UP:
            return None
        self._answered += 1
        if executive.course is None or executive.phase not in (Phase.FOLLOWING, Phase.HOLDING):
            return reply, Verdict(None, "the exploration is over")
        held = executive.held_by_block
        must_leave = held or executive.blocked_s is not None
        verdict = judge(
            reply,
            executive.course,
            now_s,
            self._belief.problem,
            functools.partial(executive.spare_fraction, now_s=now_s),
            must_leave=must_leave,
        )
        if verdict.trajectory is not None and reply.plan is not None:
            self._alternatives = tuple(curve.starting_at(reply.request.switch_s) for curve in _curves(reply.plan))
            self._failed_while_held = 0
        elif held:
            self._failed_while_held += 1
        return reply, verdict

    @staticmethod
    def _flows(executive: Executive) -> bool:
        course = executive.course
        return executive.phase is Phase.FOLLOWING and course is not None and course.pace.target_rate > 0.0

    def _warm_up(self, share: float) -> Request:
        """A request of the size that comes when a share of the exploration is left."""
        course = self._course
        switch_s = course.end_s - share * course.duration_s
        start, yaw_rad = course.motion_at(switch_s), course.headings_at(np.array([switch_s]))
        problem = self._left(start, share * course.duration_s, None if yaw_rad is None else Turning(float(yaw_rad[0])))
        # Where poses are remembered, what is compiled has room for them.
        ahead = None if yaw_rad is None else (start.position_m[None], yaw_rad)
        request = self._request(problem, switch_s, None, course, ahead)
        return dataclasses.replace(request, number=WARM_UP)

    def _from_ahead(self, executive: Executive, now_s: float, rate: float) -> Request | None:
        course = executive.course
        assert course is not None, "a replan is only asked for on a course"
        at_s, pace, changing = course.pace.at(now_s)
        if changing != 0.0:
            return None
        switch_s = at_s + self._replanner.lead_host_s() * rate * pace
        remaining_s = executive.exploration.end_s - switch_s
        if remaining_s < max(LEAST_REMAINING_S, LEAST_REMAINING_SHARE * executive.exploration.end_s):
            return None
        if executive.blocked_s is not None and executive.blocked_s <= switch_s:
            # It will stand before that is reached: from there a way on is sought.
            return None
        moments = np.arange(at_s, switch_s, INTERVAL_S * pace)
        ahead = course.positions_at(moments), course.headings_at(moments)
        problem = self._left(course.motion_at(switch_s), remaining_s, course.turning_at(switch_s))
        staying = course.leg_at(switch_s).trajectory
        return self._request(problem, switch_s, staying, course.trajectory, ahead)

    def _from_standstill(self, executive: Executive) -> Request | None:
        course = executive.course
        assert course is not None, "a replan is only asked for on a course"
        switch_s = course.stop_s()
        remaining_s = max(executive.exploration.end_s - switch_s, LEAST_REMAINING_S)
        start = Motion.at_rest(np.asarray(course.stop_position()))
        turning = Turning(course.turning_at(switch_s).yaw_rad)
        return self._request(self._left(start, remaining_s, turning), switch_s, None, course.trajectory)

    def _left(self, start: Motion, remaining_s: float, turning: Turning | None) -> Problem:
        given = turning if self._options.explores_headings else None
        return dataclasses.replace(self._belief.problem, start=start, start_turning=given, duration_s=remaining_s)

    def _request(
        self,
        problem: Problem,
        switch_s: float,
        staying: Trajectory | None,
        current: Trajectory,
        ahead: tuple[Float[np.ndarray, "time 3"], Float[np.ndarray, "time"]] | None = None,
    ) -> Request:
        """A request; `ahead` are the positions and headings on the way to the switch."""
        warm = [from_moment(current, switch_s)]
        warm += [from_moment(curve, switch_s) for curve in self._alternatives if curve is not current][:_ALTERNATIVES]
        flown, yaw_rad = self._belief.flown_m(), self._belief.flown_yaw_rad()
        if ahead is not None:
            flown, yaw_rad = np.concatenate([flown, ahead[0]]), np.concatenate([yaw_rad, ahead[1]])
        return Request(
            self._number + 1,
            problem,
            flown,
            self._options_for(problem),
            tuple(warm),
            staying,
            switch_s,
            self._schedule.time_limit_host_s,
            yaw_rad if self._options.explores_headings else None,
        )

    def _options_for(self, problem: Problem) -> Options:
        """Options that ask for as many knots as the whole exploration has, or a fixed part of them."""
        share = problem.duration_s / max(self._course.duration_s, 1e-9)
        fewer = max([divisor for below, divisor in _FEWER_BELOW if share < below], default=1)
        segments = max(_FEWEST_SEGMENTS, self._segments // fewer)
        return dataclasses.replace(self._options, time_step_s=problem.duration_s / (_SAMPLES_A_SEGMENT * segments))


def _curves(plan: Plan) -> tuple[ProvenTrajectory, ...]:
    return tuple(candidate.proven for candidate in plan.ranked()[1:])


def from_moment(trajectory: Trajectory, curve_s: float) -> Trajectory:
    """The rest of a curve from the knot nearest a moment on: good enough to start a solve from."""
    knot = round((curve_s - trajectory.start_s) / trajectory.knot_interval_s)
    first = int(np.clip(knot, 0, trajectory.segments - 1))
    return trajectory.from_knot(first)
