"""What is drawn from a flight's folder: summary, picture, recording, report."""

import dataclasses
import json
import re
import subprocess
import sys

import numpy as np
import pytest

from mission.flying.flight_folder import MISSION_NAME, draw_outputs, read_flight_folder
from mission.flying.flight_log import read_flight_log
from mission.flying.recorder import SUMMARY_NAME, Recorder
from mission.flying.summary import summarize, violations
from mission.view import prism_mesh
from planner.obstacles import Prism
from sim_bridge.state import FlightMode, LandedState, VehicleState

FASTEST_MPS = 8.0


def state(time_s, position, velocity, landed=LandedState.IN_AIR):
    return VehicleState(
        time_s=time_s,
        position_enu_m=tuple(map(float, position)),
        velocity_enu_mps=tuple(map(float, velocity)),
        yaw_enu_rad=0.0,
        armed=True,
        mode=FlightMode.EXTERNAL,
        mode_name="OFFBOARD",
        landed=landed,
        battery_fraction=1.0 - time_s / 1200.0,
        waiting_for=(),
        failsafe=False,
        home_enu_m=(10.0, 10.0, 0.0),
    )


def record(folder, planned, aside_m=0.0, faster=1.0, name="Two ways"):
    """A flight along the plan, as far aside and as much faster as asked for."""
    curve = planned.plan.best.proven
    recorder = Recorder(folder, {"name": name, "link": "sim", "mode": "offboard", "started": "2026-01-01"})
    recorder.course(0.0, recorder.keep(curve).result(), "plan")
    recorder.write("phase", 0.0, phase="taking off", why="armed")
    recorder.write("phase", 1.0, phase="exploring", why="at the start")
    for now in np.arange(1.0, 61.0, 0.2):
        motion = curve.motion_at(curve.start_s + now)
        place = motion.position_m + np.array([0.0, 0.0, aside_m])
        recorder.telemetry(now, state(now, place, faster * motion.velocity_mps), "exploring", tuple(motion.position_m))
    recorder.write("progress", 60.0, explored_s=59.0)
    recorder.write("say", 60.0, text='<script>alert("x")</script>', warning=True)
    recorder.write(
        "replan",
        30.0,
        number=1,
        switch_s=40.0,
        solve_s=0.5,
        taken=True,
        reason="better",
        alternative=0,
        objective=0.01,
        staying_objective=0.02,
    )
    recorder.write("replan", 35.0, number=2, switch_s=45.0, solve_s=0.5, taken=False, reason="it came too late",
                   alternative=0, objective=None, staying_objective=None)  # fmt: skip
    recorder.write("phase", 61.0, phase="landed", why="on the ground, disarmed")
    recorder.close()
    mission = planned.mission.model_dump(mode="json", exclude_none=True)
    (folder / MISSION_NAME).write_text(json.dumps(mission))
    return read_flight_log(folder)


@pytest.fixture
def log(planned, tmp_path):
    return record(tmp_path, planned)


def test_the_summary_measures_what_was_flown(planned, log):
    summary = summarize(log, planned.problem, planned.options, FASTEST_MPS)
    assert summary["tracking_error_mean_m"] == pytest.approx(0.0, abs=1e-3)
    assert summary["explored_s"] == 59.0
    assert summary["replans_asked"] == 2
    assert summary["replans_taken"] == 1
    assert summary["replans_refused"] == {"it came too late": 1}
    assert summary["violations"] == []
    steps = np.linalg.norm(np.diff(log.position_m, axis=0), axis=1)
    assert summary["length_m"] == pytest.approx(steps.sum())
    json.dumps(summary, allow_nan=False)


def test_what_was_flown_outside_the_box_too_fast_or_too_close_is_a_violation(planned, tmp_path):
    low = record(tmp_path / "low", planned, aside_m=-25.0)
    assert any("outside the box" in text for text in violations(low, planned.problem, FASTEST_MPS))
    fast = record(tmp_path / "fast", planned, faster=100.0)
    assert any("speed" in text for text in violations(fast, planned.problem, FASTEST_MPS))


def test_a_flight_into_an_obstacle_is_a_violation(planned, tmp_path):
    recorder = Recorder(tmp_path, {})
    recorder.course(0.0, recorder.keep(planned.plan.best.proven).result(), "plan")
    recorder.telemetry(1.0, state(1.0, (250.0, 250.0, 50.0), (0.0, 0.0, 0.0)), "returning", None)
    recorder.close()
    (text,) = violations(read_flight_log(tmp_path), planned.problem, FASTEST_MPS)
    assert "clearance -20" in text


def test_everything_is_drawn_from_the_folder_alone(planned, log, tmp_path):
    flight = read_flight_folder(tmp_path)
    assert flight.mission.planner == planned.mission.planner
    files = draw_outputs(flight)
    assert sorted(file.name for file in files) == ["flight.png", "recording.rrd", "report.html"]
    verify = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(tmp_path / "recording.rrd")],
        capture_output=True,
        text=True,
        check=False,
        env={"HOME": str(tmp_path), "RERUN_ANALYTICS": "false"},
    )
    assert verify.returncode == 0, verify.stderr
    page = (tmp_path / "report.html").read_text()
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "it came too late" in page


def test_a_summary_that_is_there_is_what_is_shown(planned, log, tmp_path):
    summary = summarize(log, planned.problem, planned.options, FASTEST_MPS) | {
        "outcome": "explored and landed",
        "why": "",
    }
    (tmp_path / SUMMARY_NAME).write_text(json.dumps(summary))
    draw_outputs(read_flight_folder(tmp_path))
    assert "explored and landed" in (tmp_path / "report.html").read_text()


def test_a_prism_is_drawn_with_all_its_walls_and_a_roof_of_its_own_area():
    corners = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [5.0, 10.0], [5.0, 4.0], [0.0, 4.0]])
    vertices, triangles = prism_mesh(Prism(corners, 0.0, 7.0))
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    roof = (vertices[triangles][:, :, 2] == 7.0).all(axis=1)
    assert areas[roof].sum() == pytest.approx(70.0)
    assert areas[~roof].sum() == pytest.approx(7.0 * 40.0)


def test_the_time_on_the_ground_before_a_flight_is_resumed_is_not_flown(planned, tmp_path):
    for armed_from_s in (0.0, 50.0):
        recorder = Recorder(tmp_path, {}, goes_on=armed_from_s > 0.0)
        if not armed_from_s:
            recorder.course(0.0, recorder.keep(planned.plan.best.trajectory).result(), "plan")
        for now in np.arange(0.0, armed_from_s + 10.5, 1.0):
            there = state(now, (10.0 + armed_from_s + now, 10.0, 30.0), (1.0, 0.0, 0.0))
            there = dataclasses.replace(there, armed=bool(now >= armed_from_s))
            recorder.telemetry(now, there, "exploring" if there.armed else "checking the vehicle", None)
        recorder.close()
    summary = summarize(read_flight_log(tmp_path), planned.problem, planned.options, FASTEST_MPS)
    assert summary["flown_s"] == pytest.approx(20.0)
    assert summary["length_m"] == pytest.approx(20.0)
