"""The setpoint stream: a thread of its own that nothing in the flight can stall.

It reads the course from one slot and the flight clock from the host's monotonic one. If nobody renews the slot for half
a second, whoever should watch the flight is stuck: it brakes along the course by itself and stands there, streaming.

Nothing is sent or recorded behind its lock, so that following another course, or none, waits for neither.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from mission.executive.course import Course, CoursePoint
from mission.flying.clock import FlightClock
from sim_bridge.state import Setpoint

STALE_S = 0.5
"""Host seconds without a renewal after which the stream brakes."""
LATE_S = 0.6
"""Host seconds without a setpoint that a vehicle may take for the end of the stream: PX4 does after a second."""

_AGAIN_SHARE = 0.2

Send = Callable[[Setpoint], None]
Record = Callable[[float, CoursePoint, Setpoint], None]


class Streamer:
    """Sends setpoints at a fixed rate of the flight clock.

    Args:
        clock: The flight clock.
        rate_hz: Setpoints a flight second.
        send: Sends one, if they are let out.
        start: Lets setpoints out.
        stop: Lets no setpoint out any more, whoever is sending one.
        record: Told of each one sent: flight clock, point of the course, setpoint.
        drag_per_s: What setpoints lean against, 1/s.
    """

    def __init__(
        self,
        clock: FlightClock,
        rate_hz: float,
        send: Send,
        start: Callable[[], None],
        stop: Callable[[], None],
        record: Record,
        drag_per_s: float = 0.0,
    ) -> None:
        self._clock = clock
        self._period_s = 1.0 / rate_hz
        self._send = send
        self._start = start
        self._stop = stop
        self._record = record
        self._drag_per_s = drag_per_s
        self._lock = threading.Lock()
        self._course: Course | None = None
        self._renewed_s = time.monotonic()
        self._stalled: Course | None = None
        self._sent_s = -math.inf
        self._sent_host_s = math.inf
        self._late = False
        self._failed = False
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="setpoints", daemon=True)
        self._thread.start()

    def follow(self, course: Course | None) -> None:
        """Follow another course from the next setpoint on; None: send nothing more, at once.

        A course that was braked on meanwhile is not taken up where it would be by now: `renew` first tells where it
        stands.
        """
        if course is None:
            self._stop()
        elif self._course is None:
            self._start()
        with self._lock:
            if course is not None and self._stalled is not None and course.legs is self._stalled.legs:
                return
            if self._course is None or course is None:
                # Another stream begins, or none: there is nothing yet that could be late.
                self._sent_host_s = math.inf
            self._course, self._stalled = course, None
            self._renewed_s = time.monotonic()

    def renew(self) -> Course | None:
        """Say that the flight is watched.

        Returns:
            The course that was braked on while nobody watched; None: it never came to that.
        """
        with self._lock:
            self._renewed_s = time.monotonic()
            stalled, self._stalled = self._stalled, None
            return stalled

    def was_late(self) -> bool:
        """Whether setpoints came late since this was asked last, or are late now."""
        with self._lock:
            late, self._late = self._late or time.monotonic() - self._sent_host_s > LATE_S, False
            return late

    @property
    def failed(self) -> bool:
        """Whether setpoints cannot be sent any more."""
        return self._failed

    def close(self) -> None:
        """Stop for good."""
        self._closed.set()
        self._thread.join(2.0)
        self._stop()

    def _run(self) -> None:
        due_s = time.monotonic()
        try:
            while not self._closed.is_set():
                host_s = time.monotonic()
                waits = not self._step(host_s)
                period_s = self._period_s / self._clock.rate
                due_s = host_s + _AGAIN_SHARE * period_s if waits else max(due_s + period_s, host_s)
                self._closed.wait(max(0.0, due_s - time.monotonic()))
        finally:
            # Whatever ends this thread: its last setpoint is not repeated for ever.
            self._failed = not self._closed.is_set()
            self._stop()

    def _step(self, host_s: float) -> bool:
        """Send a setpoint, if there is a course; False: the clock stands, so it is to be tried again soon."""
        # A setpoint holds until the next one: what is sent is the middle of that time.
        now_s = self._clock.now(host_s) + 0.5 * self._period_s
        with self._lock:
            if self._course is None:
                return True
            if host_s - self._renewed_s > STALE_S and self._course.pace.target_rate > 0.0:
                self._course = self._stalled = self._course.braking(now_s)
            course = self._course
            self._late |= host_s - self._sent_host_s > LATE_S
        if now_s - self._sent_s < 0.5 * self._period_s:
            # The clock waits for a simulator whose words have not come through yet; were it told to go on where it is,
            # it would run ahead of the course.
            return False
        self._sent_s = now_s
        point = course.at(now_s)
        setpoint = point.setpoint(self._drag_per_s)
        self._send(setpoint)
        with self._lock:
            if self._course is not None:
                self._sent_host_s = host_s
        self._record(now_s, point, setpoint)
        return True
