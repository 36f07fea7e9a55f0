"""Whole flights against the built-in vehicle, faster than real time, without a solver: the plan is made by hand."""

import contextlib
import dataclasses
import json
import os
import signal
import threading
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.executive.events import FlightMethod
from mission.executive.phases import Phase
from mission.flying.flight import FlightSettings, Outcome, fly, fly_planned
from mission.flying.flight_folder import read_flight_folder
from mission.flying.flight_log import read_flight_log
from mission.flying.flight_progress import PlainWatcher, Progress, Watcher
from mission.flying.intake import push_into
from mission.flying.journal import unfinished
from mission.flying.recorder import LOG_NAME
from mission.flying.resuming import resumption
from mission.planning import Planned
from tests.mission.full_disk import no_file_larger_than
from tests.mission.hand_made import CORNERS, MISSION, plan_by_hand

SPEED = 20.0


class Notes(Watcher):
    """Keeps what is said, and does something when a phase is shown."""

    def __init__(self, at=None, then=None) -> None:
        self.said: list[str] = []
        self.phases: list[Phase] = []
        self._at, self._then = at, then

    def say(self, text, warning):
        self.said.append(text)

    def progress(self, progress: Progress):
        self.phases.append(progress.phase)
        if self._then is not None and progress.phase is self._at and progress.explored > 0.1:
            then, self._then = self._then, None
            then()


@pytest.fixture
def planned(tmp_path):
    def make(*overrides) -> Planned:
        return plan_by_hand(MISSION, CORNERS, tmp_path, overrides)

    return make


def settings(tmp_path, **changes) -> FlightSettings:
    return FlightSettings(
        "sim", **({"method": FlightMethod.OFFBOARD, "speed": SPEED, "folder": tmp_path / "flight"} | changes)
    )


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_mission_is_flown_to_the_landed_vehicle(planned, tmp_path, autopilot):
    flown = fly(planned(f"vehicle.autopilot={autopilot}"), folder=tmp_path / "flight", speed=SPEED)
    summary = flown.summary
    assert flown.outcome is Outcome.DONE, summary
    assert summary["landed"]
    assert summary["violations"] == []
    assert summary["offboard_lost"] == 0
    assert summary["tracking_error_mean_m"] < 0.5
    assert summary["phases"][-4:] == ["turning back", "returning", "landing", "landed"]
    assert json.loads((flown.folder / "summary.json").read_text()) == summary
    for name in ("plan.json", "log.jsonl", "flight.png", "recording.rrd", "report.html", "mission.json"):
        assert (flown.folder / name).stat().st_size > 0
    log = read_flight_log(flown.folder)
    assert np.hypot(*(log.position_m[-1, :2] - [15.0, 15.0])) < 1.5
    assert unfinished(log) is None


def test_a_vehicle_with_drag_leans_against_it_and_the_flight_tells_what_it_was(planned, tmp_path):
    summary = fly(planned("vehicle.drag_per_s=0.6"), folder=tmp_path / "flight", speed=SPEED).summary
    assert summary["air"]["drag_per_s"] == pytest.approx(0.6, abs=0.06)
    assert summary["drag_leaned_against_per_s"] == 0.6
    assert summary["tracking_error_mean_m"] < 0.5


@pytest.mark.parametrize("autopilot", ["px4", pytest.param("ardupilot", marks=pytest.mark.slow)])
def test_a_mission_is_uploaded_read_back_and_flown_by_the_vehicle(planned, tmp_path, autopilot):
    chosen = settings(tmp_path, method=FlightMethod.MISSION, speed=10.0)
    flown = fly_planned(planned(f"vehicle.autopilot={autopilot}"), chosen, Notes())
    assert flown.outcome is Outcome.DONE, flown.summary
    assert "vehicle flies the uploaded mission" in flown.summary["phases"]
    log = read_flight_log(flown.folder)
    for corner in CORNERS:
        assert np.linalg.norm(log.position_m - corner, axis=1).min() < 3.0
    assert len(log.setpoint_s) == 0


