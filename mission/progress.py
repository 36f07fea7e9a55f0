"""Progress of a solve on stderr: a bar at a terminal, a line a phase elsewhere."""

from __future__ import annotations

import contextlib
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from mission.console import say
from mission.interrupts import Interrupts

if TYPE_CHECKING:
    from planner.solver import Progress as SolverProgress


class SolveProgress:
    """Shows how far a solve is while it is entered; Ctrl-C ends it at the latest where it tells, or is left."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        self._phase = ""
        self._bar = Progress(
            TextColumn("{task.description:<28}"),
            BarColumn(bar_width=32),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("starting the solver", total=1.0)

    def __enter__(self) -> SolveProgress:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):
            self._bar.stop()
        if kind is None:
            Interrupts.check()

    def update(self, progress: SolverProgress) -> None:
        """What the solver tells.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed, and what it raised was swallowed.
        """
        Interrupts.check()
        best = f", E {progress.best_ergodic_metric:.3g}" if progress.best_ergodic_metric is not None else ""
        with contextlib.suppress(OSError):
            self._bar.update(self._task, description=f"{progress.phase}{best}", completed=progress.done)
        if self._bar.disable and progress.phase != self._phase:
            say(f"{progress.phase} …")
        self._phase = progress.phase
