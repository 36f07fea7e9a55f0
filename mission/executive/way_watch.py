"""Holds everything that is flown next against what is known: climb, course, uploaded mission and way down."""

from __future__ import annotations

from collections.abc import Callable

from mission.executive.course_keeper import CourseKeeper
from mission.executive.events import FlightEnd, MissionPlace
from mission.executive.known_vehicle import KnownVehicle
from mission.executive.landing import Landing
from mission.executive.lookout import Lookout
from mission.executive.phase_machine import PhaseMachine
from mission.executive.phases import ON_COURSE, Phase, Trigger
from mission.executive.uploaded import is_blocked
from planner.problem import Problem


class WayWatch:
    """Fires when something that was learned is in the way; nothing has to tell it that something was.

    Args:
        known: What is known now; its obstacles are another object whenever some were learned.
        end: What happens after the exploration.
        vehicle: The vehicle as far as it was heard.
        keeper: Keeps the course.
        landing: Chooses where to land.
        machine: Takes the triggers.

    Attributes:
        places: Of an uploaded mission; empty: none was uploaded.
        reached: Number of its item that was reached last; None: none yet.
        blocked_s: Curve time from which what is known blocks the course; None: nowhere, or no course is flown.
    """

    def __init__(
        self,
        known: Callable[[], Problem],
        end: FlightEnd,
        vehicle: KnownVehicle,
        keeper: CourseKeeper,
        landing: Landing,
        machine: PhaseMachine,
    ) -> None:
        self.places: tuple[MissionPlace, ...] = ()
        self.reached: int | None = None
        self.blocked_s: float | None = None
        self._known = known
        self._end = end
        self._vehicle = vehicle
        self._keeper = keeper
        self._landing = landing
        self._machine = machine
        self._ahead = Lookout(known)
        self._held_against = (known().obstacles, machine.phase)
        self._landing_against = known().obstacles

    def watch(self, now_s: float) -> None:
        """Look at what is flown next, where it or what is known has changed."""
        self._watch_known(now_s)
        self._watch_block(now_s)

    @property
    def mission_done(self) -> bool:
        """Whether the last place of an uploaded mission was reached."""
        return self.reached is not None and bool(self.places) and self.reached >= self.places[-1].number

    @property
    def past_the_last(self) -> int | None:
        """By how many items the one that was reached comes after an uploaded mission's last place; None: none is flown.

        Autopilots count from different numbers, and the last place is known to all of them.
        """
        return self.reached - self.places[-1].number if self.places and self.reached is not None else None

    def _watch_known(self, now_s: float) -> None:
        """Hold the climb, the uploaded mission and the way down against what was learned."""
        phase, before = self._machine.phase, self._held_against
        self._held_against = (self._known().obstacles, phase)
        learned, entered = self._held_against[0] is not before[0], phase is not before[1]
        if not (learned or entered) or self._vehicle.state is None:
            return
        position_m = self._vehicle.state.position_enu_m
        home_m = self._vehicle.home_m or position_m
        match phase:
            case Phase.ARMING | Phase.TAKING_OFF:
                blocked = not self._landing.clear(home_m, from_up_m=position_m[2])
            case Phase.AUTO_MISSION:
                end_m = self.places[-1].position_m if self.places else position_m
                leads_clear = not is_blocked(self.places, self.reached, self._known())
                blocked = not (leads_clear and self._landing.clear_at_end(end_m, home_m, self._end))
            case Phase.LANDING:
                if entered and self._machine.stay.before is not Phase.RETURN_PAUSED:
                    # What was known before is what it was allowed to land beside.
                    self._landing_against = before[0]
                news = self._held_against[0] is not self._landing_against
                self._landing_against = self._held_against[0]
                below_m = self._landing.below(position_m, home_m[2])
                blocked = news and not self._landing.clear(below_m, position_m[2])
            case _:
                blocked = False
        if blocked:
            self._machine.fire(Trigger.BLOCKED, now_s)

    def _watch_block(self, now_s: float) -> None:
        """Look along the course ahead, and brake in time before what blocks it."""
        keeper, before_s = self._keeper, self.blocked_s
        self.blocked_s = None
        if keeper.course is None or self._machine.phase not in (*ON_COURSE, Phase.HOLDING):
            return
        here_s, watched_s = keeper.course.at(now_s).curve_s, keeper.watched_s(now_s)
        block = self._ahead.look(keeper.course.curves, here_s, watched_s)
        if block is not None:
            self.blocked_s = block.curve_s
            if before_s is None:
                east, north, up = block.place_m
                where = f"({east:.0f}, {north:.0f}, {up:.0f})"
                self._machine.say(f"the course is blocked ahead: something is too near to {where}", warning=True)
        # What was not looked along yet counts as blocked.
        clear_until_s = self._ahead.looked_s if self.blocked_s is None else self.blocked_s
        if self._machine.phase in ON_COURSE and watched_s >= clear_until_s:
            self._machine.fire(Trigger.BLOCKED, now_s)
