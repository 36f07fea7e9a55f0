"""Ctrl-C before a flight: it raises at once, and is remembered where what it raised is swallowed.

Python passes over what is raised inside a callback of the garbage collector, and JAX has one there: without the memory
a plan would go on, and a flight after it. In the air other rules hold (`mission.flying.flight`).
"""

from __future__ import annotations

import os
import signal
from types import FrameType, TracebackType
from typing import ClassVar

from mission.console import Exit


class Interrupts:
    """While entered: Ctrl-C raises `KeyboardInterrupt`, again wherever `check` is called; twice ends the process."""

    asked: ClassVar[bool] = False
    """Whether it was pressed."""

    def __enter__(self) -> Interrupts:
        Interrupts.asked = False
        self._before = signal.signal(signal.SIGINT, self._interrupt)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        signal.signal(signal.SIGINT, self._before)
        Interrupts.asked = False

    @staticmethod
    def check() -> None:
        """Where it is safe to stop.

        Raises:
            KeyboardInterrupt: It was pressed.
        """
        if Interrupts.asked:
            raise KeyboardInterrupt

    def _interrupt(self, _signal: int, _frame: FrameType | None) -> None:
        if Interrupts.asked:
            # Whatever is in the way of an orderly end.
            os._exit(Exit.INTERRUPTED)
        Interrupts.asked = True
        raise KeyboardInterrupt
