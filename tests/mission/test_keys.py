"""Keys over a pseudo-terminal, as a person's terminal is."""

import io
import os
import pty
import queue
import threading
import time

from mission.executive.events import Operator
from mission.keys import listening


def test_keys_are_heard_one_by_one_without_return():
    ours, theirs = pty.openpty()
    heard: queue.Queue[Operator] = queue.Queue()
    with os.fdopen(theirs, "r") as terminal, listening(heard.put, terminal) as at_terminal:
        assert at_terminal
        for key, wish in ((b"p", Operator.PAUSE), (b"x", None), (b"R", Operator.RESUME), (b"l", Operator.LAND)):
            os.write(ours, key)
            if wish is not None:
                assert heard.get(timeout=5.0) is wish
    assert heard.empty()
    os.close(ours)


def test_a_terminal_that_goes_away_is_let_go_without_a_word():
    ours, theirs = pty.openpty()
    before = threading.active_count()
    with os.fdopen(theirs, "r") as terminal, listening(lambda wish: None, terminal) as at_terminal:
        assert at_terminal
        os.close(ours)
        until = time.monotonic() + 10.0
        while threading.active_count() > before and time.monotonic() < until:
            time.sleep(0.01)
        assert threading.active_count() == before


def test_where_there_is_no_terminal_nothing_is_listened_to():
    with listening(lambda wish: None, io.StringIO("p")) as at_terminal:
        assert not at_terminal
