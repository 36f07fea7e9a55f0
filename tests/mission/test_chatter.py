"""What a vehicle says again and again is shown once; everything else always."""

import pytest

from mission.executive.events import Say
from mission.flying.chatter import QUIET_S, Chatter
from mission.flying.flight_log import read_flight_log
from mission.flying.flight_loop import FlightLoop
from mission.flying.flight_progress import Watcher
from mission.flying.recorder import Recorder
from mission.report import report_html
from tests.mission.rehearsed_flight import Flight
from tests.mission.test_flight_loop import Notes


def test_a_line_for_every_waypoint_is_one_line_until_the_vehicle_was_silent_for_a_while():
    chatter = Chatter()
    said = [chatter.repeats(f"vehicle: Reached command #{number}", 2.0 * number) for number in range(1, 60)]
    assert said == [False] + [True] * 58
    assert not chatter.repeats("vehicle: Reached command #60", 118.0 + 1.1 * QUIET_S)


@pytest.mark.parametrize("text", ["learned new obstacles (1)", "a new plan came too late and was dropped"])
def test_what_the_program_itself_says_is_never_a_repetition(text):
    chatter = Chatter()
    assert not any(chatter.repeats(text, float(now_s)) for now_s in range(5))


def test_other_words_of_the_vehicle_are_said_between_repetitions():
    chatter = Chatter()
    assert not chatter.repeats("vehicle: Reached command #1", 0.0)
    assert not chatter.repeats("vehicle: EKF3 IMU0 is using GPS", 1.0)
    assert chatter.repeats("vehicle: Reached command #2", 2.0)


def test_the_log_has_every_line_and_the_operator_sees_one():
    said = []

    class Shown(Watcher):
        def say(self, text, warning):
            said.append(text)

    log, shown = Notes(), Shown()
    loop = FlightLoop(Flight().executive, None, None, None, log, None, None, None, shown)  # pyright: ignore[reportArgumentType]
    for number in range(5):
        loop._act([Say(f"vehicle: Reached command #{number}")], float(number))
    loop._act([Say("vehicle: Battery 1 low", warning=True)] * 2, 5.0)
    assert said == ["vehicle: Reached command #0", *["vehicle: Battery 1 low"] * 2]
    assert [fields["text"][-1] for fields in log.written] == ["0", "1", "2", "3", "4", "w", "w"]


def test_the_report_has_one_line_for_it(tmp_path):
    recorder = Recorder(tmp_path, {})
    for number in range(5):
        recorder.write("say", float(number), text=f"vehicle: Reached command #{number}", warning=False)
    recorder.close()
    page = report_html(tmp_path, read_flight_log(tmp_path), {"flown_s": 5.0, "length_m": 9.0}, {})
    assert page.count("Reached command") == 1
