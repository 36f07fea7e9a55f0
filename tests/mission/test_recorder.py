"""A disk without room: the log loses lines, and nothing else."""

import json

import numpy as np
import pytest

from mission.flying.flight_log import read_flight_log
from mission.flying.intake import Arrived, Intake
from mission.flying.recorder import LOG_NAME, Recorder
from mission.loading import load
from planner.trajectory import Trajectory
from tests.mission.full_disk import no_file_larger_than

CURVE = Trajectory(np.zeros((5, 3)), 1.0)


def test_lines_that_find_no_room_are_counted_and_the_log_goes_on_behind_them(tmp_path):
    recorder = Recorder(tmp_path, {"name": "full"})
    size = (tmp_path / LOG_NAME).stat().st_size
    with no_file_larger_than(size + 100):
        for number in range(5):
            recorder.write("say", float(number), text="x" * 20, warning=False)
        assert recorder.lost_lines == 3
        assert recorder.fault is not None
    recorder.write("say", 9.0, text="room again", warning=False)
    assert recorder.fault is None
    recorder.close()
    lines = (tmp_path / LOG_NAME).read_text().splitlines()
    # The line that was cut short is whole.
    assert [json.loads(line).get("t") for line in lines] == [0.0, 0.0, 1.0, 9.0]
    assert len(read_flight_log(tmp_path).of_kind("say")) == 3


def test_a_log_that_cannot_even_begin_is_refused(tmp_path):
    (tmp_path / LOG_NAME).symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        Recorder(tmp_path, {"name": "full"})


def test_a_course_that_is_not_on_the_disk_is_an_error_and_leaves_no_half_of_it(tmp_path):
    recorder = Recorder(tmp_path, {"name": "full"})
    (tmp_path / "course-000.json.partial").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        recorder.course(0.0, CURVE, "replan")
    assert not (tmp_path / "course-000.json").exists()
    recorder.close()


def test_a_push_is_taken_in_where_there_is_no_room_to_say_so(tmp_path, sound):
    intake = Intake(tmp_path, load(sound, []))
    (tmp_path / "inbox" / "crane.answer.partial").symlink_to("/dev/full")
    intake.answer(Arrived("crane", None), True, "taken in")
    intake.answer(Arrived("information", None), True, "taken in")
    assert [path.name for path in (tmp_path / "inbox").glob("*.answer")] == ["information.answer"]
