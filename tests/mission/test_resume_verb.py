"""`mission resume` and `mission fly` on folders: whose they are, how they are flown on, and what is left in them."""

import json
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.executive.phases import Phase
from mission.findings import InputError
from mission.flying.flight_folder import MISSION_NAME, read_flight_folder
from mission.flying.folder_claim import claimed
from mission.flying.ground import Ground
from mission.flying.recorder import LOG_NAME, Recorder
from mission.flying.resuming import resumption
from mission.plan_output import write_outputs
from tests.mission.flying_vehicle import ENERGY, STATE

RUN = CliRunner()


def flown(folder, planned, explored_s, *phases):
    """The folder of a flight that explored so far, and ended in the last of some phases."""
    curve = planned.plan.best.proven
    recorder = Recorder(folder, {"name": "flown", "link": "udp://127.0.0.1:14999", "mode": "offboard"})
    recorder.course(0.0, recorder.keep(curve).result(), "plan")
    for number, phase in enumerate(phases):
        recorder.write("phase", float(number), phase=phase.value, why="")
    recorder.write("progress", 10.0, explored_s=explored_s)
    recorder.close()
    (folder / MISSION_NAME).write_text(json.dumps(planned.mission.model_dump(mode="json", exclude_none=True)))
    write_outputs(planned, folder)
    return folder


@pytest.fixture
def half(planned, tmp_path):
    return flown(tmp_path / "half", planned, 300.0, Phase.FOLLOWING)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--mode", "foo"], "offboard or mission"),
        (["--link", "rubbish"], "udp://"),
        (["--speed", "5"], "--speed"),
    ],
)
def test_how_a_flight_cannot_be_resumed_is_refused_with_exit_code_2(half, arguments, said):
    result = RUN.invoke(app, ["resume", str(half), *arguments])
    assert result.exit_code == 2, result.stderr
    assert said in result.stderr


def test_a_speed_for_a_vehicle_that_lives_in_its_own_time_is_refused_before_the_solve(sound, tmp_path):
    arguments = ["fly", str(sound), "--link", "udp://:14540", "--speed", "5", "--out", str(tmp_path / "flight")]
    result = RUN.invoke(app, arguments)
    assert result.exit_code == 2
    assert "its own time" in result.stderr


HOLDER = """
import sys
from pathlib import Path
from mission.flying.folder_claim import claimed
with claimed(Path(sys.argv[1]), make=True):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_folder_whose_flight_is_under_way_is_neither_resumed_nor_flown_into(half, sound, tmp_path):
    empty = tmp_path / "empty"
    for folder, arguments in ((half, ["resume"]), (empty, ["fly", str(sound), "--out"])):
        with subprocess.Popen(
            [sys.executable, "-c", HOLDER, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as other:
            assert other.stdout is not None
            assert other.stdout.readline() == "held\n"
            result = RUN.invoke(app, [*arguments, str(folder)])
            other.kill()
        assert result.exit_code == 2
        assert "a flight is under way in it" in result.stderr
    # Whoever held it is gone, however it went.
    with claimed(half):
        pass


def test_a_folder_is_claimed_again_by_who_holds_it(tmp_path):
    def refused_elsewhere() -> bool:
        return bool(
            subprocess.run(
                [sys.executable, "-c", HOLDER, str(tmp_path)], stdin=subprocess.DEVNULL, capture_output=True
            ).returncode
        )

    with claimed(tmp_path):
        with claimed(tmp_path / "."):
            assert refused_elsewhere()
        # The second claim's end lets nobody in.
        assert refused_elsewhere()
    assert not refused_elsewhere()


def test_a_folder_that_is_not_there_cannot_be_claimed(tmp_path):
    with pytest.raises(InputError, match="cannot be opened"), claimed(tmp_path / "nowhere"):
        pass


def test_what_had_to_be_skipped_is_said(half):
    log = half / LOG_NAME
    log.write_bytes(log.read_bytes() + b"\xff\xfe\0\0" * 100)
    result = RUN.invoke(app, ["resume", str(half), "--link", "tcp://127.0.0.1:1"])
    assert "skipped: 1 damaged lines" in result.stderr
    assert "300 s of the exploration are left" in result.stderr


def test_without_a_course_a_flight_goes_on_along_its_plan(half, planned):
    (half / "course-000.json").unlink()
    flight = read_flight_folder(half)
    (_, curve), *others = flight.log.courses
    assert others == []
    assert np.allclose(curve.control_points_m, planned.plan.best.trajectory.control_points_m)
    left = resumption(flight)
    assert left is not None
    assert left.from_s == 300.0


@pytest.mark.parametrize("phase", [Phase.LANDED, Phase.LANDING, Phase.HANDED_OVER, Phase.VEHICLE_RETURN])
def test_where_everything_is_explored_and_the_vehicle_is_down_nothing_is_left(planned, tmp_path, phase):
    folder = flown(tmp_path / "flown", planned, 600.0, Phase.FOLLOWING, phase)
    assert resumption(read_flight_folder(folder)) is None
    result = RUN.invoke(app, ["resume", str(folder)])
    assert result.exit_code == 0
    assert "nothing left" in result.stderr


@pytest.mark.parametrize("phase", [Phase.TURNING_BACK, Phase.RETURNING, Phase.BLIND])
def test_where_everything_is_explored_and_the_vehicle_was_on_its_way_it_is_only_brought_home(planned, tmp_path, phase):
    folder = flown(tmp_path / "flown", planned, 600.0, Phase.FOLLOWING, phase)
    resumed = resumption(read_flight_folder(folder))
    assert resumed is not None
    assert resumed.left.only_home
    assert resumed.left.remaining_s == 0.0
    assert "nothing left" in RUN.invoke(app, ["resume", str(folder), "--link", "sim"]).stderr


def test_a_flight_that_is_only_brought_home_takes_nothing_off(planned):
    from mission.executive.events import FlightMethod
    from mission.flying.belief import Belief
    from mission.flying.flight_rules import assignment_of

    assignment = assignment_of(planned, FlightMethod.OFFBOARD, only_home=True)
    ground = Ground(planned.mission, Belief(planned.problem), None, ENERGY, None, assignment, None, None)
    (problem,) = ground.check(STATE).problems
    assert "nothing to fly but the way home" in problem
