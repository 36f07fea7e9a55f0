"""At what pace a course is flown: less where it leads past something, by a vehicle that has shown that it strays."""

from __future__ import annotations

from mission.executive.course_keeper import CourseKeeper
from mission.executive.monitors import Monitors
from mission.executive.phase_machine import PhaseMachine
from mission.executive.straying import Straying
from sim_bridge.state import VehicleState

# How far a vehicle strays that is asked for less shows only after a while.
_SETTLES_S = 5.0
# To look that far ahead takes a while itself.
_LOOKS_AGAIN_S = 1.0


class Pacing:
    """Watches how far one vehicle strays, and asks less of it, or all again.

    Args:
        keeper: Keeps the course.
        machine: Has it streamed.
    """

    def __init__(self, keeper: CourseKeeper, machine: PhaseMachine) -> None:
        self._keeper = keeper
        self._machine = machine
        self._straying = Straying()
        self._at_rate = keeper.rate
        self._shown_m = 0.0
        """How far it has strayed, at the full pace; that it was slowed down does not make it better."""
        self._looked_s = float("-inf")

    def hear(self, state: VehicleState, monitors: Monitors, now_s: float) -> None:
        """Slow a vehicle that strays down before its course leads past anything, and no longer than that.

        Args:
            state: What a vehicle on its course tells.
            monitors: What it is held against.
            now_s: Flight clock.
        """
        keeper, course = self._keeper, self._keeper.course
        if keeper.rate != self._at_rate:
            self._at_rate = keeper.rate
            self._straying.begin(now_s + _SETTLES_S)
        # Behind the end of a way there is no path any more that a vehicle could overshoot along.
        if course is None or course.stands(now_s):
            return
        strayed_m = self._straying.observe(monitors.beside_m(state, course, now_s), now_s)
        strays_m = max(strayed_m, self._shown_m * keeper.rate)
        share = monitors.manageable_share(strays_m, course, now_s)
        if share < 1.0:
            at_full_pace_m = strays_m / keeper.rate
            if self._machine.slow_down(now_s, share):
                self._shown_m = max(self._shown_m, at_full_pace_m)
                self._go_on(now_s)
        elif keeper.slowed_here and now_s - self._looked_s >= _LOOKS_AGAIN_S:
            self._looked_s = now_s
            if monitors.passes_nothing(self._shown_m, course, now_s):
                self._machine.speed_up()
                self._go_on(now_s)

    def _go_on(self, now_s: float) -> None:
        self._keeper.resume(now_s)
        self._machine.stream()
