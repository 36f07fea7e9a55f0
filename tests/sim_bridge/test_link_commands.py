"""The thread that gives commands: one that fails in a way nobody foresaw is refused, and the next one is given."""

import time
from types import SimpleNamespace

import pytest

from sim_bridge.dialects import Autopilot
from sim_bridge.link import commands
from sim_bridge.link.inbox import Inbox
from sim_bridge.state import Command, CommandDone


@pytest.fixture
def inbox(monkeypatch):
    """Where the answers of a worker go whose commands do nothing, but arming, which breaks."""

    def carry_out(self, command, altitude_m):
        if command is Command.ARM:
            raise KeyError("result")

    def ask(self):
        raise KeyError("result")

    for plugin in ("Action", "MavlinkDirect"):
        monkeypatch.setattr(commands, plugin, lambda system: None)
    monkeypatch.setattr(commands.Commands, "_carry_out", carry_out)
    monkeypatch.setattr(commands.Commands, "_command_long", lambda self, *_: ask(self))
    monkeypatch.setattr(commands, "_IDLE_S", 0.01)
    monkeypatch.setattr(commands, "_ASK_AGAIN_S", 0.0)
    inbox = Inbox()
    worker = commands.Commands(None, 1, None, SimpleNamespace(autopilot=Autopilot.ARDUPILOT), inbox)
    yield inbox, worker
    worker.close()


def answers(inbox, count):
    found, until = [], time.monotonic() + 20.0
    while len(found) < count and time.monotonic() < until:
        found += [timed.event for timed in inbox.taken(0.1)]
    return found


def test_a_command_that_breaks_is_refused_and_the_next_is_given(inbox):
    heard, worker = inbox
    worker.request(Command.ARM, None)
    worker.request(Command.LAND, None)
    assert answers(heard, 2) == [
        CommandDone(Command.ARM, False, "KeyError: 'result'"),
        CommandDone(Command.LAND, True),
    ]


def test_asking_for_what_is_not_sent_may_break_and_commands_are_still_given(inbox):
    heard, worker = inbox
    time.sleep(0.1)
    worker.request(Command.LAND, None)
    assert answers(heard, 1) == [CommandDone(Command.LAND, True)]
