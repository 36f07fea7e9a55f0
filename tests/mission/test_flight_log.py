"""The log of a flight: written ahead, read back, torn, resumed; and what is left to fly."""

import dataclasses
import json
import time

import numpy as np
import pytest

from mission.executive.course import Course
from mission.findings import InputError
from mission.flying.flight_log import read_flight_log
from mission.flying.journal import course_at, explored_positions, unfinished
from mission.flying.recorder import LOG_NAME, Recorder
from mission.flying.ways import along
from planner.problem import Limits
from tests.mission.flying_vehicle import STATE
from tests.mission.proven import proven

CURVE = proven(along(np.array([[0.0, 0.0, 10.0], [200.0, 0.0, 10.0]]), Limits(5.0, 2.0, 1.5, 3.0)))


def state(time_s, position):
    return dataclasses.replace(STATE, time_s=time_s, position_enu_m=position, velocity_enu_mps=(1.0, 0.0, 0.0))


def write(folder, seconds=10.0, from_s=0.0, course=CURVE):
    recorder = Recorder(folder, {"name": "test", "link": "sim"}, goes_on=(folder / LOG_NAME).exists())
    recorder.course(0.0, recorder.keep(course).result(), "plan")
    recorder.write("phase", 0.0, phase="exploring", why="")
    flown = Course.begin(course, 0.0, 0.0, 3.0, 1.0, from_s=from_s)
    for now in np.arange(0.0, seconds, 0.1):
        point = flown.at(now)
        recorder.setpoint(now, point, point.setpoint())
        place = tuple(point.motion.position_m.tolist())
        recorder.telemetry(now, state(now, place), "exploring", place)
    recorder.write("progress", seconds - 1.0, explored_s=float(flown.at(seconds - 1.0).curve_s))
    return recorder


def test_what_was_written_is_read_back(tmp_path):
    write(tmp_path).close()
    log = read_flight_log(tmp_path)
    assert len(log.time_s) == 100
    assert log.exploring().all()
    assert np.abs(log.position_m - log.target_m).max() == 0.0
    assert log.header["name"] == "test"
    (taken_s, course), *_ = log.courses
    assert taken_s == 0.0
    assert np.array_equal(course.control_points_m, CURVE.control_points_m)


def test_tilt_is_read_back_and_a_log_of_before_it_was_told_is_read_without(tmp_path):
    write(tmp_path).close()
    path = tmp_path / LOG_NAME
    path.write_text(path.read_text().replace('"tilt":null', '"tilt":[0.5,-0.25]', 1).replace('"tilt":null,', "", 1))
    log = read_flight_log(tmp_path)
    assert log.skipped == ()
    assert log.tilt_mps2[0].tolist() == [0.5, -0.25]
    assert len(log.tilt_mps2) == 100
    assert np.isnan(log.tilt_mps2[1:]).all()


def test_lines_reach_the_system_without_anybody_closing_the_log(tmp_path):
    recorder = write(tmp_path)
    until = time.monotonic() + 20.0
    while len(read_flight_log(tmp_path).time_s) < 100 and time.monotonic() < until:
        time.sleep(0.01)
    assert len(read_flight_log(tmp_path).time_s) == 100
    recorder.close()


def test_a_last_line_that_a_kill_tore_is_left_out(tmp_path):
    write(tmp_path).close()
    with (tmp_path / LOG_NAME).open("a") as file:
        file.write('{"kind":"telemetry","t":10.0,"p":[1.0,')
    assert len(read_flight_log(tmp_path).time_s) == 100


def test_a_flight_that_went_on_behind_a_torn_line_is_read_as_one(tmp_path):
    write(tmp_path).close()
    with (tmp_path / LOG_NAME).open("a") as file:
        file.write('{"kind":"telemetry","t":10.0,"p":[1.0,')
    write(tmp_path, seconds=5.0, from_s=9.0).close()
    log = read_flight_log(tmp_path)
    assert len(log.time_s) == 150
    assert (np.diff(log.time_s) >= 0.0).all()
    assert len(log.courses) == 2


