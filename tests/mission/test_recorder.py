"""A disk without room, or one that hangs: the log loses lines, and nothing else."""

import json
import os
import threading
import time

import numpy as np
import pytest

from mission.flying import log_writer
from mission.flying.flight_log import read_flight_log
from mission.flying.intake import Arrived, Intake
from mission.flying.recorder import LOG_NAME, Recorder
from mission.loading import load
from planner.trajectory import Trajectory
from tests.mission.full_disk import no_file_larger_than
from tests.mission.proven import proven

CURVE = proven(Trajectory(np.zeros((5, 3)), 1.0))


def written(recorder):
    """Once everything recorded so far was tried to be written."""
    recorder._writer.do(lambda: None).result(timeout=20.0)
    return recorder


def test_lines_that_find_no_room_are_counted_and_the_log_goes_on_behind_them(tmp_path):
    recorder = Recorder(tmp_path, {"name": "full"})
    size = (tmp_path / LOG_NAME).stat().st_size
    with no_file_larger_than(size + 100):
        for number in range(5):
            recorder.write("say", float(number), text="x" * 20, warning=False)
        assert written(recorder).lost_lines == 3
        assert recorder.fault is not None
    recorder.write("say", 9.0, text="room again", warning=False)
    assert written(recorder).fault is None
    recorder.close()
    lines = (tmp_path / LOG_NAME).read_text().splitlines()
    # The line that was cut short is whole.
    assert [json.loads(line).get("t") for line in lines] == [0.0, 0.0, 1.0, 9.0]
    assert len(read_flight_log(tmp_path).of_kind("say")) == 3


def test_a_log_that_cannot_even_begin_is_refused(tmp_path):
    (tmp_path / LOG_NAME).symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        Recorder(tmp_path, {"name": "full"}, goes_on=True)


def test_a_folder_that_holds_a_flight_is_not_flown_into(tmp_path):
    Recorder(tmp_path, {"name": "first"}).close()
    with pytest.raises(FileExistsError):
        Recorder(tmp_path, {"name": "second"})
    assert read_flight_log(tmp_path).header["name"] == "first"


def test_a_log_that_goes_on_behind_a_torn_line_begins_a_line_of_its_own(tmp_path):
    Recorder(tmp_path, {"name": "first"}).close()
    with (tmp_path / LOG_NAME).open("a") as file:
        file.write('{"kind":"telemetry","t":10.0,"p":[1.0,')
    Recorder(tmp_path, {"name": "second"}, goes_on=True).close()
    assert [json.loads(line)["name"] for line in (tmp_path / LOG_NAME).read_text().splitlines()[::2]] == [
        "first",
        "second",
    ]


@pytest.fixture
def hanging(monkeypatch):
    """A disk that takes nothing until it is let go, from the next line on."""
    let_go = threading.Event()
    append = log_writer.LogWriter._append

    def hang(self, line):
        if b'"header"' not in line:
            assert let_go.wait(60.0)
        append(self, line)

    monkeypatch.setattr(log_writer.LogWriter, "_append", hang)
    monkeypatch.setattr(log_writer, "_MOST_WAITING", 10)
    yield let_go
    let_go.set()


def test_a_disk_that_hangs_stalls_nobody_and_what_finds_no_room_to_wait_is_counted(tmp_path, hanging):
    recorder = Recorder(tmp_path, {"name": "hanging"})
    for number in range(50):
        recorder.write("say", float(number), text="", warning=False)
    # One is being written, ten wait.
    assert 38 <= recorder.lost_lines <= 40
    assert recorder.fault is not None
    assert "does not keep up" in str(recorder.fault)
    lost = recorder.lost_lines
    hanging.set()
    recorder.close()
    assert len(read_flight_log(tmp_path).of_kind("say")) == 50 - lost


def test_a_course_waits_for_a_disk_that_hangs_and_nobody_waits_for_the_course(tmp_path, hanging):
    recorder = Recorder(tmp_path, {"name": "hanging"})
    recorder.write("say", 0.0, text="", warning=False)
    kept = recorder.keep(CURVE)
    assert not kept.done()
    hanging.set()
    assert kept.result(timeout=20.0).trajectory is CURVE
    assert (tmp_path / "course-000.json").exists()
    recorder.close()


def test_the_log_is_put_on_the_disk_while_it_is_written_and_so_are_the_names_of_new_files(tmp_path, monkeypatch):
    synced, sync = [], os.fsync

    def fsync(descriptor):
        synced.append(os.readlink(f"/proc/self/fd/{descriptor}"))
        sync(descriptor)

    monkeypatch.setattr(log_writer.os, "fsync", fsync)
    monkeypatch.setattr(log_writer, "_SYNC_HOST_S", 0.01)
    folder = tmp_path / "flight"
    recorder = Recorder(folder, {"name": "kept"})
    assert {str(tmp_path), str(folder)} <= set(synced)
    synced.clear()
    recorder.write("say", 0.0, text="", warning=False)
    until = time.monotonic() + 20.0
    while str(folder / LOG_NAME) not in synced and time.monotonic() < until:
        time.sleep(0.01)
    assert str(folder / LOG_NAME) in synced
    synced.clear()
    recorder.keep(CURVE).result(timeout=20.0)
    assert str(folder / "course-000.json.partial") in synced
    assert str(folder) in synced
    recorder.close()


def test_a_course_that_is_not_on_the_disk_is_an_error_and_leaves_no_half_of_it(tmp_path):
    recorder = Recorder(tmp_path, {"name": "full"})
    (tmp_path / "course-000.json.partial").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        recorder.keep(CURVE).result(timeout=20.0)
    assert not (tmp_path / "course-000.json").exists()
    recorder.close()


def test_a_push_is_taken_in_where_there_is_no_room_to_say_so(tmp_path, sound):
    intake = Intake(tmp_path, load(sound, []))
    (tmp_path / "inbox" / "crane.answer.partial").symlink_to("/dev/full")
    intake.answer(Arrived("crane", None), True, "taken in")
    intake.answer(Arrived("information", None), True, "taken in")
    assert [path.name for path in (tmp_path / "inbox").glob("*.answer")] == ["information.answer"]
