"""The process beside the flight that replans: it answers, dies, hangs, or says what nobody can read."""

import dataclasses
import time

import pytest

from mission.flying.replanning import Replanner, Reply, Request
from tests.mission.street import request


def quick(asked: Request) -> Reply:
    """Stands for the solver in the other process."""
    if asked.time_limit_s < 0.0:
        raise SystemExit(7)
    return Reply(asked, None, 0.5, 0.01, f"asked with {asked.number}")


def wait(replanner: Replanner, seconds=20.0) -> Reply:
    until = time.monotonic() + seconds
    while (answer := replanner.poll()) is None:
        assert time.monotonic() < until
        time.sleep(0.01)
    return answer


def test_the_other_process_answers_and_one_question_at_a_time_is_asked():
    replanner = Replanner(quick)
    try:
        assert replanner.poll() is None
        replanner.ask(dataclasses.replace(request(), number=3))
        assert replanner.busy
        with pytest.raises(ValueError, match="under way"):
            replanner.ask(request())
        assert wait(replanner).failure == "asked with 3"
        assert replanner.warm
        assert not replanner.busy
        assert replanner.lead_host_s() == pytest.approx(0.3 + 1.5 * 0.01)
    finally:
        replanner.close()


def test_a_process_that_dies_is_an_answer_and_not_an_error():
    replanner = Replanner(quick)
    try:
        replanner.ask(dataclasses.replace(request(), time_limit_s=-1.0))
        answer = wait(replanner)
        assert answer.plan is None
        assert "ended" in replanner.lost
    finally:
        replanner.close()


class Garbled:
    """What can be sent and not be read."""

    def __reduce__(self):
        return int, ("no number",)


def garble(asked: Request) -> Reply:
    return Reply(asked, Garbled(), 0.5, 0.01)


def test_an_answer_that_cannot_be_read_is_an_answer_too():
    replanner = Replanner(garble)
    try:
        replanner.ask(dataclasses.replace(request(), number=3))
        assert wait(replanner).plan is None
        assert "cannot be read" in replanner.lost
    finally:
        replanner.close()


def never(asked: Request) -> Reply:
    time.sleep(1000.0)
    raise AssertionError(asked)


def test_a_process_that_hangs_is_ended_and_is_an_answer(monkeypatch):
    replanner = Replanner(never)
    try:
        replanner.ask(dataclasses.replace(request(), number=3))
        assert replanner.poll() is None
        monkeypatch.setattr("mission.flying.replanning.HUNG_HOST_S", 0.1)
        time.sleep(0.2)
        answer = wait(replanner)
        assert answer.plan is None
        assert "has not answered" in answer.failure
        assert "has not answered" in replanner.lost
        assert not replanner.busy
    finally:
        replanner.close()