@pytest.mark.parametrize(
    "spoil",
    [
        lambda line: line[: len(line) // 2],
        lambda line: b"\0" * 64 + line,
        lambda line: b"\xff\xfe\0\0" * 100,
        lambda line: line.replace(b'"p":[', b'"p":[0.0,'),
        lambda line: b'["kind"]',
    ],
)
def test_a_damaged_line_is_skipped_and_said(tmp_path, spoil):
    write(tmp_path).close()
    lines = (tmp_path / LOG_NAME).read_bytes().splitlines()
    number = next(index for index, line in enumerate(lines) if b'"telemetry"' in line)
    lines[number] = spoil(lines[number])
    (tmp_path / LOG_NAME).write_bytes(b"\n".join(lines) + b"\n")
    log = read_flight_log(tmp_path)
    assert len(log.time_s) in (99, 100)
    assert log.skipped == (f"1 damaged lines of log.jsonl, the first of them line {number + 1}",)
    left = unfinished(log)
    assert left is not None
    assert left.from_s == pytest.approx(9.9, abs=0.11)


def test_a_flight_whose_second_header_is_lost_is_read_with_its_times_in_order(tmp_path):
    write(tmp_path, seconds=20.0).close()
    write(tmp_path, seconds=10.0, from_s=19.0).close()
    lines = (tmp_path / LOG_NAME).read_bytes().splitlines()
    second = max(index for index, line in enumerate(lines) if b'"kind":"header"' in line)
    lines[second] = b"\0" * 80
    (tmp_path / LOG_NAME).write_bytes(b"\n".join(lines))
    log = read_flight_log(tmp_path)
    assert (np.diff(log.time_s) >= 0.0).all()
    assert len(log.time_s) == 300


def test_without_its_last_course_a_flight_goes_on_along_the_one_before(tmp_path):
    recorder = write(tmp_path)
    shifted = dataclasses.replace(CURVE.from_knot(10), control_points_m=CURVE.from_knot(10).control_points_m + 1.0)
    recorder.course(9.5, recorder.keep(proven(shifted)).result(), "replan")
    recorder.close()
    path = tmp_path / "course-001.json"
    assert course_at(read_flight_log(tmp_path), 9.8).start_s == shifted.start_s
    path.write_text("{")
    log = read_flight_log(tmp_path)
    assert len(log.courses) == 1
    assert "course 1" in log.skipped[0]
    assert course_at(log, 9.8).start_s == 0.0


def test_a_slowed_course_that_is_lost_is_made_again_from_the_one_that_was_slowed(tmp_path):
    recorder = write(tmp_path)
    recorder.course(0.0, recorder.keep(proven(CURVE.slowed(1.7))).result(), "slowed")
    recorder.close()
    (tmp_path / "course-001.json").unlink()
    (_, made) = read_flight_log(tmp_path).courses[1]
    assert made.knot_interval_s == pytest.approx(1.7 * CURVE.knot_interval_s)


def test_a_file_that_no_flight_wrote_is_refused(tmp_path):
    (tmp_path / LOG_NAME).write_bytes(b"\x89PNG\r\n\x1a\n" * 50)
    with pytest.raises(InputError, match="nothing that a flight wrote"):
        read_flight_log(tmp_path)


def test_a_log_of_another_version_is_refused(tmp_path):
    write(tmp_path).close()
    text = (tmp_path / LOG_NAME).read_text().replace('"version":1', '"version":7', 1)
    (tmp_path / LOG_NAME).write_text(text)
    with pytest.raises(InputError, match="version 7"):
        read_flight_log(tmp_path)


def test_a_folder_without_a_log_is_refused(tmp_path):
    with pytest.raises(InputError, match="give the folder"):
        read_flight_log(tmp_path)


def test_numbers_that_are_none_never_reach_the_log(tmp_path):
    recorder = write(tmp_path)
    with pytest.raises(ValueError, match="JSON"):
        recorder.write("say", 0.0, value=float("nan"))
    recorder.close()


def test_what_is_left_begins_where_the_last_setpoint_went(tmp_path):
    write(tmp_path, seconds=20.0).close()
    left = unfinished(read_flight_log(tmp_path))
    assert left is not None
    assert left.from_s == pytest.approx(19.9, abs=0.11)
    assert left.remaining_s == pytest.approx(CURVE.end_s - 19.9, abs=0.2)
    for s in (left.from_s, left.from_s + 3.0, CURVE.end_s):
        assert left.trajectory.motion_at(s).position_m == pytest.approx(CURVE.motion_at(s).position_m)
    assert len(left.flown_m) == pytest.approx(199, abs=2)


def test_a_flight_that_explored_everything_leaves_nothing(tmp_path):
    recorder = write(tmp_path, seconds=CURVE.end_s + 1.0)
    recorder.write("phase", CURVE.end_s + 1.0, phase="landed", why="on the ground, disarmed")
    recorder.close()
    assert unfinished(read_flight_log(tmp_path)) is None


def test_what_was_flown_before_and_after_an_interruption_counts_and_the_pause_does_not(tmp_path):
    write(tmp_path, seconds=20.0).close()
    write(tmp_path, seconds=10.0, from_s=20.0).close()
    assert len(explored_positions(read_flight_log(tmp_path))) == pytest.approx(300, abs=5)


def test_the_log_is_json_a_line_with_both_clocks(tmp_path):
    write(tmp_path).close()
    for line in (tmp_path / LOG_NAME).read_text().splitlines():
        assert {"kind", "t", "host"} <= json.loads(line).keys()
