"""What the person at the terminal sees while a flight goes on: one line that changes, and lines that stay."""

from __future__ import annotations

import dataclasses
import math
import sys
import time
from typing import TextIO

from mission.executive.phases import Phase

_PLAIN_HOST_S = 5.0


@dataclasses.dataclass(frozen=True)
class Progress:
    """How the flight stands.

    Attributes:
        time_s: Flight clock.
        phase: What it does.
        explored: Share of the exploration flown, 0 … 1.
        clearance_m: From the hull to the nearest obstacle; infinite or very large where there is none.
        battery_fraction: Charge left; None: not told.
        replans_taken: New plans flown so far.
    """

    time_s: float
    phase: Phase
    explored: float
    clearance_m: float
    battery_fraction: float | None
    replans_taken: int

    def line(self) -> str:
        """The progress as one line."""
        minutes, seconds = divmod(int(self.time_s), 60)
        parts = [f"{minutes:02d}:{seconds:02d}", self.phase.value, f"explored {self.explored:4.0%}"]
        if math.isfinite(self.clearance_m) and self.clearance_m < 1e4:
            parts.append(f"clearance {self.clearance_m:.1f} m")
        if self.battery_fraction is not None:
            parts.append(f"battery {self.battery_fraction:.0%}")
        if self.replans_taken:
            parts.append(f"{self.replans_taken} replan{'s' if self.replans_taken > 1 else ''}")
        return " · ".join(parts)


class Watcher:
    """Told what happens in a flight; by itself it keeps quiet."""

    def say(self, text: str, warning: bool) -> None:
        """A line that stays."""

    def progress(self, progress: Progress) -> None:
        """How the flight stands, some times a second."""

    def close(self) -> None:
        """The flight is over."""


class PlainWatcher(Watcher):
    """Lines only, for logs and pipes.

    Args:
        stream: Where they go.
    """

    def __init__(self, stream: TextIO = sys.stderr) -> None:
        self._stream = stream
        self._shown_s = -math.inf

    def say(self, text: str, warning: bool) -> None:
        """A line."""
        print(f"{'! ' if warning else '  '}{text}", file=self._stream, flush=True)

    def progress(self, progress: Progress) -> None:
        """A line every few seconds."""
        if time.monotonic() - self._shown_s >= _PLAIN_HOST_S:
            self._shown_s = time.monotonic()
            print(f"  {progress.line()}", file=self._stream, flush=True)


class TerminalWatcher(Watcher):
    """A line that changes in place below the lines that stay."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.live import Live

        self._console = Console(stderr=True, highlight=False)
        self._live = Live(console=self._console, refresh_per_second=4, transient=True)
        self._live.start()

    def say(self, text: str, warning: bool) -> None:
        """A line above the one that changes."""
        from rich.text import Text

        self._live.console.print(Text(text, style="yellow" if warning else ""))

    def progress(self, progress: Progress) -> None:
        """The line that changes."""
        from rich.text import Text

        self._live.update(Text(progress.line(), style="bold"))

    def close(self) -> None:
        """Take the changing line away."""
        self._live.stop()


def watcher_for(stream: TextIO = sys.stderr) -> Watcher:
    """A terminal's line, or plain lines where there is no terminal."""
    return TerminalWatcher() if stream.isatty() else PlainWatcher(stream)
