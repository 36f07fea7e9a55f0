"""A terminal that blocks or is gone: the flight does not notice."""

import threading

from mission.executive.phases import Phase
from mission.flying import detached_watcher
from mission.flying.detached_watcher import DetachedWatcher
from mission.flying.flight_progress import PlainWatcher, Progress, Watcher

PROGRESS = Progress(1.0, Phase.FOLLOWING, 0.5, 3.0, None, 0)


class Gone:
    """A stream whose reader went away."""

    def write(self, text):
        raise BrokenPipeError(32, "Broken pipe")

    def flush(self):
        raise BrokenPipeError(32, "Broken pipe")


class Stuck(Watcher):
    """A terminal that takes nothing until it is let go."""

    def __init__(self):
        self.let_go = threading.Event()
        self.said = []

    def say(self, text, warning):
        self.let_go.wait(20.0)
        self.said.append(text)


def test_a_terminal_that_is_gone_raises_nothing():
    watcher = DetachedWatcher(PlainWatcher(Gone()))
    for _ in range(3):
        watcher.say("taking off", False)
        watcher.progress(PROGRESS)
    watcher.close()


def test_a_terminal_that_blocks_is_not_waited_for_and_gets_the_rest_later(monkeypatch):
    monkeypatch.setattr(detached_watcher, "_CLOSE_HOST_S", 0.05)
    stuck = Stuck()
    watcher = DetachedWatcher(stuck)
    for number in range(5000):
        watcher.say(str(number), False)
    assert stuck.said == []
    stuck.let_go.set()
    watcher._thread.join(0.2)
    assert stuck.said[:3] == ["0", "1", "2"]
    watcher.close()


def test_what_is_said_before_the_end_is_shown():
    stuck = Stuck()
    stuck.let_go.set()
    watcher = DetachedWatcher(stuck)
    watcher.say("landed", False)
    watcher.close()
    assert stuck.said == ["landed"]
