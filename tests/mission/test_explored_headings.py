"""Headings that are explored: mission file, plan, exports, flight, log, resumption."""

import csv
import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.executive.course import Course, heading_along
from mission.executive.course_keeper import CourseKeeper
from mission.executive.events import FlightMethod
from mission.executive.phases import Phase
from mission.exports import Format, exported
from mission.findings import InputError
from mission.flying.belief import INTERVAL_S, Belief, after, covered_by, together
from mission.flying.flight import FlightSettings, Outcome, fly_planned
from mission.flying.flight_folder import read_flight_folder
from mission.flying.flight_log import read_flight_log
from mission.flying.flight_progress import Progress, Watcher
from mission.flying.flight_rules import assignment_of
from mission.flying.journal import explored_headings, unfinished
from mission.flying.replan_cycle import ReplanCycle, Schedule
from mission.flying.replanning import answer, judge
from mission.flying.resuming import resumption
from mission.flying.ways import along
from mission.loading import load
from mission.plan_file import PlanFile, read_plan_file, write_plan_file
from mission.plan_output import plan_file_of
from mission.planning import Planned
from planner.judging import Judge
from planner.trajectory import Trajectory
from tests.mission.flying_vehicle import STATE
from tests.mission.hand_made import plan_by_hand
from tests.mission.proven import proven
from tests.planner.independent_checker import check

SPEED = 20.0
RATE_RADPS = 0.5
MISSION = """
[site]
origin = { latitude_deg = 47.3977, longitude_deg = 8.5456, altitude_amsl_m = 488.0 }
box_min_enu_m = [0.0, 0.0, 8.0]
box_max_enu_m = [60.0, 60.0, 20.0]
[information]
kind = "uniform"
[planner]
start_enu_m = [15.0, 15.0, 12.0]
duration_s = 40.0
candidates = 2
modes = [4, 4, 1]
metric = "kernel"
heading = "explored"
[flight]
takeoff_altitude_m = 12.0
[replanning]
enabled = false
"""
CORNERS = np.array([[15.0, 15, 12], [45, 15, 12], [45, 45, 12]])


@pytest.fixture
def mission_file(tmp_path):
    path = tmp_path / "all-round.toml"
    path.write_text(MISSION, encoding="utf-8")
    return path


@pytest.fixture
def planned(tmp_path) -> Planned:
    """A plan made by hand: two straight legs, turning all the way."""
    found = plan_by_hand(MISSION, CORNERS, tmp_path)
    path = found.plan.best.trajectory
    turned = 1.0 + RATE_RADPS * path.knot_interval_s * np.arange(len(path.control_points_m))
    return with_course(found, Trajectory(path.control_points_m, path.knot_interval_s, 0.0, turned))


def with_course(planned: Planned, curve: Trajectory) -> Planned:
    candidate = Judge(planned.problem, planned.options).candidate(curve, "by hand")
    plan = dataclasses.replace(planned.plan, candidates=(candidate,))
    return dataclasses.replace(planned, plan=plan)


def apart(first, second) -> np.ndarray:
    """Angles between headings, whole turns aside."""
    return np.abs((np.subtract(first, second) + np.pi) % (2.0 * np.pi) - np.pi)


def heading_of(curve: Trajectory, time_s) -> np.ndarray:
    heading = curve.headings_at(np.asarray(time_s))
    assert heading is not None
    return heading


def test_headings_without_a_metric_of_poses_are_refused_with_what_to_write(mission_file):
    with pytest.raises(InputError) as refused:
        load(mission_file, ['planner.metric="spectral"'])
    (finding,) = refused.value.findings
    assert finding.path == "planner.heading"
    assert 'write metric = "kernel"' in finding.advice
    with pytest.raises(InputError, match=r"planner\.heading"):
        load(mission_file, ["planner.heading=sideways"])
    assert load(mission_file, ["planner.heading=travel", "planner.metric=spectral"]).planner.heading == "travel"


def test_the_plan_file_keeps_the_heading_and_the_checker_confirms_it(planned, tmp_path):
    written = plan_file_of(planned)
    write_plan_file(written, tmp_path / "plan.json")
    read = read_plan_file(tmp_path / "plan.json")
    curve = planned.plan.best.trajectory
    np.testing.assert_array_equal(read.curve().heading_control_rad, curve.heading_control_rad)
    assert read.metric.heading == "explored"
    flown = read.trajectory
    np.testing.assert_allclose(flown.yaw_enu_rad, heading_of(curve, flown.time_s), atol=1e-9)
    document = json.loads((tmp_path / "plan.json").read_text())
    assert check(document).faults == ()
    document["spline"]["heading_control_enu_rad"][7] += 0.1
    assert any("off the one that was planned" in fault for fault in check(document).faults)
    del document["spline"]["heading_control_enu_rad"]
    assert any("none that was planned" in fault for fault in check(document).faults)