def test_a_mission_that_the_vehicle_flies_by_itself_is_left_where_an_obstacle_is_pushed_onto_it(planned, tmp_path):
    folder, file = tmp_path / "flight", tmp_path / "crane.json"
    file.write_text(json.dumps({"obstacle": [{"kind": "sphere", "center_enu_m": [50.0, 57.5, 14.5], "radius_m": 4.0}]}))

    def push():
        assert push_into(folder, file, 10.0)

    notes = Notes(Phase.AUTO_MISSION, lambda: threading.Thread(target=push).start())
    flown = fly_planned(planned(), settings(tmp_path, method=FlightMethod.MISSION, speed=10.0), notes)
    phases = flown.summary["phases"]
    assert phases[phases.index("vehicle holds") :] == [
        "vehicle holds",
        "taking over to return",
        "returning",
        "landing",
        "landed",
    ]
    assert flown.summary["min_clearance_m"] > 0.5


@pytest.mark.parametrize(
    ("autopilot", "refused"), [("px4", "COM_OBL_RC_ACT is 0"), ("ardupilot", "FS_GCS_ENABLE is 0")]
)
def test_unsafe_settings_are_refused_before_anything_is_armed(planned, tmp_path, monkeypatch, autopilot, refused):
    monkeypatch.setattr("mission.flying.connecting.as_told", lambda *_: ())
    flown = fly_planned(planned(f"vehicle.autopilot={autopilot}"), settings(tmp_path), Notes())
    assert flown.outcome is Outcome.ABORTED
    assert any(refused in text for text in flown.summary["warnings"])
    assert not read_flight_log(flown.folder).armed.any()


def test_the_operators_wishes_reach_the_flight_through_its_inbox(planned, tmp_path):
    folder = tmp_path / "flight"
    wishes = tmp_path / "wish.json"
    answers = []

    def push():
        for wish in ("pause", "resume", "return"):
            wishes.write_text(json.dumps({"command": wish}))
            answers.append(push_into(folder, wishes, 10.0))
            time.sleep(0.3)

    notes = Notes(Phase.FOLLOWING, lambda: threading.Thread(target=push).start())
    flown = fly_planned(planned(), settings(tmp_path, speed=10.0), notes)
    assert all(answer and answer["accepted"] for answer in answers)
    assert flown.outcome is Outcome.EARLY
    phases = flown.summary["phases"]
    assert phases[phases.index("holding") :][:3] == ["holding", "exploring", "turning back"]


def test_an_obstacle_on_the_course_is_never_flown_into(planned, tmp_path):
    folder, file = tmp_path / "flight", tmp_path / "crane.json"
    crane = {"kind": "sphere", "center_enu_m": [50.0, 57.5, 14.5], "radius_m": 4.0}
    file.write_text(json.dumps({"obstacle": [crane]}))

    def push():
        assert push_into(folder, file, 10.0)

    notes = Notes(Phase.FOLLOWING, lambda: threading.Thread(target=push).start())
    flown = fly_planned(planned(), settings(tmp_path, speed=10.0), notes)
    # Nothing replans here, so before the crane it turns back, and goes home around it.
    phases = flown.summary["phases"]
    assert phases[phases.index("exploring") :] == [
        "exploring",
        "holding",
        "turning back",
        "returning",
        "landing",
        "landed",
    ]
    assert flown.summary["min_clearance_m"] > 0.5
    flight = read_flight_folder(folder)
    assert flight.problem.obstacles.distance(np.array([[50.0, 57.5, 14.5]]))[0] == pytest.approx(-4.0)


def test_an_obstacle_that_is_pushed_while_paused_is_not_flown_into_afterwards(planned, tmp_path):
    folder = tmp_path / "flight"

    def push():
        crane = {"kind": "sphere", "center_enu_m": [70.0, 40.0, 13.5], "radius_m": 4.0}
        for what in ({"command": "pause"}, {"obstacle": [crane]}, {"command": "resume"}):
            file = tmp_path / "push.json"
            file.write_text(json.dumps(what))
            answer = push_into(folder, file, 10.0)
            assert answer is not None
            assert answer["accepted"]

    notes = Notes(Phase.FOLLOWING, lambda: threading.Thread(target=push).start())
    flown = fly_planned(planned(), settings(tmp_path, speed=10.0), notes)
    assert flown.outcome is Outcome.EARLY
    assert flown.summary["min_clearance_m"] > 0.5


