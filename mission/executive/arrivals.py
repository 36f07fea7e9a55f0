"""What comes when a curve has come to its end: the vehicle is waited for, explores, lands, or is under control."""

from __future__ import annotations

from mission.executive.course_keeper import CourseKeeper
from mission.executive.events import FlightEnd
from mission.executive.known_vehicle import KnownVehicle
from mission.executive.landing import Landing
from mission.executive.phase_machine import GOAL, PhaseMachine
from mission.executive.phases import ON_COURSE, Phase, Trigger
from mission.executive.standing_order import STREAM_FIRST_S
from sim_bridge.state import FlightMode

_ARRIVES_WITHIN_S = 10.0
"""A vehicle that overshoots comes back within 3 to 5 s."""

_END_TRIGGER = {
    FlightEnd.RETURN: Trigger.EXPLORED,
    FlightEnd.LAND: Trigger.EXPLORED_LAND,
    FlightEnd.HOLD: Trigger.EXPLORED_HOLD,
}


class Arrivals:
    """Fires when a course is over and the vehicle is where it leads.

    Args:
        end: What happens after the exploration.
        vehicle: The vehicle as far as it was heard.
        keeper: Keeps the course.
        landing: Chooses where to land.
        machine: Takes the triggers.
    """

    def __init__(
        self, end: FlightEnd, vehicle: KnownVehicle, keeper: CourseKeeper, landing: Landing, machine: PhaseMachine
    ) -> None:
        self._end = end
        self._vehicle = vehicle
        self._keeper = keeper
        self._landing = landing
        self._machine = machine

    def watch(self, now_s: float) -> None:
        """Look whether the course has come to its end.

        Args:
            now_s: Flight clock.
        """
        keeper, stay, phase = self._keeper, self._machine.stay, self._machine.phase
        if keeper.course is None:
            return
        if phase in GOAL:
            follows = self._vehicle.mode is FlightMode.EXTERNAL
            streamed = stay.lasted_s(now_s) >= STREAM_FIRST_S or phase is Phase.TURNING_BACK
            # One that follows already brakes with its course; one that is taken over stands where it was, and may move.
            taken_over = phase is not Phase.TURNING_BACK
            if taken_over and stay.lasted_s(now_s) < _ARRIVES_WITHIN_S and self._waits_for_vehicle():
                return
            if follows and streamed and keeper.way is not None and keeper.stands(now_s):
                self._machine.fire(Trigger.UNDER_CONTROL, now_s)
        elif phase is Phase.FOLLOWING and keeper.finished(now_s):
            self.end_exploration(now_s)
        elif phase is Phase.TRANSIT and keeper.finished(now_s):
            self._arrive_to_explore(now_s)
        elif phase in ON_COURSE and keeper.finished(now_s):
            self._machine.fire(self._arrival(), now_s)

    def end_exploration(self, now_s: float) -> None:
        """The exploration is over, by whoever flew it: on to what the mission ends with.

        Args:
            now_s: Flight clock.
        """
        self._keeper.explored = True
        trigger, course, home_m = _END_TRIGGER[self._end], self._keeper.course, self._vehicle.home_m
        if (
            trigger is Trigger.EXPLORED_LAND
            and course is not None
            and home_m is not None
            and not self._landing.clear_at_end(course.stop_position(), home_m, self._end)
        ):
            self._machine.say("something stands below the end of the path: it lands at home", warning=True)
            trigger = Trigger.EXPLORED
        self._machine.fire(trigger, now_s)

    def _arrive_to_explore(self, now_s: float) -> None:
        """Begin the exploration once the vehicle stands where that begins; wind may keep it from that for ever."""
        waits = self._waits_for_vehicle()
        if waits and self._keeper.over_s(now_s) < _ARRIVES_WITHIN_S:
            return
        if waits:
            self._machine.say("it has not come to rest at the start of the exploration: going on", warning=True)
        self._machine.fire(self._arrival(), now_s)

    def _waits_for_vehicle(self) -> bool:
        return self._vehicle.state is not None and self._keeper.waits_for(self._vehicle.state)

    def _arrival(self) -> Trigger:
        """What the end of a way is: above home it must be clear below, or it lands elsewhere, or nowhere."""
        place_m, home_m = self._machine.landing_m, self._vehicle.home_m
        returning = self._machine.phase is Phase.RETURNING
        if not returning or place_m is None or home_m is None or self._landing.clear(place_m):
            return Trigger.ARRIVED
        return Trigger.NO_LANDING if self._landing.place(home_m, place_m) is None else Trigger.BLOCKED