def test_a_plan_written_before_there_were_headings_is_still_read(planned, tmp_path):
    document = plan_file_of(planned).model_dump(mode="json")
    del document["metric"]["heading"], document["spline"]["heading_control_enu_rad"]
    for waypoint in document["waypoints"]:
        del waypoint["yaw_enu_rad"]
    old = PlanFile.model_validate(document)
    assert old.curve().heading_control_rad is None
    assert old.waypoints[0].yaw_enu_rad is None


def test_exports_carry_the_heading(planned):
    plan, curve = plan_file_of(planned), planned.plan.best.trajectory
    rows = list(csv.DictReader(line for line in exported(plan, Format.CSV).splitlines() if not line.startswith("#")))
    times = np.array([float(row["time_s"]) for row in rows])
    yaw = np.array([float(row["yaw_enu_rad"]) for row in rows])
    assert apart(yaw, heading_of(curve, times)).max() < 1e-3
    lines = [line.split("\t") for line in exported(plan, Format.WPL).splitlines()[2:]]
    turned = [float(line[7]) for line in lines if line[3] == "16"]
    wanted = 90.0 - np.degrees(heading_of(curve, [waypoint.time_s for waypoint in plan.waypoints]))
    assert len(turned) == len(plan.waypoints)
    assert np.degrees(apart(np.radians(turned), np.radians(wanted))).max() < 0.06


def test_a_course_turns_from_where_the_vehicle_looks_to_what_was_planned(planned):
    curve = planned.plan.best.trajectory
    course = Course.begin(planned.plan.best.proven, 0.0, -1.0, 3.0, 0.785)
    seen = np.array([course.at(now_s).yaw_rad for now_s in np.arange(0.0, curve.end_s, 0.05)])
    assert np.abs(np.diff(seen)).max() <= 0.785 * 0.05 + 1e-9
    late = np.arange(12.0, curve.end_s - 0.2, 0.5)
    assert apart(course.headings_at(late), heading_of(curve, late)).max() < 1e-6
    turning = course.turning_at(15.0)
    assert apart(turning.yaw_rad, heading_of(curve, [15.0])) < 1e-6
    assert turning.yaw_rate_radps == pytest.approx(RATE_RADPS, rel=1e-6)


def test_the_way_to_the_start_arrives_looking_as_the_exploration_begins(planned):
    keeper = CourseKeeper(assignment_of(planned, FlightMethod.OFFBOARD), None)
    limits = planned.problem.limits
    begins = heading_of(planned.plan.best.trajectory, [0.0])[0]
    keeper.begin_way(proven(along(np.array([[5.0, 50.0, 12.0], CORNERS[0]]), limits)), 0.0)
    assert keeper.course is not None
    assert apart(keeper.course.at(keeper.course.end_s).yaw_rad, begins) < 1e-9
    southwards = -np.arctan2(35.0, 10.0)
    assert apart(keeper.course.headings_at(np.array([4.0]))[0], southwards) < 0.1
    keeper.begin_way(proven(along(np.array([CORNERS[0], [5.0, 50.0, 12.0]]), limits)), 0.0)
    assert apart(keeper.course.at(keeper.course.end_s).yaw_rad, southwards + np.pi) < 0.1


def test_a_vehicle_turns_on_at_the_end_of_a_way_that_is_shorter_than_the_turn_and_is_waited_for(planned):
    keeper = CourseKeeper(assignment_of(planned, FlightMethod.OFFBOARD), None)
    begins = heading_of(planned.plan.best.trajectory, [0.0])[0]
    keeper.stand(dataclasses.replace(STATE, position_enu_m=(15.5, 15.0, 12.0), yaw_enu_rad=begins + 3.0), 0.0)
    keeper.begin_way(proven(along(np.array([[15.5, 15.0, 12.0], CORNERS[0]]), planned.problem.limits)), 0.0)
    course = keeper.course
    assert course is not None
    fastest = planned.problem.limits.max_yaw_rate_radps
    told = np.unwrap([course.at(now_s).yaw_rad for now_s in np.arange(0.0, course.end_s + 3.5 / fastest, 0.1)])
    assert apart(course.at(course.end_s).yaw_rad, begins) > 1.0
    assert np.abs(np.diff(told)).max() <= 0.1 * fastest * (1.0 + 1e-6)
    assert apart(told[-1], begins) < 1e-9
    there = dataclasses.replace(STATE, position_enu_m=(15.0, 15.0, 12.0), velocity_enu_mps=(0.0, 0.0, 0.0))
    assert keeper.waits_for(dataclasses.replace(there, yaw_enu_rad=begins + 0.3))
    assert not keeper.waits_for(dataclasses.replace(there, yaw_enu_rad=begins + 2.0 * np.pi))