def test_an_interrupted_flight_comes_home_and_is_flown_on_later(planned, tmp_path):
    from mission.flying import flight as module

    loops = []
    run = module.FlightLoop.run
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module.FlightLoop, "run", lambda self: (loops.append(self), run(self)))
        notes = Notes(Phase.FOLLOWING, lambda: loops[0].interrupt())
        first = fly_planned(planned(), settings(tmp_path), notes)
    assert first.interrupted
    assert first.outcome is Outcome.EARLY
    assert first.summary["landed"]
    left = resumption(read_flight_folder(tmp_path / "flight"))
    assert left is not None
    assert 0.0 < left.left.remaining_s < planned().plan.best.trajectory.duration_s
    second = fly_planned(left.planned, settings(tmp_path, from_s=left.from_s, flown_m=left.left.flown_m), Notes())
    assert second.outcome is Outcome.DONE
    log = read_flight_log(tmp_path / "flight")
    for corner in CORNERS:
        assert np.linalg.norm(log.position_m[log.exploring()] - corner, axis=1).min() < 1.0
    assert resumption(read_flight_folder(tmp_path / "flight")) is None


def test_a_terminal_that_goes_away_does_not_end_a_flight(planned, tmp_path):
    class Leaving(Notes):
        """Its terminal is closed, and nothing can be written to it from then on."""

        def say(self, text, warning):
            super().say(text, warning)
            if self._then is None:
                raise BrokenPipeError(32, "Broken pipe")

    notes = Leaving(Phase.FOLLOWING, lambda: os.kill(os.getpid(), signal.SIGHUP))
    flown = fly_planned(planned(), settings(tmp_path), notes)
    assert flown.outcome is Outcome.DONE
    assert not flown.interrupted
    assert any("the terminal is gone" in text for text in flown.summary["warnings"])


def test_a_disk_that_fills_up_in_the_air_changes_nothing_but_the_log(planned, tmp_path):
    limits = contextlib.ExitStack()
    log = tmp_path / "flight" / LOG_NAME

    def fill():
        limits.enter_context(no_file_larger_than(log.stat().st_size + 10))

    class Filling(Notes):
        """Makes room again when the flight is on its way home."""

        def progress(self, progress):
            super().progress(progress)
            if progress.phase is Phase.RETURNING:
                limits.close()

    notes = Filling(Phase.FOLLOWING, fill)
    with limits:
        flown = fly_planned(planned(), settings(tmp_path), notes)
    assert flown.outcome is Outcome.DONE
    assert any("the log cannot be written" in text for text in notes.said)
    assert any("the log is written again" in text for text in notes.said)
    kept = read_flight_log(flown.folder)
    assert kept.phase[-1] in (Phase.LANDING.value, Phase.LANDED.value)


def test_where_no_vehicle_answers_the_flight_says_so_and_leaves_no_process(planned, tmp_path):
    from sim_bridge.link.client import LinkError

    chosen = dataclasses.replace(settings(tmp_path), link="udp://127.0.0.1:1")
    with pytest.raises(LinkError):
        fly_planned(planned("link.ready_timeout_s=1.0"), chosen, Notes())


def test_progress_is_a_line_a_person_can_read(capsys):
    progress = Progress(83.0, Phase.FOLLOWING, 0.42, 3.21, 0.87, 2)
    assert progress.line() == "01:23 · exploring · explored  42% · clearance 3.2 m · battery 87% · 2 replans"
    watcher = PlainWatcher()
    watcher.say("hello", True)
    watcher.progress(progress)
    watcher.progress(progress)
    assert capsys.readouterr().err.count("exploring") <= 1


def test_a_fixed_wing_is_planned_but_not_flown(tmp_path):
    mission = tmp_path / "wings.toml"
    mission.write_text(MISSION, encoding="utf-8")
    changes = ["--set", "vehicle.preset=fixed-wing", "--out", str(tmp_path / "flight"), "--json"]
    result = CliRunner().invoke(app, ["fly", str(mission), *changes])
    assert result.exit_code == 2
    assert "vehicle.preset" in result.stderr
    assert "mission plan" in result.stderr
    assert not (tmp_path / "flight").exists()
