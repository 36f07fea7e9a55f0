"""Tells how the flight stands: the log once a second of flight, whoever watches some times a second."""

from __future__ import annotations

import time

import numpy as np

from mission.executive.executive import Executive
from mission.executive.phases import ON_COURSE
from mission.flying.flight_progress import Progress, Watcher
from mission.flying.recorder import Recorder

_SHOW_HOST_S = 0.25
_NOTE_S = 1.0


class Standing:
    """How one flight stands.

    Args:
        executive: Knows it.
        recorder: Told for the log.
        watcher: Told to be seen.
    """

    def __init__(self, executive: Executive, recorder: Recorder, watcher: Watcher) -> None:
        self._executive = executive
        self._recorder = recorder
        self._watcher = watcher
        self._shown_host_s = 0.0
        self._noted_s = 0.0

    def note(self, now_s: float) -> None:
        """Write down how far it is explored.

        Args:
            now_s: Flight clock.
        """
        self._noted_s = now_s
        self._recorder.write("progress", now_s, explored_s=round(self._executive.explored_s(now_s), 3))

    def tell(self, now_s: float, replans_taken: int) -> None:
        """Note it and show it, if it is time to.

        Args:
            now_s: Flight clock.
            replans_taken: New plans flown so far.
        """
        if now_s - self._noted_s >= _NOTE_S:
            self.note(now_s)
        host_s = time.monotonic()
        if host_s - self._shown_host_s < _SHOW_HOST_S:
            return
        self._shown_host_s = host_s
        executive, state = self._executive, self._executive.state
        end_s = max(executive.exploration.end_s, 1e-9)
        # On its way up and down the nearest thing is the ground.
        place = np.asarray(state.position_enu_m) if state is not None and executive.phase in ON_COURSE else None
        self._watcher.progress(
            Progress(
                time_s=now_s,
                phase=executive.phase,
                explored=min(1.0, executive.explored_s(now_s) / end_s),
                clearance_m=float("inf") if place is None else float(executive.monitors.clearance_m(place)),
                battery_fraction=None if state is None else state.battery_fraction,
                replans_taken=replans_taken,
            )
        )