def test_a_vehicle_that_brakes_on_its_way_is_not_waited_for_to_look_as_at_the_end(planned):
    keeper = CourseKeeper(assignment_of(planned, FlightMethod.OFFBOARD), None)
    keeper.begin_exploration(0.0)
    keeper.brake(5.0)
    assert keeper.course is not None
    point = keeper.course.at(20.0)
    stopped = dataclasses.replace(STATE, position_enu_m=tuple(point.motion.position_m), yaw_enu_rad=point.yaw_rad)
    assert apart(keeper.course.at(keeper.course.end_s).yaw_rad, heading_of(keeper.exploration, [40.0])[0]) > 0.5
    assert not keeper.waits_for(stopped)
    assert keeper.waits_for(dataclasses.replace(stopped, yaw_enu_rad=point.yaw_rad + 0.5))


def test_a_heading_is_planned_for_a_part_of_the_way_only():
    path = Trajectory(np.outer(np.arange(30.0), [2.0, 0.0, 0.0]), 1.0)
    heading = heading_along(path, 0.0, 0.5, arrives_rad=2.0)
    turns_s = path.end_s - np.pi / 0.5
    assert heading.at(turns_s - 0.2) == 0.0
    assert heading.at(path.end_s) == pytest.approx(2.0)


def test_what_was_seen_is_remembered_as_poses(planned):
    problem, modes = planned.problem, planned.options.modes
    belief = Belief(problem, np.tile(CORNERS[0], (5, 1)))
    for now_s in np.arange(0.0, 3.0, INTERVAL_S):
        belief.fly((15.0, 15.0, 12.0), float(now_s), float(now_s))
    flown, yaw = belief.flown_m(), belief.flown_yaw_rad()
    assert len(flown) == len(yaw)
    left = after(problem, flown, modes, yaw)
    assert left.covered is not None
    assert left.covered.poses is not None
    # Headings that nobody told are not made up.
    assert len(left.covered.poses) == len(flown) - 5
    np.testing.assert_allclose(left.covered.poses[:, 3], yaw[5:])
    both = together(left.covered, covered_by(flown[5:], 2.0, problem, modes, yaw[5:]))
    assert both is not None
    assert both.poses is not None
    assert len(both.poses) == 2 * (len(flown) - 5)


class Answers:
    """A replanner that keeps what it is asked."""

    busy, warm, lost = False, True, ""

    def __init__(self):
        self.asked = []

    def ask(self, request):
        self.asked.append(request)

    def lead_host_s(self):
        return 2.0


class Following:
    """What a cycle looks at of an executive."""

    phase, held_by_block, blocked_s = Phase.FOLLOWING, False, None

    def __init__(self, planned: Planned):
        self.exploration = planned.plan.best.proven
        self.course = Course.begin(self.exploration, 0.0, 1.5, 3.0, 0.785)


@pytest.fixture
def asked(planned):
    """A replan asked for in the middle of the course."""
    belief, executive = Belief(planned.problem), Following(planned)
    for now_s in np.arange(0.0, 9.0, INTERVAL_S):
        at = executive.course.at(float(now_s))
        belief.fly(tuple(at.motion.position_m), float(now_s), at.yaw_rad)
    cycle = ReplanCycle(Answers(), belief, planned.options, Schedule(5.0, 1.0), planned.plan)
    cycle._to_warm.clear()
    return cycle.ask(executive, 9.0, 1.0), executive


def test_a_replan_is_asked_to_go_on_turning_and_told_what_was_seen(planned, asked):
    request, executive = asked
    start = request.problem.start_turning
    assert start is not None
    assert start.yaw_rad == pytest.approx(executive.course.turning_at(11.0).yaw_rad)
    assert start.yaw_rate_radps == pytest.approx(RATE_RADPS, rel=1e-3)
    assert len(request.flown_yaw_rad) == len(request.flown_m) == pytest.approx(110, abs=3)
    assert all(curve.heading_control_rad is not None for curve in request.warm_start)


