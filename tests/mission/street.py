"""A course along a street, replans that leave it, and what they are asked and answered with."""

import dataclasses

import numpy as np

from mission.executive.course import Course
from mission.executive.phases import Phase
from mission.flying.replanning import Reply, Request
from mission.flying.ways import along
from planner.diversity import diversity
from planner.gate import prove
from planner.information import uniform
from planner.obstacles import ObstacleField
from planner.plan import Candidate, Plan, Status
from planner.problem import Limits, Options, Problem
from planner.trajectory import Motion, Trajectory
from planner.workspace import Workspace
from tests.mission.proven import proven

LIMITS = Limits(5.0, 2.0, 1.5, 3.0)
BOX = Workspace(np.array([0.0, 0.0, 5.0]), np.array([200.0, 100.0, 30.0]))
MODES = (4, 4, 2)
OPTIONS = Options(candidates=2, modes=MODES)
CURVE = proven(along(np.array([[10.0, 50.0, 10.0], [190.0, 50.0, 10.0], [190.0, 90.0, 10.0]]), LIMITS))
PROBLEM = Problem(
    workspace=BOX,
    information=uniform(BOX),
    obstacles=ObstacleField.of([]),
    limits=LIMITS,
    start=Motion.at_rest(np.array([10.0, 50.0, 10.0])),
    end_position_m=None,
    duration_s=CURVE.duration_s,
    vehicle_radius_m=0.5,
    clearance_margin_m=1.0,
)
SWITCH_KNOT = 12
SWITCH_S = SWITCH_KNOT * CURVE.knot_interval_s


def continuing(aside_m=6.0) -> Trajectory:
    """A curve that leaves `CURVE` at the switch, swings up to `aside_m` to the north, and ends where it ends."""
    rest = CURVE.control_points_m[SWITCH_KNOT:].copy()
    straight = rest[3:-24]
    swing = np.sin(np.pi * np.linspace(0.0, 1.0, len(straight))) ** 2
    rest[3:-24, 1] += aside_m * swing
    return Trajectory(rest, CURVE.knot_interval_s)


def farthest_aside(trajectory: Trajectory) -> np.ndarray:
    """The place in the middle of the swing."""
    samples = trajectory.sampled_every(0.1).position_m
    along_east = samples[samples[:, 0] < 180.0]
    return along_east[int(np.argmax(np.abs(along_east[:, 1] - 50.0)))]


def request(**changes) -> Request:
    problem = dataclasses.replace(
        PROBLEM, start=CURVE.motion_at(SWITCH_S), duration_s=CURVE.end_s - SWITCH_S, **changes
    )
    return Request(1, problem, np.empty((0, 3)), OPTIONS, (CURVE,), CURVE, SWITCH_S, 1.0)


def reply(*candidates: tuple[Trajectory, float], staying=0.5, asked=None) -> Reply:
    asked = asked or request()
    made = tuple(
        Candidate(prove(trajectory, asked.problem), "test", metric, metric) for trajectory, metric in candidates
    )
    feasible = [index for index, one in enumerate(made) if one.feasible]
    paths = np.stack([one.trajectory.sample(np.linspace(0.0, 20.0, 50)).position_m for one in made])
    plan = Plan(
        Status.CONVERGED,
        made,
        min(feasible, key=lambda index: made[index].cost) if feasible else None,
        1.0,
        diversity(BOX.unit_from_enu(paths)),
        1,
    )
    return Reply(asked, plan, staying, 0.3)


def course(now_s=0.0) -> Course:
    return Course.begin(CURVE, now_s, 0.0, LIMITS.max_acceleration_mps2, 1.0)


class Answers:
    """The other process, without one: answers when it is told to."""

    def __init__(self):
        self.asked: list[Request] = []
        self.reply: Reply | None = None
        self.lost, self.warm, self.busy = "", True, False

    def ask(self, asked):
        self.asked.append(asked)
        self.busy = True

    def poll(self):
        answer, self.reply = self.reply, None
        if answer is not None:
            self.busy = False
        return answer

    def lead_host_s(self):
        return 2.0


class Following:
    """What a cycle looks at of an executive."""

    def __init__(self):
        self.course = course()
        self.phase = Phase.FOLLOWING
        self.exploration = CURVE
        self.held_by_block = False
        self.blocked_s = None

    def spare_fraction(self, curve, from_s, now_s):
        return 0.5