@pytest.mark.slow
def test_a_replan_goes_on_turning_where_the_course_is_left(planned, asked):
    request, executive = asked
    reply = answer(dataclasses.replace(request, time_limit_s=60.0))
    assert reply.plan is not None
    assert reply.plan.best.ergodic_metric < reply.staying_objective
    verdict = judge(reply, executive.course, 9.5, planned.problem, lambda curve, from_s: 0.5, must_leave=False)
    assert verdict.trajectory is not None, verdict.reason
    gone_over = executive.course.continued(verdict.trajectory, 9.5)
    moments = np.arange(10.0, 13.0, 0.05)
    assert np.abs(np.diff(gone_over.headings_at(moments))).max() <= 0.785 * 0.05 + 1e-9


class Quiet(Watcher):
    """Does something once, in the middle of the exploration."""

    def __init__(self, then=None):
        self._then = then

    def progress(self, progress: Progress):
        if self._then is not None and progress.phase is Phase.FOLLOWING and progress.explored > 0.4:
            then, self._then = self._then, None
            then()


def test_an_interrupted_flight_is_flown_on_with_the_heading_that_was_planned(planned, tmp_path, monkeypatch):
    from mission.flying import flight as module

    loops = []
    run = module.FlightLoop.run
    monkeypatch.setattr(module.FlightLoop, "run", lambda self: (loops.append(self), run(self)))
    chosen = FlightSettings("sim", FlightMethod.OFFBOARD, SPEED, tmp_path / "flight")
    first = fly_planned(planned, chosen, Quiet(lambda: loops[0].interrupt()))
    assert first.outcome is Outcome.EARLY
    left = resumption(read_flight_folder(chosen.folder))
    assert left is not None
    curve, rest = planned.plan.best.trajectory, left.planned.plan.best.trajectory
    moments = np.linspace(left.left.from_s, curve.end_s, 50)
    np.testing.assert_allclose(heading_of(rest, moments), heading_of(curve, moments), atol=1e-9)
    assert len(left.left.flown_yaw_rad) == len(left.left.flown_m)
    again = dataclasses.replace(
        chosen, from_s=left.from_s, flown_m=left.left.flown_m, flown_yaw_rad=left.left.flown_yaw_rad
    )
    second = fly_planned(left.planned, again, Quiet())
    assert second.outcome is Outcome.DONE, second.summary
    log = read_flight_log(chosen.folder)
    assert unfinished(log) is None
    # Flown in two parts it saw what was planned to be seen.
    assert second.summary["ergodic_metric"] == pytest.approx(planned.plan.best.ergodic_metric, rel=0.3)
    assert len(explored_headings(log)) > 0.8 * curve.duration_s / INTERVAL_S


def test_a_mission_with_explored_headings_is_planned_and_flown(mission_file, tmp_path):
    folder = tmp_path / "flight"
    arguments = ["fly", str(mission_file), "--speed", str(SPEED), "--out", str(folder), "--json"]
    result = CliRunner().invoke(app, [*arguments, "--set", "planner.time_limit_s=5"])
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)
    assert summary["landed"]
    plan, log = read_plan_file(folder / "plan.json"), read_flight_log(folder)
    assert plan.metric.ergodic_metric < plan.metric.lawnmower_ergodic_metric
    assert check(json.loads((folder / "plan.json").read_text())).faults == ()
    exploring = log.exploring()
    # The vehicle turned all round, as it was planned, and so covered what was planned.
    assert np.ptp(np.unwrap(log.yaw_rad[exploring])) > 2.0 * np.pi
    told_s = np.interp(log.time_s[exploring], log.setpoint_s, log.setpoint_curve_s)
    assert np.median(apart(log.yaw_rad[exploring], heading_of(plan.curve(), told_s))) < 0.15
    assert summary["ergodic_metric"] == pytest.approx(plan.metric.ergodic_metric, rel=0.3)


def test_a_fixed_wing_looks_where_it_flies(mission_file):
    with pytest.raises(InputError, match=r"planner\.heading") as refused:
        load(mission_file, ["vehicle.preset=fixed-wing"])
    assert any("looks where it flies" in finding.advice for finding in refused.value.findings)


def test_the_picture_shows_where_the_vehicle_looks(planned, tmp_path, monkeypatch):
    from matplotlib.axes import Axes

    from mission.pictures.picture import draw_plan

    drawn = []
    quiver = Axes.quiver
    monkeypatch.setattr(Axes, "quiver", lambda self, *args, **how: (drawn.append(args), quiver(self, *args, **how))[1])
    draw_plan(planned, tmp_path / "plan.png")
    ((_, _, east, north),) = drawn
    curve = planned.plan.best.trajectory
    wanted = heading_of(curve, np.linspace(0.0, curve.end_s, len(east)))
    assert apart(np.arctan2(north, east), wanted).max() < 1e-9
